"""Which frames of footage repeat the one before, as in 24 frames a second that play at 30, or where some were dropped,
and which lie around these. It takes OpenCV."""

from __future__ import annotations

import math

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.memo import Kept
from . import flow
from .cuts import may_be_cut
from .errors import MediaError
from .opencv import cv2

MOST = 4  # equal frames in a row; more are a still shot
# Levels of 255 by which a patch changes most: repeats by 0 to 2.8 after H.264 of CRF 18 to 28, with grain as without;
# what moves on either side by at least as much, and TIMES as much as the repeats.
REPEATED, TIMES = 3.0, 3.0

_ROWS, _PATCH = 68, 3  # of the pictures that are compared; across and down, as grain goes in a mean
_PICTURES, _CHANGES = 4, 1024  # that are kept


class Repeats:
    """Which frames of a source repeat the one before.

    What it says of a frame depends on MOST + 1 frames on each side alone. Of the source, which keeps what it has read
    last, it reads the frame before, and more where something seems to repeat."""

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._pictures: Kept[int, np.ndarray] = Kept()
        self._changes: Kept[int, float] = Kept()

    def may_repeat(self, index: int) -> bool:
        """Whether a frame can be a repeat, as far as it and the one before tell."""
        return self._change(index) <= REPEATED

    def gap(self, index: int) -> tuple[int, int]:
        """The two frames between which the moments behind a frame lie: itself and the next one; where frames repeat
        around it, the first of these and the next that is another, of the same shot."""
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
        """By how many levels a frame differs from the one before; infinitely where that is none, or of another shot;
        "not a number" where that cannot be told."""
        if index == 0:
            return math.inf
        try:
            return self._changes.ask(index, lambda: self._found(index), _CHANGES)
        except MediaError:  # who needs these frames is told
            return math.nan

    def _found(self, index: int) -> float:
        if index == self._source.count:
            return math.inf
        before, after = self._picture(index - 1), self._picture(index)
        if may_be_cut(*(np.dstack([picture] * 3) for picture in (before, after))):
            return math.inf
        return float(np.abs(cv2.blur(after - before, (_PATCH, _PATCH))).max())

    def _picture(self, index: int) -> np.ndarray:
        """A frame in grey (h, w) float32, small."""
        return self._pictures.ask(index, lambda: self._made(index), _PICTURES)

    def _made(self, index: int) -> np.ndarray:
        return flow.of_rows(self._source.read(index), self._source, _ROWS).astype(np.float32)
