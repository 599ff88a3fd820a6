"""Ahead gives a source's own frames, in any order of wants, and keeps no more than is wanted."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from shutter_addon.media import Ahead, MediaError, open_source
from shutter_addon.media.ahead import shrunk


class Footage:
    """Random frames that can be held back."""

    alpha, transfer, path = "opaque", "srgb", Path("footage.mp4")

    def __init__(self, count=40, size=(8, 6)):
        self.frames = np.random.default_rng(1).integers(0, 256, (count, size[1], size[0], 4), dtype=np.uint8)
        self.count, (self.width, self.height), self.dtype = count, size, np.dtype(np.uint8)
        self.reads, self.threads, self.closed = [], set(), 0
        self.gate = threading.Event()
        self.gate.set()

    def read(self, index):
        self.gate.wait()
        self.reads.append(index)
        self.threads.add(threading.current_thread())
        if not 0 <= index < self.count:
            raise IndexError(index)
        if index == 13:
            raise MediaError("frame 13 of it cannot be decoded")
        return self.frames[index].copy()

    def close(self):
        self.closed += 1


@pytest.fixture
def source():
    return Footage()


@pytest.fixture
def ahead(source):
    with Ahead(source) as ahead:
        yield ahead
        source.gate.set()


def wait(ahead, indices):
    until = time.monotonic() + 10
    while not ahead.ready(indices):
        assert time.monotonic() < until
        time.sleep(0.001)


def test_frames_are_the_sources_in_any_order(ahead, source):
    rng = np.random.default_rng(2)
    for _ in range(100):
        ahead.want(rng.integers(0, 12, rng.integers(0, 9)))
        index = int(rng.integers(0, 12))
        assert np.array_equal(ahead.read(index), source.frames[index])
    assert source.threads == {ahead._thread}
    assert threading.current_thread() not in source.threads


def test_what_is_wanted_is_decoded_in_that_order_and_once(ahead, source):
    ahead.want([5, 4, 3, 5])
    wait(ahead, [3, 4, 5])
    ahead.want([4, 3, 2])
    wait(ahead, [2, 3, 4])
    assert ahead.read(3) is ahead.read(3)
    assert source.reads == [5, 4, 3, 2]


def test_nothing_is_kept_but_what_is_wanted(ahead, source):
    ahead.want(range(8))
    wait(ahead, range(8))
    ahead.want(range(4, 8))
    assert [index for index in range(40) if ahead.ready([index])] == [4, 5, 6, 7]
    ahead.read(20)
    assert not ahead.ready([20])
    ahead.want([])
    assert not any(ahead.ready([index]) for index in range(40))


def test_what_is_no_longer_wanted_is_not_decoded(ahead, source):
    source.gate.clear()
    ahead.want([1, 2, 3])
    ahead.want([7, 8])
    source.gate.set()
    wait(ahead, [7, 8])
    assert [index for index in source.reads if index not in (1, 2, 3)] == [7, 8]
    assert len(source.reads) <= 3  # one may have been begun
    assert not ahead.ready([1])


def test_a_read_goes_before_what_is_wanted(ahead, source):
    source.gate.clear()
    ahead.want(range(30))
    threading.Timer(0.05, source.gate.set).start()
    assert np.array_equal(ahead.read(33), source.frames[33])
    assert source.reads.index(33) <= 1


def test_errors_come_out_of_read(ahead, source):
    ahead.want([12, 13, 14])
    wait(ahead, [12, 13, 14])
    for _ in range(2):
        with pytest.raises(MediaError, match="frame 13"):
            ahead.read(13)
    with pytest.raises(IndexError):
        ahead.read(99)
    assert np.array_equal(ahead.read(14), source.frames[14])


def test_frames_cannot_be_written_into(ahead):
    with pytest.raises(ValueError, match="read-only"):
        ahead.read(0)[:] = 0


def test_close_ends_the_thread_and_a_later_read_starts_anew(ahead, source):
    ahead.read(1)
    (thread,) = source.threads
    ahead.want(range(40))
    ahead.close()
    assert not thread.is_alive()
    assert source.closed == 1
    assert not ahead.ready([1])
    assert np.array_equal(ahead.read(2), source.frames[2])


def test_closing_ends_a_read_that_waits(ahead, source):
    source.gate.clear()
    threading.Timer(0.05, ahead.close).start()
    threading.Timer(0.1, source.gate.set).start()
    with pytest.raises(MediaError, match=r"footage\.mp4: closed"):
        ahead.read(1)


def test_it_is_a_source_of_the_same_kind(bunny):
    with open_source(bunny) as plain, Ahead(open_source(bunny)) as ahead:
        for name in ("path", "width", "height", "count", "fps", "dtype", "transfer", "alpha"):
            assert getattr(ahead, name) == getattr(plain, name)
        ahead.want(range(30, 34))
        for index in (33, 30, 3):
            assert np.array_equal(ahead.read(index), plain.read(index))


def means(frame, factor, weights):
    """In float64, block by block."""
    height, width = frame.shape[:2]
    return np.array(
        [
            [
                np.average(
                    frame[y : y + factor, x : x + factor].reshape(-1, 4).astype(np.float64),
                    axis=0,
                    weights=weights[y : y + factor, x : x + factor].ravel(),
                )
                for x in range(0, width, factor)
            ]
            for y in range(0, height, factor)
        ]
    )


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
@pytest.mark.parametrize(("size", "factor"), [((8, 6), 2), ((17, 11), 3), ((40, 33), 16), ((3, 2), 4)])
def test_smaller_frames_are_means(dtype, size, factor):
    rng = np.random.default_rng(3)
    most = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    frame = (rng.random((size[1], size[0], 4)) * most).astype(dtype)
    tolerance = 0.5001 if np.dtype(dtype).kind == "u" else 1e-3
    got = shrunk(frame, factor, straight=False)
    assert got.dtype == dtype
    assert got.flags.c_contiguous
    np.testing.assert_allclose(got, means(frame, factor, np.ones(frame.shape[:2])), atol=tolerance, rtol=0)
    got = shrunk(frame, factor, straight=True)
    expected = means(frame, factor, frame[..., 3].astype(np.float64))[..., :3]
    np.testing.assert_allclose(got[..., :3], expected, atol=0.51 if most > 1 else 2e-3, rtol=0)
    np.testing.assert_allclose(
        got[..., 3], means(frame, factor, np.ones(frame.shape[:2]))[..., 3], atol=tolerance, rtol=0
    )


def test_extremes_stay():
    for dtype in (np.uint8, np.uint16):
        frame = np.full((16, 16, 4), np.iinfo(dtype).max, dtype)
        for straight in (True, False):
            assert np.array_equal(shrunk(frame, 16, straight), frame[:1, :1])


def test_a_smaller_source(source):
    with Ahead(source, shrink=4) as small:
        assert (small.width, small.height) == (2, 2)
        assert np.array_equal(small.read(3), shrunk(source.frames[3], 4, False))
