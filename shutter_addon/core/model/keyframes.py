"""Channels, which are values over time: constant, keyed with eases, sampled or computed. And a shutter's bars."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..messages import UserError
from . import shutters

Ease = Literal["linear", "bezier", "constant"]
EASES: tuple[Ease, ...] = ("linear", "bezier", "constant")


def eased(u: float, ease: Ease) -> float:
    """Return how far a value has changed from one key to the next, 0 to 1.

    Args:
        u: How much of the time between the two keys has passed, 0 to 1.
        ease: "linear"; "constant", which jumps at the end; or "bezier", whose flat handles are a third of the span
            long, which is u²(3 − 2u).
    """
    if ease == "constant":
        return 0.0 if u < 1 else 1.0
    return u * u * (3 - 2 * u) if ease == "bezier" else u


def span(frames: Sequence[float], frame: float) -> tuple[int, int, float]:
    """Return the indices of the keys before and after a frame, and the share 0 to 1 of the way between them.

    Outside the keys and on a key, both indices are the nearest key's.

    Args:
        frames: The keys' frames, ascending.
        frame: The frame.
    """
    after = bisect_right(frames, frame)
    if after == 0:
        return 0, 0, 0.0
    before = after - 1
    if after == len(frames) or frames[before] == frame:
        return before, before, 0.0
    return before, after, (frame - frames[before]) / (frames[after] - frames[before])


def between_bars(first: ArrayLike, second: ArrayLike, u: float, interpolation: str = "displacement") -> np.ndarray:
    """Return bars (L,) between those of two keys.

    Args:
        first: The bars (L,) of the first key.
        second: The bars (L,) of the second key.
        u: The share of the way from the first to the second, 0 to 1.
        interpolation: "displacement" moves the bars' light through the frames, "value" fades each bar by itself.
    """
    before, after = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    if u <= 0:
        return before
    if u >= 1:
        return after
    if interpolation == "value":
        return (1 - u) * before + u * after
    return shutters.displace(np.stack([before, after]), [1 - u, u])


class Channel(Protocol):
    """A value over time."""

    def at(self, frame: float) -> Any:
        """Return the value at a frame.

        Raises:
            UserError: The stored value is invalid.
        """


@dataclass(frozen=True)
class Constant:
    """A channel with the same value at every frame. If the value is a UserError, `at` raises it."""

    value: Any

    def at(self, _frame: float) -> Any:
        return _given(self.value)


@dataclass(frozen=True)
class Keys:
    """A channel of numbers or arrays at keys, interpolated in between.

    Attributes:
        frames: The keys' frames, ascending.
        values: The value at each key.
        eases: The ease from each key to the next.
    """

    frames: tuple[float, ...]
    values: tuple
    eases: tuple[Ease, ...]

    def at(self, frame: float) -> np.ndarray:
        before, after, share = eased_span(self.frames, self.eases, frame)
        first, second = np.asarray(self.values[before]), np.asarray(self.values[after])
        return first + share * (second - first)  # exact for equal values


@dataclass(frozen=True)
class Samples:
    """A channel of values that were read at some frames in advance, such as those of an F-curve of Blender.

    Attributes:
        values: The value at each of these frames. If it is a UserError, `at` raises it.
        keys: Frames and eases of the curve's keys, ascending; empty if it had none.
    """

    values: dict[float, Any]
    keys: tuple[tuple[float, Ease], ...] = ()

    def at(self, frame: float) -> Any:
        """Return the value at a sampled frame.

        Raises:
            KeyError: The frame was not sampled.
            UserError: The value is invalid.
        """
        return _given(self.values[frame])


@dataclass(frozen=True)
class Computed:
    """A channel whose value at a frame is what the function `at` returns."""

    at: Callable[[float], Any]


@dataclass(frozen=True)
class SourceTime:
    """The channel of Effect.time: (source frame, whether the footage runs backward), from the keys of the source frame.

    While the source frame stands still, the direction is that of the last movement towards one of its keys. Without
    any, it is forward.

    Attributes:
        numbers: Channel of the source frame; the first one is 1.
        keys: Frames and eases of its keys, ascending.
    """

    numbers: Channel
    keys: tuple[tuple[float, Ease], ...]

    def at(self, frame: float) -> tuple[float, bool]:
        time, later = float(self.numbers.at(frame)), float(self.numbers.at(frame + 0.5))
        return time, self._came_backward(frame) if later == time else later < time

    def _came_backward(self, frame: float) -> bool:
        for key, _ in reversed(self.keys):
            if key <= frame:
                earlier, later = self.numbers.at(key - 0.5), self.numbers.at(key - 0.25)
                if earlier != later:
                    return bool(later < earlier)
        return False


@dataclass(frozen=True)
class Bars:
    """A shutter's bars (L,) float64 over time.

    Attributes:
        channel: Channel of the bars. It counts at keys, before the first and after the last, and where bars fade.
        keys: Frames and eases of the keys, ascending; without keys, only `channel` counts.
        share: Channel of the share 0 to 1 of the way between the keys around a frame. None: the eases determine it.
    """

    channel: Channel
    keys: tuple[tuple[float, Ease], ...] = ()
    share: Channel | None = None

    def at(
        self, frame: float, interpolation: str, spread: Callable[[np.ndarray], np.ndarray] = np.asarray
    ) -> np.ndarray:
        """Return the bars at a frame.

        Between keys they are interpolated by displacement (paper §3.4.1, over time). If one of the keys around the
        frame has a closed shutter, which cannot be displaced, they fade as with "value".

        Args:
            frame: The frame.
            interpolation: Options.interpolation; with "value" bars fade by themselves between keys.
            spread: Turns bars of filmed frames into bars of moments (Shutter.spread), so that displacement passes
                through these.
        """
        if not self.keys:
            return spread(self.channel.at(frame))
        frames = [key for key, _ in self.keys]
        before, after, _ = span(frames, frame)
        if before == after:
            return spread(self.channel.at(frames[before]))
        if interpolation == "value":
            return spread(self.channel.at(frame))
        first, second = self.channel.at(frames[before]), self.channel.at(frames[after])
        if not (first.any() and second.any()):
            return spread(self.channel.at(frame))
        eases = [ease for _, ease in self.keys]
        share = self.share.at(frame) if self.share else eased_span(frames, eases, frame)[2]
        return between_bars(spread(first), spread(second), share)


def eased_span(frames: Sequence[float], eases: Sequence[Ease], frame: float) -> tuple[int, int, float]:
    """Return the indices of the keys before and after a frame, and the eased share 0 to 1 of the way between them.

    Args:
        frames: The keys' frames, ascending.
        eases: The ease from each key to the next.
        frame: The frame.
    """
    before, after, share = span(frames, frame)
    return before, after, eased(share, eases[before])


def _given(value: Any) -> Any:
    """Return the value of a channel, or raise it if it is a UserError."""
    if isinstance(value, UserError):
        raise value.with_traceback(None)  # a traceback would grow with every raise
    return value
