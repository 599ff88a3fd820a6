"""Running sums along time: which positions a window's layers hold, and how it gets to others; on every device."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from ..core import compositor
from ..core.frame_state import Options


def summable(source) -> bool:
    """Whether running sums are made of a source: of opaque 8-bit frames."""
    return np.dtype(source.dtype) == np.uint8 and source.alpha == "opaque"


class RunningSums(ABC):
    """A window of running sums of a source's frames, in the light that is summed (Options.light).

    The layer of position p, p mod `layers`, holds the sum of the frames before p: positions `start` to `stop`, both
    included. Positions beyond the shot's ends count as well, with the frames that its edges show there. A window that
    moves on, or back, adds one layer a frame. A device's sums wrap around, so that differences are exact: what was
    held before leaves no trace.
    """

    def __init__(self, source, capacity: int):
        self.source, self.capacity, self.layers = source, capacity, capacity + 1
        self.start = self.stop = 0
        self.shot = range(source.count)
        self._frames: dict[int, int] = {}  # position: source frame
        self._options: Options | None = None

    @property
    def held(self):
        """The source frames that are summed."""
        return self._frames.values()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """Reads what is missing at positions (of core.compositor.window_positions) within `capacity` of one another.

        shot: the frames that the window may show (core.compositor.source_frames)."""
        self.shot = shot
        first, last = int(positions.min()), int(positions.max()) + 1
        frames = compositor.source_frames(options, np.arange(first, last), shot).tolist()
        if not self._continues(first, frames, options):
            self._options, self._frames = options, {}
            self.start = self.stop = first
        while self.stop < last:
            self._keep(max(self.start, self.stop + 1 - self.capacity), self.stop)
            self._extend(frames[self.stop - first], self.stop, self.stop + 1)
            self.stop += 1
        while self.start > first:
            self._keep(self.start, min(self.stop, self.start - 1 + self.capacity))
            self._extend(frames[self.start - 1 - first], self.start, self.start - 1)
            self.start -= 1

    def _continues(self, first: int, frames: list[int], options: Options) -> bool:
        """Whether what is held touches the wanted frames, and agrees with them."""
        last = first + len(frames)
        overlap = range(max(first, self.start), min(last, self.stop))
        return (
            self._options is not None
            and self._options.light == options.light
            and first <= self.stop
            and self.start <= last
            and all(self._frames[position] == frames[position - first] for position in overlap)
        )

    def _keep(self, start: int, stop: int) -> None:
        self.start, self.stop = start, stop
        self._frames = {position: frame for position, frame in self._frames.items() if start <= position < stop}

    def _extend(self, frame: int, known: int, next_: int) -> None:
        same = next((position for position, held in self._frames.items() if held == frame), None)
        self._add(frame, same, known, next_)
        self._frames[min(known, next_)] = frame

    @abstractmethod
    def _add(self, frame: int, same: int | None, known: int, next_: int) -> None:
        """The sum at position next_ from the one at `known`, its neighbour, and the frame between them, which the
        sums may hold already, at position `same`."""

    def release(self) -> None:
        self._frames, self._options = {}, None
