import threading

import pytest

from shutter_addon.core import threads, told
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


def test_a_sentence_is_kept_short():
    told.record("x" * 10_000)
    assert len(texts()[0]) == 300


def test_where_it_was_raised(tmp_path):
    try:
        check_file(tmp_path / "gone.png")
    except MediaError as error:
        told.record(error)
    (kept,) = told.last()
    assert kept.place.startswith("media/files.py:")
    assert not kept.is_plain


def test_an_error_that_nobody_expected_is_kept_without_what_it_says():
    with pytest.raises(TypeError) as raised:
        check_file(lambda: "a name")
    assert told.is_ours(raised.value)
    told.exception(raised.value)
    (kept,) = told.last()
    assert (kept.text, kept.is_plain) == ("TypeError", True)
    assert kept.place.startswith("media/files.py:")
    assert kept.place.endswith(" check_file")


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
    assert (kept.text, kept.is_plain) == ("TypeError", True)
    assert "check_file" in kept.place
