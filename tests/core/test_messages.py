from hypothesis import given
from hypothesis import strategies as st

from shutter_addon.core.messages import LONGEST, sentence, signed


def test_short_sentences_stay_and_long_ones_keep_the_place_and_the_reason():
    assert sentence('shutters[1].bars: 7 values, "Größe" is 8') == 'shutters[1].bars: 7 values, "Größe" is 8'
    assert signed("film.mp4: no such file") == "Virtual Shutter: film.mp4: no such file"
    said = signed("regions[3].strokes: " + "x" * 5000 + ", not a number")
    assert len(said) == LONGEST
    assert said.startswith("Virtual Shutter: regions[3].strokes: xxx")
    assert said.endswith("xxx, not a number")
    # What no terminal shows is escaped.
    assert sentence("a\x00b\x1b[31mc") == r"a\x00b\x1b[31mc"
    assert sentence("name\udcff.png: gone\nagain") == r"name\udcff.png: gone again"


@given(st.text(alphabet=st.characters(codec=None), max_size=2000), st.integers(20, 400))
def test_every_sentence_is_one_line_that_can_be_written(text, longest):
    said = sentence(text, longest)
    assert len(said) <= longest
    assert said.isprintable()
    said.encode("utf-8")
