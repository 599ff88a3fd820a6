"""Running sums along time, for every device: which sums a window holds, and which it makes when it moves."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model import windows
from ..core.model.frame_state import Light, Options
from ..core.stopping import kept


def summable(source: FrameSource) -> bool:
    """Whether running sums can be made of a source: its frames are opaque, of 8 bits."""
    return np.dtype(source.dtype) == np.uint8 and source.alpha == "opaque"


class RunningSums(ABC):
    """A window of running sums of a source's frames, in the light that is summed (Options.light).

    Layer p mod `layers` holds the sum at position p, for the positions from `start` to `stop`, both included: the light
    of all frames before p, counted from an arbitrary one. So sums mean something only in differences: that of
    positions p and p + 1 is the frame at p. Positions beyond the shot's ends count, with the frames that Options.edges
    shows there.

    A window that moves by a frame, onwards or back, makes one new layer. Sums are integers that wrap around, so that
    their differences are exact, whatever the window held before.
    """

    def __init__(self, source: FrameSource, capacity: int):
        self.source, self.capacity, self.layers = source, capacity, capacity + 1
        self.start = self.stop = 0
        self.shot = range(source.count)
        self._frames: dict[int, int] = {}  # position: source frame
        self._light: Light | None = None

    @property
    def held(self) -> Collection[int]:
        """The source frames that are summed, a collection of their indices."""
        return self._frames.values()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """Reads the frames at these positions that are not loaded.

        positions: of core.model.windows.positions; the first and the last less than `capacity` apart
        shot: the source frames that the window may show (core.model.windows.source_frames)
        """
        self.shot = shot
        first, last = int(positions.min()), int(positions.max()) + 1
        frames = windows.source_frames(options, np.arange(first, last), shot).tolist()
        if not self._continues(first, frames, options):
            self._light, self._frames = options.light, {}
            self.start = self.stop = first
        while self.stop < last:
            self._keep(max(self.start, self.stop + 1 - self.capacity), self.stop)
            self._extend(options.light, frames[self.stop - first], self.stop, self.stop + 1)
            self.stop += 1
        while self.start > first:
            self._keep(self.start, min(self.stop, self.start - 1 + self.capacity))
            self._extend(options.light, frames[self.start - 1 - first], self.start, self.start - 1)
            self.start -= 1

    def _continues(self, first: int, frames: list[int], options: Options) -> bool:
        """Whether the sums can be moved to the positions from `first` on, which show `frames`: the two meet or overlap,
        and show the same frames where they overlap."""
        last = first + len(frames)
        overlap = range(max(first, self.start), min(last, self.stop))
        return (
            self._light == options.light
            and first <= self.stop
            and self.start <= last
            and all(self._frames[position] == frames[position - first] for position in overlap)
        )

    def _keep(self, start: int, stop: int) -> None:
        """Gives up all positions but those from `start` to `stop`."""
        self.start, self.stop = start, stop
        self._frames = {position: frame for position, frame in self._frames.items() if start <= position < stop}

    def _extend(self, light: Light, frame: int, known: int, next_: int) -> None:
        """As _add; notes the frame."""
        same = next((position for position, held in self._frames.items() if held == frame), None)
        self._add(light, frame, same, known, next_)
        self._frames[min(known, next_)] = frame
        kept()

    @abstractmethod
    def _add(self, light: Light, frame: int, same: int | None, known: int, next_: int) -> None:
        """Makes the sum at position next_, from that at its neighbour `known` and the source frame between the two.

        light: what is summed
        same: a position that shows this frame already, so that it need not be read; None: there is none"""

    def release(self) -> None:
        self._frames, self._light = {}, None
