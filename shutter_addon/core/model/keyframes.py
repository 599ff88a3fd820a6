"""Values over time: constant, keyed with eases, or sampled; and a shutter's bars from key to key."""

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
    """Return the progress 0 to 1 through a span. "bezier" has flat handles of a third of the span: u²(3 − 2u)."""
    if ease == "constant":
        return 0.0 if u < 1 else 1.0
    return u * u * (3 - 2 * u) if ease == "bezier" else u


def span(frames: Sequence[float], frame: float) -> tuple[int, int, float]:
    """Return the indices of the keys around `frame` in ascending `frames`, and the share 0 to 1 between them.

    Outside the keys and on a key, both indices are the nearest key's.
    """
    after = bisect_right(frames, frame)
    if after == 0:
        return 0, 0, 0.0
    before = after - 1
    if after == len(frames) or frames[before] == frame:
        return before, before, 0.0
    return before, after, (frame - frames[before]) / (frames[after] - frames[before])


def between_bars(first: ArrayLike, second: ArrayLike, u: float, interpolation: str = "displacement") -> np.ndarray:
    """Return bars (L,) a share u of the way between two shutters: by displacement, or linearly per bar ("value")."""
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
        """Return the value at a frame. UserError: the stored value is invalid."""


@dataclass(frozen=True)
class Constant:
    """The same value at every frame. A UserError as the value is raised by `at`."""

    value: Any

    def at(self, _frame: float) -> Any:
        return _given(self.value)


@dataclass(frozen=True)
class Keys:
    """Numbers or arrays at ascending frames, interpolated with the ease of each span."""

    frames: tuple[float, ...]
    values: tuple
    eases: tuple[Ease, ...]

    def at(self, frame: float) -> np.ndarray:
        before, after, share = eased_span(self.frames, self.eases, frame)
        first, second = np.asarray(self.values[before]), np.asarray(self.values[after])
        return first + share * (second - first)  # exact for equal values


@dataclass(frozen=True)
class Samples:
    """Values at the frames where they were sampled. A UserError among them is raised by `at`.

    Attributes:
        keys: Frames and eases of the sampled curve's keys, ascending; empty if it had none.
    """

    values: dict[float, Any]
    keys: tuple[tuple[float, Ease], ...] = ()

    def at(self, frame: float) -> Any:
        """Return the value at a sampled frame. KeyError: it was not sampled."""
        return _given(self.values[frame])


@dataclass(frozen=True)
class Computed:
    """A value that a function computes."""

    at: Callable[[float], Any]


@dataclass(frozen=True)
class SourceTime:
    """A channel of (source frame, whether it runs backward), from a channel of numbers.

    While time stands still, the direction is the last movement's towards one of the `keys`, or forward after jumps.
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
        channel: The bars where they are not displaced: on keys, outside of them, and between keys by value.
        keys: Frames and eases of the keys, ascending; without keys, only `channel` counts.
        share: Channel of the share 0 to 1 between the keys around a frame; None: the eases determine it.
    """

    channel: Channel
    keys: tuple[tuple[float, Ease], ...] = ()
    share: Channel | None = None

    def at(
        self, frame: float, interpolation: str, spread: Callable[[np.ndarray], np.ndarray] = np.asarray
    ) -> np.ndarray:
        """Return the bars at a frame.

        Between keys they are displaced (paper §3.4.1, over time). `channel` counts if interpolation is "value", and
        before and after a closed shutter, which cannot be displaced.

        Args:
            spread: Turns bars of filmed frames into bars of moments, so that displacement passes through moments.
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
    """Return `span` with the eased share; a key's ease is that of the span after it."""
    before, after, share = span(frames, frame)
    return before, after, eased(share, eases[before])


def _given(value: Any) -> Any:
    if isinstance(value, UserError):
        raise value.with_traceback(None)  # a traceback would grow with every raise
    return value
