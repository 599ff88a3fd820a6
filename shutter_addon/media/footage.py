"""Small grey pictures of the footage at timeline frames, for tracking."""

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
    """Gives tracking small grey pictures of the footage at timeline frames (`picture`), and finds its cuts (`cut`).

    Attributes:
        size: (width, height) of the pictures in pixels, at most WIDTH on the longer side.
    """

    def __init__(self, source: FrameSource, index_at: Callable[[int], int]) -> None:
        """Prepare to read small grey pictures of a source.

        Args:
            source: The footage.
            index_at: Returns the source frame that is shown at a timeline frame.

        Raises:
            MediaError: OpenCV is missing.
        """
        opencv.check("tracking needs")
        self._source, self._index_at = source, index_at
        share = min(1.0, WIDTH / max(source.width, source.height))
        self.size = max(1, round(source.width * share)), max(1, round(source.height * share))
        self._kept: RecentValues[int, np.ndarray] = RecentValues()
        self._wanted: Sequence[int] = ()

    def want(self, frames: Sequence[int]) -> None:
        """Announce which timeline frames' pictures will be asked for next, in order, so that they can be read early."""
        self._wanted = frames

    def picture(self, frame: int) -> np.ndarray:
        """Return the small grey picture (H, W) uint8 at a timeline frame.

        Raises:
            core.stopping.StoppedError: Tracking was cancelled.
            MediaError: The frame cannot be read.
        """
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
        """Return whether there is a cut between two source frames, `low` and the later `high`."""
        shots = self._source.shots
        return shots is not None and low != high and high not in shots.around(low, low, high)

    def _read(self, frame: int, index: int) -> None:
        """Read the picture of a timeline frame into the cache (`_kept`).

        If tracking goes backward, pictures of up to BLOCK announced frames (`want`) are read at once, in ascending
        order. Movies are decoded forward, so this takes little longer than one frame.

        Args:
            frame: The timeline frame.
            index: The source frame that it shows.
        """
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
