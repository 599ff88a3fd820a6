"""Small grey pictures of a strip, for tracking."""

from collections.abc import Callable, Sequence

import numpy as np

from ..core import stopping
from ..core.caches import RecentValues
from ..core.frames.frame_source import FrameSource
from . import flow, opencv

WIDTH = 960  # the most pixels along the longer side of the pictures
AHEAD = 8  # frames that the source may decode in advance
BLOCK = 48  # frames that are read at once when tracking goes backward, because movies are decoded forward
KEPT = 256  # pictures that are cached, half a megabyte each


class Footage:
    """Small grey pictures of a strip, for tracking.

    Attributes:
        size: (width, height) of the pictures
    """

    def __init__(self, source: FrameSource, index_at: Callable[[int], int]) -> None:
        """Take pictures of a source; raise MediaError without OpenCV.

        Args:
            source: the footage
            index_at: returns the source frame that is shown at a timeline frame
        """
        opencv.check("tracking needs")
        self._source, self._index_at = source, index_at
        share = min(1.0, WIDTH / max(source.width, source.height))
        self.size = max(1, round(source.width * share)), max(1, round(source.height * share))
        self._kept: RecentValues[int, np.ndarray] = RecentValues()
        self._wanted: Sequence[int] = ()

    def want(self, frames: Sequence[int]) -> None:
        """Announce the next timeline frames, in order."""
        self._wanted = frames

    def picture(self, frame: int) -> np.ndarray:
        """Return the picture (H, W) uint8 at a timeline frame. Tracking can be stopped here (core.stopping)."""
        stopping.check()
        index = self._index_at(frame)
        if index not in self._kept:
            self._read(frame, index)
        return self._kept[index]

    def cut(self, before: int, after: int) -> bool:
        """Return whether there is a cut between two timeline frames."""
        first, second = self._index_at(before), self._index_at(after)
        return self._cut(min(first, second), max(first, second))

    def _cut(self, low: int, high: int) -> bool:
        shots = self._source.shots
        return shots is not None and low != high and high not in shots.around(low, low, high)

    def _read(self, frame: int, index: int) -> None:
        """Read the source frame at a timeline frame. If tracking goes backward, read a block of frames."""
        before, upcoming = index, list[int]()  # the frame shown before it, and the next ones that are not cached
        if frame in self._wanted:
            place = self._wanted.index(frame)
            before = self._index_at(self._wanted[place - 1] if place else frame)
            shown = dict.fromkeys(map(self._index_at, self._wanted[place + 1 : place + BLOCK]))
            upcoming = [i for i in shown if i not in self._kept]
        backward = [i for i in upcoming if i < index]
        block = sorted({index, *backward})
        self._source.want([*block, *(upcoming[:AHEAD] if not backward else ())])
        last = min(before, block[0])
        for i in block:
            stopping.check()
            self._cut(last, i)  # finds cuts now, so that each frame is read once, in ascending order
            picture = flow.luma(self._source.read(i), self._source.transfer, self._source.alpha)
            self._kept.keep(i, flow.resized(picture, self.size), KEPT)
            last = i
