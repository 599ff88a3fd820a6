"""Work beside the main thread that goes ahead, and is closed early."""

import threading

import pytest

from shutter_addon.core import stopping, threads


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
