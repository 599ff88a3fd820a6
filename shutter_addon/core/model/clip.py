"""The footage of an effect as plain data: its size and length, and which of its frames the timeline shows.

No file is opened here.
"""

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


class ShownFrame(NamedTuple):
    """Which frame of the footage is shown at a timeline frame.

    Attributes:
        frame: The timeline frame, possibly between two whole ones.
        source_frame: The number of the footage's frame, from 0. With Smooth, the numbers include the moments between
            filmed frames.
        direction: 1, or −1 where the footage plays backward.
    """

    frame: float
    source_frame: int
    direction: int


@dataclass(frozen=True)
class Clip:
    """The size, length and timing of an effect's footage.

    Attributes:
        width, height: The size of its pictures in pixels.
        count: The number of frames, including moments: frames that are computed between filmed ones (Smooth).
        step: Frames 0, step, 2 · step … were filmed; the others are moments. 1: all were filmed.
        fps: Frames per second, including moments; None for images.
        timing: Which frame a timeline frame shows: the timing of a strip, or a channel of source time (Effect.time).
            None: timeline frame 1 shows the first filmed frame, frame 2 the second, and so on, as in recipes.
    """

    width: int
    height: int
    count: int
    step: int = 1
    fps: Fraction | None = None
    timing: StripTiming | Channel | None = None

    @staticmethod
    def of(source: FrameSource, timing: StripTiming | Channel | None = None) -> Clip:
        """Return the clip of an opened source, with a timing."""
        return Clip(source.width, source.height, source.count, source.step, source.fps, timing)

    def stepped(self, factor: int) -> Clip:
        """Return this clip, which has no moments, with `factor` − 1 moments between each two filmed frames."""
        fps = None if self.fps is None else self.fps * factor
        return replace(self, count=(self.count - 1) * factor + 1, step=factor, fps=fps)

    def shown(self, frame: float) -> ShownFrame:
        """Return which frame of the footage a timeline frame shows, and in which direction the footage plays there."""
        if isinstance(self.timing, StripTiming):
            return ShownFrame(frame, self._shown_by(self.timing, frame), -1 if self.timing.use_reverse_frames else 1)
        filmed, backward = self.timing.at(frame) if self.timing else (frame, False)
        return ShownFrame(frame, nearest(filmed - 1, self.step, self.count), -1 if backward else 1)

    def position(self, frame: float) -> float:
        """Return the place in the footage that a timeline frame shows, as a frame number with a fraction.

        It is used to measure how much of the footage plays during a timeline frame, for exposures that last that long.
        So it ignores the strobe of a strip, which repeats frames.

        Args:
            frame: The timeline frame, possibly with a fraction.

        Returns:
            The frame number from 0, counting moments. With a strip it stays within `ends`; otherwise it can be outside
            the footage.
        """
        if isinstance(self.timing, StripTiming):
            length, rate = self._content(self.timing)
            position = float(retiming.position(replace(self.timing, strobe=1.0), rate, length, frame))
            return (self.timing.start + position) * self.step
        return ((self.timing.at(frame)[0] if self.timing else frame) - 1) * self.step

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest value of `position`: the first and last frame of the content of a strip.

        Before and after its content, a strip repeats these frames. If `timing` is no StripTiming, the values are −∞ and
        ∞.
        """
        if isinstance(self.timing, StripTiming):
            first, (length, _rate) = self.timing.start, self._content(self.timing)
            return float(first * self.step), float((first + length - 1) * self.step)
        return -math.inf, math.inf

    def _shown_by(self, strip: StripTiming, frame: float) -> int:
        """Return the number, from 0, of the source frame that Blender shows for a strip at a timeline frame.

        Trims, cuts, playback rate, retiming, reversal and strobe count as in Blender. Before and after its content, a
        strip shows the content's first and last frame. If the clip has moments (`step` above 1), which Blender does not
        know, the result is the frame nearest to the strip's position, which can be a moment.
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
        """Return the length and the speed of a strip's content, which begins at StripTiming.start in this footage.

        Returns:
            The number of filmed frames in the footage, less those trimmed away, at least 1 (StripTiming.first is not
            subtracted, so the content can end after the footage); and how many frames of the content pass per timeline
            frame before retiming (retiming.playback_rate).
        """
        filmed = (self.count - 1) // self.step + 1
        length = max(1, filmed - strip.content_trim_start - strip.content_trim_end)
        return length, retiming.playback_rate(strip, length, float(self.fps or 0) / self.step)


def nearest(filmed: float, step: int, count: int) -> int:
    """Return the number, counting moments, of the frame that is nearest to a time in the footage.

    Args:
        filmed: The time in filmed frames from 0, with a fraction: 1.5 lies halfway between the second and the third.
        step: Clip.step.
        count: Clip.count. The result is clamped to 0 … count − 1.
    """
    return min(max(math.floor(filmed * step + 0.5), 0), count - 1)
