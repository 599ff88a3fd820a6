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
    """Return how far a value has changed from one key to the next: 0 at the first key, 1 at the second.

    Args:
        u: The share of the time between the two keys that has passed, 0 to 1.
        ease: "linear": u. "constant": 0 until the second key. "bezier": u²(3 − 2u), slow at both ends, as with flat
            handles in Blender.
    """
    if ease == "constant":
        return 0.0 if u < 1 else 1.0
    return u * u * (3 - 2 * u) if ease == "bezier" else u


def span(frames: Sequence[float], frame: float) -> tuple[int, int, float]:
    """Return the indices of the keys before and after a frame, and the share 0 to 1 of the way between them.

    Outside the keys and on a key, both indices are the nearest key's, and the share is 0.

    Args:
        frames: The keys' frames, ascending.
    """
    after = bisect_right(frames, frame)
    if after == 0:
        return 0, 0, 0.0
    before = after - 1
    if after == len(frames) or frames[before] == frame:
        return before, before, 0.0
    return before, after, (frame - frames[before]) / (frames[after] - frames[before])


def between_bars(first: ArrayLike, second: ArrayLike, u: float, interpolation: str = "displacement") -> np.ndarray:
    """Interpolate the bars of a shutter between two keys.

    Args:
        first, second: The bars (L,) at the two keys. For "displacement", each needs an open bar (above 0).
        u: The share of the way from the first to the second, 0 to 1.
        interpolation: "displacement" moves the open bars in time, from frame to frame (shutters.displace). "value"
            interpolates each bar by itself, so that the first bars fade out as the second ones fade in.

    Returns:
        The bars, (L,) float64. In either case their sum is interpolated linearly.
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
        frames: The keys' frames, ascending. Before the first and after the last, the value stays as at that key.
        values: The value at each key.
        eases: For each key the ease from it to the next; that of the last key is not used.
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
        values: {frame: value}. `at` raises a value that is a UserError.
        keys: (frame, ease to the next key) of each key of the curve, ascending, for code that needs keys; `at` does not
            use them. Empty: the curve had none.
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
    """A channel for Effect.time: its `at` returns (source frame, whether the footage runs backward).

    The footage runs backward where the source frame falls within the next half timeline frame. Where it stands still,
    the direction in which it arrived at a key counts: at the latest key so far before which it was moving. Without such
    a key, it is forward.

    Attributes:
        numbers: Channel of the source frame, with a fraction; the footage's first frame is 1.
        keys: (timeline frame, ease to the next key) of each key of the source frame, ascending.
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
        channel: Channel of the bars. At keys, and between keys where each bar fades by itself, its values are used as
            they are. Elsewhere between keys, the bars of the keys before and after are displaced (`at`).
        keys: (frame, ease to the next key) of each key, ascending. Before the first and after the last, that key's bars
            stay. Empty: `channel` is used at every frame.
        share: Channel of how far the bars have moved from the key before a frame to the key after it, 0 to 1. None:
            that follows from the eases.
    """

    channel: Channel
    keys: tuple[tuple[float, Ease], ...] = ()
    share: Channel | None = None

    def at(
        self, frame: float, interpolation: str, spread: Callable[[np.ndarray], np.ndarray] = np.asarray
    ) -> np.ndarray:
        """Return the bars at a frame.

        Args:
            interpolation: Options.interpolation, for frames between two keys. "displacement" moves the open bars in
                time (paper §3.4.1); if all bars of one of the two keys are 0, it does as "value" does. "value" uses
                `channel`, in which each bar fades by itself.
            spread: A function that turns bars of filmed frames (L,) into bars of moments (L · steps,) (Shutter.spread).
                It is applied before displacement, which so can open moments between filmed frames. By default, bars
                stay those of filmed frames.
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

    Outside the keys and on a key, both indices are the nearest key's, and the share is 0.

    Args:
        frames: The keys' frames, ascending.
        eases: For each key the ease from it to the next; that of the last key does not matter.
    """
    before, after, share = span(frames, frame)
    return before, after, eased(share, eases[before])


def _given(value: Any) -> Any:
    """Return the value of a channel, or raise it if it is a UserError."""
    if isinstance(value, UserError):
        raise value.with_traceback(None)  # a traceback would grow with every raise
    return value
