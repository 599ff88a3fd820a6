"""A clip as plain facts: what an effect's footage is, and which of its frames the timeline shows. No file is opened."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple, Protocol

import numpy as np

from ..frames import retiming
from ..frames.retiming import StripTiming
from .keyframes import Channel


class Medium(Protocol):
    """What a clip's facts are taken from: footage, or the source of a matte."""

    width: int
    height: int
    count: int
    step: int
    fps: Fraction | None


class Shown(NamedTuple):
    """A timeline frame, the clip's frame that is shown there, and 1, or −1 where the clip runs backward."""

    frame: float
    source_frame: int
    direction: int


@dataclass(frozen=True)
class Clip:
    """width, height: of its pictures, in pixels
    count: of its frames, moments between them too; every step-th was filmed, from the first on
    fps: frames per second, None: they are images
    timing: what tells which of them a timeline frame shows: how its strip lies there, or keys (Effect.time); None:
    timeline frame 1 shows the first one, and each next frame the next filmed one, as recipes have it"""

    width: int
    height: int
    count: int
    step: int = 1
    fps: Fraction | None = None
    timing: StripTiming | Channel | None = None

    @staticmethod
    def of(medium: Medium, timing: StripTiming | Channel | None = None) -> Clip:
        return Clip(medium.width, medium.height, medium.count, medium.step, medium.fps, timing)

    def stepped(self, factor: int) -> Clip:
        """Return the clip with `factor` moments for each filmed frame."""
        fps = None if self.fps is None else self.fps * factor
        return replace(self, count=(self.count - 1) * factor + 1, step=factor, fps=fps)

    def shown(self, frame: float) -> Shown:
        """What is shown at a timeline frame."""
        if isinstance(self.timing, StripTiming):
            return Shown(frame, self._shown_by(self.timing, frame), -1 if self.timing.use_reverse_frames else 1)
        filmed, backward = self.timing.at(frame) if self.timing else (frame, False)
        return Shown(frame, nearest(filmed - 1, self.step, self.count), -1 if backward else 1)

    def position(self, frame: float) -> float:
        """Where in the clip a timeline frame is, in frames; one of those beside that is shown."""
        if isinstance(self.timing, StripTiming):
            length, rate = self._content(self.timing)
            position = float(retiming.position(replace(self.timing, strobe=1.0), rate, length, frame))
            return (self.timing.start + position) * self.step
        return ((self.timing.at(frame)[0] if self.timing else frame) - 1) * self.step

    @property
    def ends(self) -> tuple[float, float]:
        """The first and the last position, where it stays beyond; infinite: it goes on."""
        if isinstance(self.timing, StripTiming):
            first, (length, _rate) = self.timing.start, self._content(self.timing)
            return float(first * self.step), float((first + length - 1) * self.step)
        return -math.inf, math.inf

    def _shown_by(self, strip: StripTiming, frame: float) -> int:
        """What a source strip shows: trims, cuts, playback rate, retiming keys, reversed frames and strobe as Blender's
        sequencer applies them. Where there are frames between filmed ones, it is the nearest of all, which Blender
        knows nothing of."""
        length, rate = self._content(strip)

        def position(time: float) -> np.float32:
            return retiming.position(strip, rate, length, time)

        if self.step > 1:
            return nearest(strip.start + float(position(frame)), self.step, self.count)
        # Blender rounds a position to the nearest frame, but caches the result by the position's whole part. So a slow
        # strip that plays forward shows, for all positions with one whole part, the frame nearest to the first of them.
        whole = int(position(frame))
        earlier = range(1, max(math.floor(frame - strip.left_handle), 0) + 1)
        frame -= bisect_left(earlier, True, key=lambda back: int(position(frame - back)) != whole)
        index = math.floor(position(frame) + np.float32(0.5))
        return strip.start + min(index, length - 1)

    def _content(self, strip: StripTiming) -> tuple[int, float]:
        """How many filmed frames a strip has, and how many pass in a timeline frame before it is retimed."""
        filmed = (self.count - 1) // self.step + 1
        length = max(1, filmed - strip.content_trim_start - strip.content_trim_end)
        return length, retiming.playback_rate(strip, length, float(self.fps or 0) / self.step)


def nearest(filmed: float, step: int, count: int) -> int:
    """The frame that is nearest to a time, which counts filmed frames from 0 on, of a clip that has so many frames,
    every step-th of which was filmed."""
    return min(max(math.floor(filmed * step + 0.5), 0), count - 1)
