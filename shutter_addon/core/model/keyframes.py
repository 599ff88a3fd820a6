"""Values over time: constant, at keys with their eases, or sampled; and how a shutter's bars go from key to key."""

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
    """Progress 0 to 1 through a span. "bezier" has flat handles of a third of the span: u²(3 − 2u)."""
    if ease == "constant":
        return 0.0 if u < 1 else 1.0
    return u * u * (3 - 2 * u) if ease == "bezier" else u


def span(frames: Sequence[float], frame: float) -> tuple[int, int, float]:
    """Indices of the keys before and after `frame` in ascending `frames`, and the share 0 to 1 between them.

    Outside the keys both are the nearest one; on a key both are that key.
    """
    after = bisect_right(frames, frame)
    if after == 0:
        return 0, 0, 0.0
    before = after - 1
    if after == len(frames) or frames[before] == frame:
        return before, before, 0.0
    return before, after, (frame - frames[before]) / (frames[after] - frames[before])


def between_bars(first: ArrayLike, second: ArrayLike, u: float, interpolation: str = "displacement") -> np.ndarray:
    """Bars (L,) a share u of the way from one shutter to another: by displacement, or, as F-curves do, bar by bar
    ("value")."""
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
        """The value at a frame. UserError: there is none that an effect can have."""


@dataclass(frozen=True)
class Constant:
    """The same value at every frame; a UserError is raised where the value is asked for."""

    value: Any

    def at(self, _frame: float) -> Any:
        return _given(self.value)


@dataclass(frozen=True)
class Keys:
    """Numbers or arrays at ascending frames, linear in between after the ease of the span (eased)."""

    frames: tuple[float, ...]
    values: tuple
    eases: tuple[Ease, ...]

    def at(self, frame: float) -> np.ndarray:
        before, after, share = eased_span(self.frames, self.eases, frame)
        first, second = np.asarray(self.values[before]), np.asarray(self.values[after])
        return first + share * (second - first)  # equal ones stay what they are, to the last bit


@dataclass(frozen=True)
class Samples:
    """Values at frames where they were sampled, and nowhere else. A UserError among them is raised where the value
    is asked for.

    keys: frames and eases of the keys of the curve that was sampled, ascending; none where it is no curve of keys."""

    values: dict[float, Any]
    keys: tuple[tuple[float, Ease], ...] = ()

    def at(self, frame: float) -> Any:
        """KeyError: the frame was not sampled."""
        return _given(self.values[frame])


@dataclass(frozen=True)
class Computed:
    """What a function gives at a frame."""

    at: Callable[[float], Any]


@dataclass(frozen=True)
class SourceTime:
    """Channel of (source frame, whether it runs backward from there), made of a channel of numbers.

    Where time stands still it keeps the direction in which it last moved towards one of its `keys`; forward, if it only
    jumped.
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

    channel: the bars where they are not displaced: on keys, outside of them, and between keys by value
    keys: frames and eases of the keys, ascending; without any, `channel` alone counts
    share: channel of the share 0 to 1 of the way from the key before a frame to the key after it; None: by the eases"""

    channel: Channel
    keys: tuple[tuple[float, Ease], ...] = ()
    share: Channel | None = None

    def at(
        self, frame: float, interpolation: str, spread: Callable[[np.ndarray], np.ndarray] = np.asarray
    ) -> np.ndarray:
        """Between keys by displacement (paper §3.4.1, over time), or by `channel`: where interpolation is "value", and
        on the way to and from a closed shutter, which is no displacement.

        spread: makes the bars of moments of those of filmed frames, so that what is displaced passes through moments"""
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
    """As span, the share with the ease of the span: eases are of the keys that begin them."""
    before, after, share = span(frames, frame)
    return before, after, eased(share, eases[before])


def _given(value: Any) -> Any:
    if isinstance(value, UserError):
        raise value.with_traceback(None)  # which would grow with every raise
    return value
