"""PrefetchSource gives a source's own frames, in any order of wants, and keeps no more than is wanted."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from shutter_addon.core import stopping
from shutter_addon.media import MediaError, PrefetchSource


class Footage:
    """Random frames that can be held back."""

    alpha, transfer, path = "opaque", "srgb", Path("footage.mp4")

    def __init__(self, count=40, size=(8, 6)):
        self.frames = np.random.default_rng(1).integers(0, 256, (count, size[1], size[0], 4), dtype=np.uint8)
        self.count, (self.width, self.height), self.dtype = count, size, np.dtype(np.uint8)
        self.reads, self.threads, self.closed, self.broken = [], set(), 0, {13}
        self.gate = threading.Event()
        self.gate.set()

    def read(self, index):
        self.gate.wait()
        self.reads.append(index)
        self.threads.add(threading.current_thread())
        if not 0 <= index < self.count:
            raise IndexError(index)
        if index in self.broken:
            raise MediaError("frame 13 of it cannot be decoded")
        return self.frames[index].copy()

    def close(self):
        self.closed += 1


@pytest.fixture
def source():
    return Footage()


@pytest.fixture
def ahead(source):
    with PrefetchSource(source) as ahead:
        yield ahead
        source.gate.set()


def wait(source, indices):
    """Until these frames are decoded, but perhaps for the last one, which has been begun."""
    until = time.monotonic() + 10
    while not {*source.reads} >= {*indices}:
        assert time.monotonic() < until
        time.sleep(0.001)


def kept(ahead, source, index):
    """Whether a frame is read without being decoded for that."""
    before = source.reads.count(index)
    ahead.read(index)
    return source.reads.count(index) == before


def test_frames_are_the_sources_in_any_order(ahead, source):
    rng = np.random.default_rng(2)
    for _ in range(100):
        ahead.want(rng.integers(0, 12, rng.integers(0, 9)))
        index = int(rng.integers(0, 12))
        assert np.array_equal(ahead.read(index), source.frames[index])
    assert len(source.threads) == 1
    assert threading.current_thread() not in source.threads


def test_what_is_wanted_is_decoded_in_that_order_and_once(ahead, source):
    ahead.want([5, 4, 3, 5])
    wait(source, [3, 4, 5])
    ahead.want([4, 3, 2])
    wait(source, [2, 3, 4])
    assert ahead.read(3) is ahead.read(3)
    assert source.reads == [5, 4, 3, 2]


def test_nothing_is_kept_but_what_is_wanted(ahead, source):
    ahead.want(range(8))
    wait(source, range(8))
    ahead.want(range(4, 8))
    assert [index for index in range(12) if kept(ahead, source, index)] == [4, 5, 6, 7]
    assert not kept(ahead, source, 11), "which was read"
    ahead.want([])
    assert not any(kept(ahead, source, index) for index in range(12))


def test_what_is_no_longer_wanted_is_not_decoded(ahead, source):
    source.gate.clear()
    ahead.want([1, 2, 3])
    ahead.want([7, 8])
    source.gate.set()
    wait(source, [7, 8])
    assert [index for index in source.reads if index not in (1, 2, 3)] == [7, 8]
    assert len(source.reads) <= 3  # one may have been begun
    assert not kept(ahead, source, 1)


def test_a_read_goes_before_what_is_wanted(ahead, source):
    source.gate.clear()
    ahead.want(range(30))
    threading.Timer(0.05, source.gate.set).start()
    assert np.array_equal(ahead.read(33), source.frames[33])
    assert source.reads.index(33) <= 1


def test_errors_come_out_of_read(ahead, source):
    ahead.want([12, 13, 14])
    wait(source, [12, 13, 14])
    for _ in range(2):
        with pytest.raises(MediaError, match="frame 13"):
            ahead.read(13)
    with pytest.raises(IndexError):
        ahead.read(99)
    assert np.array_equal(ahead.read(14), source.frames[14])
    source.broken = set()
    assert np.array_equal(ahead.read(13), source.frames[13])  # though it is still wanted
    with pytest.raises(ValueError, match="read-only"):
        ahead.read(13)[:] = 0


def test_an_error_of_a_frame_that_two_threads_read(ahead, source):
    source.gate.clear()
    outcomes, both = [], threading.Barrier(3, timeout=10)
    waiting = [threading.Event() for _ in range(2)]

    def read(waits):
        looks = iter((None, waits.set))  # before it waits, and while it does
        with (
            stopping.once(lambda: bool((look := next(looks, None)) and look())),
            pytest.raises(MediaError, match="frame 13") as caught,
        ):
            ahead.read(13)
        outcomes.append(str(caught.value))
        both.wait()

    for waits in waiting:
        threading.Thread(target=read, args=(waits,), daemon=True).start()
    assert all(waits.wait(10) for waits in waiting)
    source.gate.set()
    both.wait()
    assert len(outcomes) == source.reads.count(13) == 2


def test_close_ends_the_thread_and_a_later_read_starts_anew(ahead, source):
    ahead.read(1)
    (thread,) = source.threads
    ahead.want(range(40))
    ahead.close()
    assert not thread.is_alive()
    assert source.closed == 1
    assert not kept(ahead, source, 1)
    assert np.array_equal(ahead.read(2), source.frames[2])


def test_closing_ends_a_read_that_waits(ahead, source):
    source.gate.clear()
    threading.Timer(0.05, ahead.close).start()
    threading.Timer(0.1, source.gate.set).start()
    with pytest.raises(MediaError, match=r"footage\.mp4: closed"):
        ahead.read(1)


def test_a_read_that_may_not_wait(ahead, source):
    """It ends at once where the frame is not decoded yet; the thread decodes it next, and it is kept until then."""
    source.gate.clear()
    ahead.want([3, 4])
    now = time.monotonic()
    for _ in range(2):
        with stopping.once(stopping.Slice(now + 60, now + 60, waits=False)), pytest.raises(stopping.StoppedError):
            ahead.read(9)
    source.gate.set()
    wait(source, [9])
    ahead.want([3, 4, 5])  # it does not say so again, and keeps it all the same
    wait(source, [3, 4, 5])
    with stopping.once(stopping.Slice(now + 60, now + 60, waits=False)):
        assert np.array_equal(ahead.read(9), source.frames[9])
    assert source.reads.count(9) == 1


def test_a_frame_is_not_made_on_once_it_is_not_wanted(monkeypatch):
    """Of frames that take steps, as moments do: the thread goes on with what is wanted now."""
    source, begun, ended = Footage(), threading.Event(), []

    def read(index):
        begun.set()
        while index == 1 and not ended:
            try:
                stopping.check()
            except stopping.StoppedError:
                ended.append(index)
                raise
        return source.frames[index]

    monkeypatch.setattr(source, "read", read)
    with PrefetchSource(source) as ahead:
        ahead.want([1, 2])
        assert begun.wait(10)
        ahead.want([2])
        assert np.array_equal(ahead.read(2), source.frames[2])
        assert ended == [1]
        assert np.array_equal(ahead.read(1), source.frames[1])
