"""How much each frame of a window counts at the pixels of a tile, with NumPy."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.model import shutters
from ..core.model.frame_state import Options
from .cpu_window import Tile

# Pieces of a quantile that are computed in one step.
TOGETHER = 3

Weight = tuple[int, np.ndarray | float]  # of a frame: (h, w) or a number


class Mix(NamedTuple):
    """A tile with the coefficients c (N, h, w) of its blocks of pixels, block × block each."""

    tile: Tile
    c: np.ndarray
    block: int

    def pixels(self, values: np.ndarray | float) -> Any:
        """See Tile.pixels."""
        return self.tile.pixels(values, self.block)


class Exposed(NamedTuple):
    """What a window exposes: its bars (N, L), forwards in time, from the position `origin` on; present (L,) bool: which
    of its frames there are."""

    options: Options
    bars: np.ndarray
    origin: int
    present: np.ndarray
    direction: int


def mixed(times: ArrayLike, c: np.ndarray) -> np.ndarray:
    """Σ cᵢ · timesᵢ (K, h, w) float32 for coefficients c (N, h, w) and times, or other numbers, (K, N)."""
    times = np.asarray(times, dtype=np.float32)
    return (times @ c.reshape(len(c), -1)).reshape(-1, *c.shape[1:])


def pace(knots: shutters.Quantile) -> np.ndarray:
    """The time (K, N) by which a level takes each piece of the shutters' quantiles: 1 or more."""
    return (knots.end - knots.start) / np.diff(knots.z)[:, None]


def displaced(knots: shutters.Quantile, count: int, c: np.ndarray) -> Iterator[Weight]:
    """Yields (frame, weight (h, w) or a number) of the interpolated shutter, of frames that may have any."""
    ends, paces, dz = np.arange(count) + 1, pace(knots), np.diff(knots.z).astype(np.float32)[:, None, None]
    # The quantile's pieces that are over everywhere at each frame's end, and those that have begun somewhere.
    over = np.searchsorted(-_least(-knots.end, c), ends, "right").tolist()
    begun = np.searchsorted(_least(knots.start, c), ends, "left").tolist()
    before: np.ndarray | float = 0.0
    for end, low, high in zip(ends.tolist(), over, begun, strict=True):
        after: np.ndarray | float = float(knots.z[low])
        for k in range(low, high, TOGETHER):
            some = slice(k, min(k + TOGETHER, high))
            passed = mixed(end - knots.start[some], c)
            passed /= mixed(paces[some], c)
            after = after + np.clip(passed, 0, dz[some], out=passed).sum(axis=0)
        if np.ndim(before) or np.ndim(after) or after > before:
            yield end - 1, after - before
        before = after


def _least(times: np.ndarray, c: np.ndarray) -> np.ndarray:
    """The least (K,) of mixed times (K, N) on a tile, as far as the range of each coefficient tells."""
    low, high = (extreme(c, axis=(1, 2)).astype(np.float64) for extreme in (np.min, np.max))
    # What the coefficients' least leave of 1 goes to the earliest times first, as far as their most allow.
    order = np.argsort(times, axis=1)
    given = np.minimum(np.cumsum((high - low)[order], axis=1), max(0.0, 1 - low.sum()))
    shares = np.diff(given, axis=1, prepend=0)
    return (times * low).sum(axis=1) + (shares * np.take_along_axis(times, order, axis=1)).sum(axis=1)


def valued(normalised: np.ndarray, c: np.ndarray) -> Iterator[Weight]:
    """As displaced, by value interpolation."""
    for frame in np.flatnonzero(normalised.any(axis=0)).tolist():
        yield frame, mixed(normalised[None, :, frame], c)[0]
