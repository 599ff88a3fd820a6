import re
import threading

import pytest

from shutter_addon.core import threads, told
from shutter_addon.core.recipes import recipe_file
from shutter_addon.core.recipes.recipe import RecipeError
from shutter_addon.media.errors import MediaError
from shutter_addon.media.files import check_file


@pytest.fixture(autouse=True)
def _nothing_told():
    told.forget()
    yield
    told.forget()


def texts():
    return [each.text for each in told.last()]


def test_the_oldest_go_and_those_told_again_stay():
    told.record("first")
    for number in range(told.MOST - 1):
        told.record(f"sentence {number}")
    told.record("first")
    told.record("one more")
    assert len(texts()) == told.MOST
    assert texts()[0] == "sentence 1"
    assert [each.times for each in told.last()[-2:]] == [2, 1]
    assert texts()[-2:] == ["first", "one more"]


def test_what_is_drawn_again_and_again_counts_once():
    for _ in range(5):
        told.shown("All bars are zero")
    assert [each.times for each in told.last()] == [1]


RAISED = r'raise MediaError\(f"\{path.name\}: no such file in \{.*\}"\) \[media/files\.py:\d+\]'


@pytest.mark.parametrize("told_as", ["{}", "Virtual Shutter: {}", "Datei: {}"])
def test_an_error_is_kept_as_the_source_text_that_raised_it(tmp_path, told_as):
    """Whoever tells it, and in whatever words around it."""
    with pytest.raises(MediaError) as raised:
        check_file(tmp_path / "Qanarix.png")
    told.record(told_as.format(raised.value))
    (kept,) = told.last()
    assert re.fullmatch(RAISED, kept.words)


def test_an_error_that_quotes_another_is_kept_with_it(tmp_path):
    (tmp_path / "Qanarix.json").write_text('{"version": 1, "window": 4, "shutters": []}')
    with pytest.raises(RecipeError) as raised:
        recipe_file.load(tmp_path / "Qanarix.json")
    told.record(raised.value)
    (kept,) = told.last()
    outer, inner = kept.words.split(" < ")
    assert outer.startswith('raise RecipeError(f"{path}: {error}") from None [core/recipes/recipe_file.py:')
    assert inner.startswith('raise RecipeError(f"{place}: {message}") [core/recipes/recipe_check.py:')


def test_words_of_other_code_are_not_quoted():
    told.record("Qanarix has said something")
    told.record(MediaError("Qanarix is gone"))
    assert {each.words for each in told.last()} == {"(words that are not the extension's own)"}


def test_an_error_that_nobody_expected_is_kept_without_what_it_says():
    with pytest.raises(TypeError) as raised:
        check_file(lambda: "a name")
    assert told.is_ours(raised.value)
    told.exception(raised.value)
    (kept,) = told.last()
    assert re.fullmatch(r"TypeError \[media/files\.py:\d+ check_file\]", kept.words)


def test_errors_of_others_are_not_ours():
    with pytest.raises(ValueError, match="invalid") as raised:
        int("invalid")
    assert not told.is_ours(raised.value)


def test_films_tell_from_their_own_threads():
    threads = [threading.Thread(target=lambda: [told.record("same") for _ in range(200)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [each.times for each in told.last()] == [800]


def test_what_a_thread_raises_that_nobody_waits_for(monkeypatch):
    """It is printed all the same, as Python does."""
    printed = []
    monkeypatch.setattr(threading, "excepthook", lambda raised: printed.append(raised.exc_type))
    threads.daemon(check_file, lambda: "a name").join()
    assert printed == [TypeError]
    (kept,) = told.last()
    assert re.fullmatch(r"TypeError \[.* check_file < .*\]", kept.words)
