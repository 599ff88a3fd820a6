import re
import threading

import pytest

from shutter_addon.core import recent_errors, threads
from shutter_addon.core.messages import EffectError, MediaError
from shutter_addon.core.recipes import recipe_file
from shutter_addon.core.recipes.recipe import RecipeError
from shutter_addon.media.files import check_file


@pytest.fixture(autouse=True)
def _nothing_told(monkeypatch):
    monkeypatch.setattr(recent_errors, "_lines", [])  # private: what other tests told
    monkeypatch.setattr(recent_errors, "_start", -1e9)


def missing(folder):
    with pytest.raises(MediaError):
        check_file(folder / "Qanarix.png")


def test_an_error_is_kept_once_as_the_line_that_made_it_and_the_oldest_go(tmp_path, monkeypatch):
    monkeypatch.setattr(recent_errors, "MOST", 2)
    for _ in range(3):
        missing(tmp_path)
    (kept,) = recent_errors.last()
    raised = r'\d+ s: raise MediaError\(f"\{path.name\}: no such file in \{.*\}"\) \[media/files\.py:\d+\]'
    assert re.fullmatch(raised, kept)
    (tmp_path / "Qanarix.json").write_text('{"version": 1, "window": 4, "shutters": [{"name": "A"}]}')
    with pytest.raises(RecipeError):
        recipe_file.load(tmp_path / "Qanarix.json")
    inner, outer = recent_errors.last()
    assert 'raise RecipeError(f"{place}: {message}") [core/recipes/recipe_file.py:' in inner
    assert 'raise RecipeError(f"{path}: {error}") from None [core/recipes/recipe_file.py:' in outer
    missing(tmp_path)
    assert outer in recent_errors.last()
    assert re.fullmatch(raised, recent_errors.last()[-1])


def test_lines_and_errors_of_other_code_are_not_kept():
    recent_errors.record()
    EffectError("Qanarix is gone")
    with pytest.raises(ValueError, match="invalid") as raised:
        int("invalid")
    recent_errors.exception(raised.value)
    assert recent_errors.last() == []


def test_an_error_that_nobody_expected_is_kept_without_what_it_says(monkeypatch):
    """One in a thread that nobody waits for is printed all the same, as Python does."""
    printed = []
    monkeypatch.setattr(threading, "excepthook", lambda raised: printed.append(raised.exc_type))
    with pytest.raises(TypeError) as raised:
        check_file(lambda: "a name")
    recent_errors.exception(raised.value)
    threads.daemon(check_file, lambda: "a name").join()
    assert printed == [TypeError]
    expected, in_thread = recent_errors.last()
    assert re.fullmatch(r"\d+ s: TypeError \[media/files\.py:\d+ check_file\]", expected)
    assert re.fullmatch(r"\d+ s: TypeError \[.* check_file < .*\]", in_thread)
