"""What a strip shows, for tracking: grey pictures of a size that is enough for it."""

from collections.abc import Callable, Sequence

import numpy as np

from ..core import stopping
from ..core.frames.frame_source import FrameSource
from ..core.memo import Kept
from . import flow, opencv

WIDTH = 960  # pixels of the pictures that are compared, at most, along their longer side
AHEAD = 8  # frames that the source may decode in advance
BLOCK = 48  # frames that are read at once where tracking goes backward: movies are decoded upwards alone
KEPT = 256  # grey pictures that are kept, of half a megabyte each


class Footage:
    """What a strip shows, for tracking: grey pictures of a size that is enough for it.

    size: width and height of the pictures; index_at: the source's frame that is shown at a timeline frame"""

    def __init__(self, source: FrameSource, index_at: Callable[[int], int]) -> None:
        """MediaError: OpenCV is missing."""
        opencv.check("tracking needs")
        self._source, self._index_at = source, index_at
        share = min(1.0, WIDTH / max(source.width, source.height))
        self.size = max(1, round(source.width * share)), max(1, round(source.height * share))
        self._kept: Kept[int, np.ndarray] = Kept()
        self._wanted: Sequence[int] = ()

    def want(self, frames: Sequence[int]) -> None:
        """Says which timeline frames will be asked for, in this order."""
        self._wanted = frames

    def picture(self, frame: int) -> np.ndarray:
        """The picture (H, W) uint8 at a timeline frame. MediaError: it cannot be read. Tracking may end here
        (core.stopping)."""
        stopping.check()
        index = self._index_at(frame)
        if index not in self._kept:
            self._read(frame, index)
        return self._kept[index]

    def cut(self, before: int, after: int) -> bool:
        """Whether there is a cut between what two timeline frames show."""
        first, second = self._index_at(before), self._index_at(after)
        return self._cut(min(first, second), max(first, second))

    def _cut(self, low: int, high: int) -> bool:
        shots = self._source.shots
        return shots is not None and low != high and high not in shots.around(low, low, high)

    def _read(self, frame: int, index: int) -> None:
        """Reads the source's frame that a timeline frame shows, and those that come next if they lie before it."""
        before, upcoming = index, list[int]()  # the one that is shown before it, and those that are lacking behind it
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
            self._cut(last, i)  # so that frames are read upwards, and once, to find cuts
            picture = flow.luma(self._source.read(i), self._source.transfer, self._source.alpha)
            self._kept.keep(i, flow.resized(picture, self.size), KEPT)
            last = i
