"""Smooth exposures: a source of frames that adds moments between the footage's frames, made by optical flow.

The flow of a pair of frames is found when its first moment is read, on the thread that decodes ahead (media/prefetch).
Moments are never kept on disk, but flow vectors may be (derived.StoredVectors).

This module also measures how far footage moves from frame to frame. That tells whether an exposure over several frames
streaks or shows copies side by side.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...core.caches import RecentValues
from ...core.frames.frame_source import Decoded, FrameSource, Moment, SourceWrapper, as_rgba
from ...core.messages import MediaError
from ...core.model.motions import Similarity
from ...core.model.shutters import MAX_WINDOW
from ...media import flow, opencv
from ...media.cuts import may_be_cut
from ...media.derived import StoredVectors
from ...media.files import check_index

SMOOTH = 1, 2, 4, 8, 16  # moments from a filmed frame to the next
MOST = 4  # equal frames in a row; more are a still shot
# A frame repeats the one before if no patch changes by more than REPEATED levels of 255: after H.264 of CRF 18 to 28,
# repeats change by 0 to 2.8, with grain or without. The frames on both sides must change by more than that, and by more
# than TIMES as much as the repeats.
REPEATED, TIMES = 3.0, 3.0

_ROWS, _PATCH = 68, 3  # of the pictures that are compared; across and down, as grain goes in a mean
_PICTURES, _CHANGES = 4, 1024  # that are kept

_MEASURED = 270  # rows of the pictures in which motion is measured
# The share of the picture that moves at least so far, of all whose motion is known: what is smaller is not looked at.
_SHARE = 0.01
_THERE_AND_BACK = 0.2, 0.5  # of a vector, and pixels beside that, by which the way back may miss where it started
# Copies that lie so far apart, in heights of the picture, look like a streak: 3 pixels of 1080; at 4, lines show in
# sharp lettering. Edges of footage are some 2 pixels wide, however small it is.
_SMOOTH, _SMOOTH_PIXELS = 3 / 1080, 2.0
_KNOWN = 0.25  # of the picture whose motion has to be known: across a cut, that of little is
_PAIRS = 8  # of neighboring frames, spread over the footage, that "auto" looks at
_FRAMES = MOST + 2  # frames that are kept: those that say what repeats


class Repeats:
    """Finds frames of a source that repeat the one before, as in footage that was converted to a higher frame rate.

    Whether a frame repeats depends only on MOST frames on each side. Frames are read from the source again and again,
    so it must cache those that were read last. Usually only the neighbors are read; where something seems to repeat,
    more.
    """

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._pictures: RecentValues[int, np.ndarray] = RecentValues()
        self._changes: RecentValues[int, float] = RecentValues()

    def gap(self, index: int) -> tuple[int, int]:
        """Return the two frames from which the pictures between a frame and the next one are computed.

        Usually these are the frame and the next one. If the frame is one of several equal ones, they are the first of
        these and the next different frame. But frames are not skipped before a cut or the end, nor if more than MOST
        are equal (a still shot), nor if the frames around them change by less than TIMES as much.

        Args:
            index: The frame of the source.
        """
        first, stop = index, index + 1
        while stop - first <= MOST and self._change(first) <= REPEATED:
            first -= 1
        while stop - first <= MOST and self._change(stop) <= REPEATED:
            stop += 1
        if not 1 < stop - first <= MOST:
            return index, index + 1
        moves = max(REPEATED, TIMES * max(self._change(i) for i in range(first + 1, stop)))
        is_repeated = self._change(first) > moves and moves < self._change(stop) < math.inf
        return (first, stop) if is_repeated else (index, index + 1)

    def _change(self, index: int) -> float:
        """Return by how many levels of 255 a frame differs from the one before, at the place where they differ most.

        Both are compared in grey, much reduced and averaged over small patches.

        Returns:
            Infinity at a cut, at frame 0, and at the index after the last frame. NaN if a frame cannot be read.
        """
        if index in (0, self._source.count):
            return math.inf
        try:
            return self._changes.ask(index, lambda: self._found(index), _CHANGES)
        except MediaError:  # who needs these frames is told
            return math.nan

    def _found(self, index: int) -> float:
        before, after = self._picture(index - 1), self._picture(index)
        if may_be_cut(*(np.dstack([picture] * 3) for picture in (before, after))):
            return math.inf
        return float(np.abs(opencv.cv2.blur(after - before, (_PATCH, _PATCH))).max())

    def _picture(self, index: int) -> np.ndarray:
        """Return a frame in grey, reduced to _ROWS rows, (h, w) float32."""
        source = self._source
        return self._pictures.ask(
            index, lambda: flow.of_rows(source.read(index), source, _ROWS).astype(np.float32), _PICTURES
        )


class SmoothSource(SourceWrapper):
    """A source with the frames of another source, and between them moments: pictures computed by optical flow.

    Frame i of the other source is at index i · step, unless it repeats the one before and is skipped. Where two frames
    have nothing in common, as at a cut, a moment between them is the nearer frame.

    Attributes:
        step: Indices from a frame of the other source to the next; step − 1 moments lie in between.
        repeats: Whether any moment was made across skipped, repeated frames so far.
    """

    def __init__(
        self, source: FrameSource, step: int, vectors: StoredVectors | None = None, *, skip_repeats: bool = False
    ) -> None:
        """Add moments to a source.

        Args:
            source: The source. `close` closes it.
            step: Indices from one of its frames to the next, 1 or more; step − 1 moments lie in between.
            vectors: Finds optical flow, unless it is stored. None: find it whenever it is needed.
            skip_repeats: Whether to replace frames that repeat the one before by moments, evenly spaced in time between
                the frames that differ, so that motion does not stop.

        Raises:
            MediaError: OpenCV is missing.
        """
        self._recent = lru_cache(_FRAMES)(source.read)
        super().__init__(SourceWrapper(source, self._recent))
        opencv.check("moments between frames need")
        self._find = flow.found if vectors is None else vectors.found
        self.step = step
        self.count = (source.count - 1) * step + 1
        self.fps = None if source.fps is None else source.fps * step
        self.options = {**source.options, "inbetween": step}
        self._pairs: RecentValues[tuple[int, int], flow.Between] = RecentValues()
        self._repeats = Repeats(self._source) if skip_repeats else None
        self.repeats = False

    def read(self, index: int) -> np.ndarray:
        """Return a frame or a moment, as RGBA (height, width, 4). It raises what the source's `read` raises."""
        return as_rgba(self.decoded(index))

    def decoded(self, index: int) -> Decoded:
        """Return a frame, or a Moment with the two frames around it. It raises what the source's `read` raises."""
        check_index(self, index)
        filmed, number = divmod(index, self.step)
        first, last = self._repeats.gap(filmed) if self._repeats else (filmed, filmed + 1)
        if last - first > 1 and index > first * self.step:
            made = self._moment((first, last), index - first * self.step)
            if isinstance(made, Moment):
                self.repeats = True
                return made
        return self._moment((filmed, filmed + 1), number) if number else self._source.read(filmed)

    def _moment(self, pair: tuple[int, int], number: int) -> Decoded:
        """Return a moment between two frames; the nearer frame if they are equal or have nothing in common.

        Args:
            pair: The two frames of the source, neighbors unless repeated frames between them are skipped.
            number: Index of the moment, counted from that of the first of the two frames.
        """
        steps = (pair[1] - pair[0]) * self.step

        def between() -> flow.Between:
            first, second = map(self._source.read, pair)
            return flow.Between(first, second, self.transfer, self.alpha, self._find)

        return self._pairs.ask(pair, between, 2).moment(pair, number, steps)

    def close(self) -> None:
        """Close the source and forget all frames."""
        self._pairs.clear()
        self._recent.cache_clear()
        self._source.close()


