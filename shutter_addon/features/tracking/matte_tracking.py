"""Track what a matte covers, by dense optical flow inside it, from frame to frame. No bpy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from functools import lru_cache
from typing import Any

import numpy as np

from ...core.frames.frame_source import SourceFile
from ...core.model import outlines
from ...core.model.effect import Subject
from ...core.model.motions import Motion, Similarity
from ...core.pixels.matte_grid import box_around
from ...media import flow
from ...media.footage import Footage
from ...media.opencv import cv2
from . import registration, tracking
from .tracking import COVERED, LEFT, FoundMotion, Tracked, TrackingError

EMPTY = "the outline encloses nothing here"

# Returns a matte (h, w) float32 at a timeline frame, for pictures of a (width, height).
Cover = Callable[[int, tuple[int, int]], np.ndarray]

_INSIDE = 0.9  # a matte's least value inside: its soft edge may move with the background
_AROUND = 24  # pixels around a matte in which flow is found
_POINTS = 4000  # the most points of a motion, and the fewest
_FEWEST = 24
_BACK = 1.0  # pixels of 640 by which flow forth and back may differ
_ALIKE = 2.0  # pixels of 640 within which a point moves with the subject
_DRIFT = 12.0  # pixels of 640 by which steps may drift; farther off, something else looks alike
_SURELY = 0.5  # confidence from which on the first frame tells of a drift
_AGREEING = 0.5  # share of such points from which on a step is sure


def cover_within(drawn: Callable[[int], Sequence]) -> Cover:
    """Return a function that gives MatteTrack the matte of a drawn outline: the inside of closed curves.

    Args:
        drawn: Returns the curves at a timeline frame.
    """
    return lambda frame, size: outlines.coverage(drawn(frame), *size)


def follow_carried(
    region: Subject, file: SourceFile, shown: Mapping[float, int], *what: Any, **how: Any
) -> Iterator[Tracked]:
    """Track a region whose mattes are computed: an outline tracked between drawings, or a subject.

    Yield what MatteTrack.follow yields.

    Args:
        region: Gives its center, and its location, rotation and scale where tracking starts.
        file: Opens a source of its mattes, one for each frame of the footage.
        shown: The number of the frame of the footage by timeline frame.
        what: Positional arguments of MatteTrack.follow.
        how: Its keyword arguments.

    Raises:
        MediaError: A matte cannot be made.
    """
    with closing(file.open()) as mattes:

        def cover(frame: int, size: tuple[int, int]) -> np.ndarray:
            return flow.resized(mattes.read(min(shown[frame], mattes.count - 1)), size)

        yield from MatteTrack(region, cover).follow(*what, **how)


class MatteTrack(tracking.Track):
    """Tracks what a region's matte covers, from frame to frame (Track.follow)."""

    def __init__(self, region: Subject, cover: Cover) -> None:
        """Prepare to track a region.

        Args:
            region: Gives its center, and its location, rotation and scale where tracking starts.
            cover: Gives its matte at a timeline frame.
        """
        super().__init__(region)
        self._covers = lru_cache(3)(cover)  # each step needs two mattes, one of which the last step had, and the first

    def _cover(self, frame: int) -> np.ndarray:
        return self._covers(frame, self._footage.size)

    def _tracker(self, start: int) -> tuple[_MatteTracker, float]:
        if not (self._cover(start) > _INSIDE).any():
            raise TrackingError(EMPTY)
        return _MatteTracker(self._cover, self._footage, start, self._motion), 1.0


