import pytest
from hypothesis import given
from hypothesis import strategies as st

from shutter_addon.core.frames import frame_ranges
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


@pytest.mark.parametrize(
    ("frames", "words"), [([3], "frame 3"), ([5, 4], "frames 4 to 5"), ([9, 1, 3, 2, 12], "frames 1 to 3, 9, 12")]
)
def test_frames_in_words(frames, words):
    assert frame_ranges.in_words(frames) == words