def steps_for(source: FrameSource, smooth: int | str, window: int, *, skip_repeats: bool = False) -> int:
    """Return how many steps lead from a frame of footage to the next, for an effect's option *Smooth*.

    With n steps, n − 1 moments lie in between.

    Args:
        source: The footage.
        smooth: The option: the number of steps, or "auto": as many as the fastest motion in a few pairs of frames
            needs.
        window: Frames in the window of the effect's shutters. It limits the result: window · steps does not exceed
            shutters.MAX_WINDOW (unless `window` alone does).
        skip_repeats: Whether repeated frames are replaced by moments, as in SmoothSource.

    Returns:
        A number of SMOOTH; 1: no moments. It is less than `smooth` or than needed if the window or SMOOTH allows no
        more. For "auto", it is 1 if the motion is not found, as without OpenCV.
    """
    most = max(count for count in SMOOTH if count * window <= max(MAX_WINDOW, window))
    if smooth != "auto":
        return min(int(smooth), most)
    if opencv.cv2 is None or source.count < 2:
        return 1
    needed = _fastest(source, skip_repeats) / smooth_step(source.height)
    return next((count for count in SMOOTH if needed <= count <= most), most)


def _fastest(source: FrameSource, skip_repeats: bool) -> float:
    """Return the fastest motion in a few pairs of neighboring frames, in pixels per frame."""
    filmed = SourceWrapper(source, lru_cache(_FRAMES)(source.read))
    repeats = Repeats(filmed) if skip_repeats else None
    pairs = sorted({(source.count - 2) * k // (_PAIRS - 1) for k in range(_PAIRS)})
    found = []
    for pair in pairs:
        try:
            first, last = repeats.gap(pair) if repeats else (pair, pair + 1)
            ways = moved(filmed, first, last)
        except MediaError:  # who needs these frames is told
            continue
        if ways is not None:
            found.append(step(ways, Similarity(), Similarity()) * source.height / (last - first))
    return max(found, default=0.0)


class Moved(NamedTuple):
    """How a picture moves between two frames: the points whose motion optical flow is sure of. `step` measures it.

    Attributes:
        before: The points in the first frame, (n,) complex: x + iy in heights of the picture, y down.
        after: The same points in the second frame.
    """

    before: np.ndarray
    after: np.ndarray


def moved(source: FrameSource, index: int, other: int | None = None) -> Moved | None:
    """Find how points of the picture move from one frame to another. Needs OpenCV.

    Args:
        source: The source of both frames.
        index: The first frame.
        other: The other frame. None: the one after `index`.

    Returns:
        Where points are in both frames. None: too little of the motion is certain, as across a cut, or the picture is
        too small.

    Raises:
        MediaError: A frame cannot be read.
    """
    first, second = (flow.of_rows(source.read(i), source, _MEASURED) for i in (index, other or index + 1))
    if min(first.shape) < flow.SMALLEST:
        return None
    forth, back = flow.vectors(first, second), flow.vectors(second, first)
    rows, columns = np.mgrid[: first.shape[0], : first.shape[1]]
    places = columns + 1j * rows
    forth, back = (vectors[..., 0] + 1j * vectors[..., 1] for vectors in (forth, back))
    ends = places + forth
    x, y = np.rint(ends.real).astype(int), np.rint(ends.imag).astype(int)
    inside = (x >= 0) & (x < first.shape[1]) & (y >= 0) & (y < first.shape[0])
    returned = np.abs(forth + back[np.where(inside, y, 0), np.where(inside, x, 0)])
    known = inside & (returned <= _THERE_AND_BACK[0] * np.abs(forth) + _THERE_AND_BACK[1])
    if known.mean() < _KNOWN:
        return None
    known[:, ::2] = known[::2] = False  # a quarter of them is enough
    return Moved(*(points[known].astype(np.complex64) / first.shape[0] for points in (places, ends)))


def step(moved: Moved, before: Similarity, after: Similarity) -> float:
    """Return how far the fastest part of a picture moves between two frames, relative to what the exposure follows.

    With an exposure that follows a subject, for example, the subject's own points count as still. The result is the
    distance, in heights of the picture, that the fastest _SHARE of the points exceed.

    Args:
        moved: Where points are in the first and in the other frame.
        before: Motion of what is followed from the shown picture to the first frame, in heights of the picture.
        after: Motion of what is followed from the shown picture to the other frame. For nothing followed, both are
            Similarity().
    """
    ways = after.inverse()(moved.after) - before.inverse()(moved.before)
    return float(np.quantile(np.abs(ways), 1 - _SHARE))


def smooth_step(height: int) -> float:
    """Return the most pixels of motion per frame at which a streak looks smooth, in a picture of this height."""
    return max(_SMOOTH * height, _SMOOTH_PIXELS)
