"""Work beside the main thread that goes ahead, is closed early, or broken off between its steps."""

import math
import threading

import pytest

from shutter_addon.core import stopping, threads
from shutter_addon.core.caches import LastValue


def test_what_is_found_beside_comes_in_order_and_its_fault_last():
    def steps():
        yield from range(5)
        raise ValueError("the sixth")

    found = []
    with pytest.raises(ValueError, match="the sixth"):
        found.extend(threads.beside(steps(), None))
    assert found == list(range(5))
    assert list(threads.beside([1, 2], None)) == [1, 2]


def test_who_is_not_to_wait_gets_nothing_yet():
    answer = threading.Event()

    def steps():
        assert answer.wait(30)
        yield 1

    found = threads.beside(steps(), 0.01)
    assert next(found) is None
    answer.set()
    assert [step for step in found if step is not None] == [1]


def test_closed_early_it_ends_at_its_next_look():
    looks, threads_of = [], set()

    def steps():
        threads_of.add(threading.current_thread())
        while True:
            stopping.check()
            looks.append(None)
            yield len(looks)

    found = threads.beside(steps(), None)
    assert next(found) == 1
    found.close()
    count = len(looks)
    assert not any(thread.is_alive() for thread in threads_of)
    assert len(looks) == count


def test_a_thread_is_told_what_was_said_on_it():
    with stopping.once(lambda: True), pytest.raises(stopping.StoppedError):
        stopping.check()
    stopping.check()
    with stopping.once(lambda: True):
        thread = threading.Thread(target=stopping.check)
        thread.start()
        thread.join()


def test_a_slice_ends_work_and_knows_what_is_kept():
    assert not stopping.Slices().next("key", 60, 60)()
    memo, over, endless = LastValue(), stopping.Slice(-math.inf, -math.inf), stopping.Slice(math.inf, math.inf)
    with stopping.once(over), pytest.raises(stopping.StoppedError):
        memo.get("key", stopping.check)
    assert not over.has_kept
    with stopping.once(endless):
        stopping.check()
        memo.get("key", lambda: 1)
    assert endless.has_kept
    again = stopping.Slice(math.inf, math.inf)
    with stopping.once(again):
        assert memo.get("key", lambda: 2) == 1
    assert not again.has_kept, "it was there"
    with stopping.once(stopping.Slice(-math.inf, math.inf)):  # it ends once something is kept
        stopping.check()
        memo.get("other", lambda: 1)
        with pytest.raises(stopping.StoppedError):
            stopping.check()
