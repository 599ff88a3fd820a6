"""Clips as plain data: the footage of an effect, and which frame the timeline shows. No file is opened."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from ..frames import retiming
from ..frames.frame_source import FrameSource
from ..frames.retiming import StripTiming
from .keyframes import Channel


class Shown(NamedTuple):
    """A timeline frame, the clip's frame that it shows, and the direction: 1, or −1 where the clip runs backward."""

    frame: float
    source_frame: int
    direction: int


@dataclass(frozen=True)
class Clip:
    """The footage of an effect and its timing.

    Attributes:
        width, height: Of its pictures, in pixels.
        count: Frames, including moments between them; every step-th was filmed, from the first on.
        fps: Frames per second; None for images.
        timing: Which frame a timeline frame shows: the strip's timing, or keys (Effect.time). None: frame 1 shows the
            first filmed frame, and so on, as in recipes.
    """

    width: int
    height: int
    count: int
    step: int = 1
    fps: Fraction | None = None
    timing: StripTiming | Channel | None = None

    @staticmethod
    def of(source: FrameSource, timing: StripTiming | Channel | None = None) -> Clip:
        return Clip(source.width, source.height, source.count, source.step, source.fps, timing)

    def stepped(self, factor: int) -> Clip:
        """Return the clip with `factor` moments per filmed frame."""
        fps = None if self.fps is None else self.fps * factor
        return replace(self, count=(self.count - 1) * factor + 1, step=factor, fps=fps)

    def shown(self, frame: float) -> Shown:
        """Return what a timeline frame shows."""
        if isinstance(self.timing, StripTiming):
            return Shown(frame, self._shown_by(self.timing, frame), -1 if self.timing.use_reverse_frames else 1)
        filmed, backward = self.timing.at(frame) if self.timing else (frame, False)
        return Shown(frame, nearest(filmed - 1, self.step, self.count), -1 if backward else 1)

    def position(self, frame: float) -> float:
        """Return the position of a timeline frame in the clip, in frames, before rounding to a shown frame."""
        if isinstance(self.timing, StripTiming):
            length, rate = self._content(self.timing)
            position = float(retiming.position(replace(self.timing, strobe=1.0), rate, length, frame))
            return (self.timing.start + position) * self.step
        return ((self.timing.at(frame)[0] if self.timing else frame) - 1) * self.step

    @property
    def ends(self) -> tuple[float, float]:
        """The positions (see `position`) of the strip's first and last frame, which the strip repeats beyond its ends.

        Without a strip's timing they are −∞ and ∞: no frame repeats.
        """
        if isinstance(self.timing, StripTiming):
            first, (length, _rate) = self.timing.start, self._content(self.timing)
            return float(first * self.step), float((first + length - 1) * self.step)
        return -math.inf, math.inf

    def _shown_by(self, strip: StripTiming, frame: float) -> int:
        """Return the frame that a strip shows, with trims, cuts, playback rate, retiming and strobe as in Blender.

        With moments between filmed frames, which Blender does not know, it is the nearest moment.
        """
        length, rate = self._content(strip)

        def position(time: float) -> np.float32:
            return retiming.position(strip, rate, length, time)

        if self.step > 1:
            return nearest(strip.start + float(position(frame)), self.step, self.count)
        # Blender rounds a position to the nearest frame, but caches frames by the position's whole part. So a slow
        # strip that plays forward shows one frame for all positions with the same whole part: the first one's.
        whole = int(position(frame))
        earlier = range(1, max(math.floor(frame - strip.left_handle), 0) + 1)
        frame -= bisect_left(earlier, True, key=lambda back: int(position(frame - back)) != whole)
        index = math.floor(position(frame) + np.float32(0.5))
        return strip.start + min(index, length - 1)

    def _content(self, strip: StripTiming) -> tuple[int, float]:
        """Return the strip's number of filmed frames, and how many pass per timeline frame before retiming."""
        filmed = (self.count - 1) // self.step + 1
        length = max(1, filmed - strip.content_trim_start - strip.content_trim_end)
        return length, retiming.playback_rate(strip, length, float(self.fps or 0) / self.step)


def nearest(filmed: float, step: int, count: int) -> int:
    """Return the frame nearest to a time in filmed frames, from 0, in a clip with `step` frames per filmed one."""
    return min(max(math.floor(filmed * step + 0.5), 0), count - 1)