class _MatteTracker:
    """The motion of what a matte covers, from the frame where tracking starts to one frame after another."""

    def __init__(self, cover: Callable[[int], np.ndarray], footage: Footage, frame: int, motion: Motion) -> None:
        self._cover, self._footage, self._asked = cover, footage, motion
        # If the subject also turns, its points move differently: the location of its middle counts.
        self._way: Motion = "scale" if motion == "location" else motion
        self._start, self._last, self._motion, self.reason = frame, frame, Similarity(), COVERED

    def next(self, frame: int) -> FoundMotion | None:
        """Return the subject's motion from the frame where tracking starts to this one; None: it is not found."""
        before, after = (self._cover(each) for each in (self._last, frame))
        if not (after > _INSIDE).any():
            self.reason = LEFT
            return None
        first, second = (self._footage.picture(each) for each in (self._last, frame))
        step = moved(first, second, before, after, self._way)
        if step is None:
            self.reason = COVERED
            return None
        self._motion, self._last = self._refined(step.motion.after(self._motion), second, after), frame
        return FoundMotion(self._at_middle() if self._asked == "location" else self._motion, step.confidence)

    def _at_middle(self) -> Similarity:
        """Return the motion so far as a mere shift: how the middle of what the first matte covers has moved."""
        rows, columns = np.nonzero(self._cover(self._start) > _INSIDE)
        middle = complex(columns.mean(), rows.mean())
        return Similarity(1 + 0j, self._motion(middle) - middle)

    def _refined(self, motion: Similarity, second: np.ndarray, after: np.ndarray) -> Similarity:
        """Correct a motion by comparison with the frame where tracking starts, so that errors of steps do not add up.

        If the comparison is unsure, or the correction larger than a drift can be, return the motion unchanged.

        Args:
            motion: From that frame to `second`, added up from steps.
            second: The current picture, (H, W) uint8.
            after: The matte of that picture, (H, W) float32.
        """
        there = registration.matrix(motion)
        size = second.shape[1], second.shape[0]
        first = cv2.warpAffine(self._footage.picture(self._start), there, size)
        before = cv2.warpAffine(self._cover(self._start), there, size)
        rest = moved(first, second, before, after, self._way)
        middle = complex(size[0] / 2, size[1] / 2)
        is_small = rest is not None and abs(rest.motion(middle) - middle) < _DRIFT * max(size) / 640
        if rest is None or not is_small or rest.confidence < _SURELY:
            return motion
        return rest.motion.after(motion)


def moved(
    first: np.ndarray, second: np.ndarray, before: np.ndarray, after: np.ndarray, motion: Motion
) -> FoundMotion | None:
    """Find the motion of what a matte covers from one picture to another.

    Args:
        first: Grey picture, (H, W) uint8.
        second: Grey picture, (H, W) uint8.
        before: The matte of `first`, (H, W) float32, 0 to 1.
        after: The matte of `second`, (H, W) float32, 0 to 1.
        motion: What may change, one of registration.MOTIONS.

    Returns:
        None if nothing or too small a part of the picture is covered, or if too few points agree on a motion.
    """
    unit, box = max(first.shape) / 640, box_around(np.maximum(before, after), _AROUND)
    if box is None:
        return None
    rows, columns = box
    first, second, before, after = (
        np.ascontiguousarray(each[rows, columns]) for each in (first, second, before, after)
    )
    if min(first.shape) < flow.SMALLEST:
        return None
    grid = flow.grid(*first.shape)
    there = grid + flow.fine_vectors(first, second)
    here = there + flow.look(flow.fine_vectors(second, first), there)
    inside = before > _INSIDE
    held = inside & (flow.look(after, there) > 0.5) & (np.hypot(*np.moveaxis(here - grid, -1, 0)) < _BACK * unit)
    chosen = np.flatnonzero(held)
    if chosen.size < _FEWEST:
        return None
    share = chosen.size / np.count_nonzero(inside)
    chosen = chosen[:: -(-chosen.size // _POINTS)]
    corner = complex(columns.start, rows.start)
    starts, ends = (registration.plane(each)[chosen] + corner for each in (grid, there))
    fitted = registration.fit(starts, ends, np.ones(len(chosen)), motion, _ALIKE * unit)
    if fitted is None:
        return None
    found, agreeing = fitted
    return FoundMotion(found, min(float(agreeing.mean()) / _AGREEING, 1.0) * min(share / _AGREEING, 1.0))
