"""Trail length: an exposure whose span has what it follows move by a given length, however fast that is.

The bars say the shape of the exposure. Their times are scaled about the shown frame, so that the quantile keeps its
shape, until the way has its length; the span is no whole number of frames, and changes without jumps.
"""

from __future__ import annotations

import numpy as np

from . import shutters

# In frames.
_SHORTEST = 1e-3
# Of the exposure. Where bars go from key to key, rounding may leave as much in a bar that is closed.
_CLOSED = 1e-9


def travelled(places: np.ndarray) -> np.ndarray:
    """How far a subject has moved at the boundaries of the window's bars: (L + 1,), ascending from 0.

    places: (L, P) complex, where P of its points are in the window's frames; of each step the fastest point counts. The
    way from one frame to the next belongs to both of their bars, and the outermost go on at the pace beside them."""
    steps = np.abs(np.diff(places, axis=0)).max(axis=1, initial=0)
    if not steps.size:
        return np.zeros(2)
    own = (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2
    return np.concatenate([[0.0], np.cumsum(own)])


def shortened(bars: np.ndarray, share: float, shown: float) -> tuple[np.ndarray, float]:
    """Bars (L,) of the same shape and sum, open for a share 0 to 1 of their time about the shown frame, and for that
    frame at least. And for how many frames that is.

    shown: the middle of the shown frame's bar, in 0 … L; of bars that are closed there, the nearest that is open"""
    bars = np.where(bars > _CLOSED * bars.sum(), bars, 0)
    first, last = shutters.open_span(bars)
    own = min(max(shown - 0.5, first), last - 1)
    start, end = own + share * (first - own), own + 1 + share * (last - own - 1)
    return shutters.spanning(bars, start, end), end - start


def with_length(bars: np.ndarray, way: np.ndarray, length: float, shown: float) -> tuple[np.ndarray, float]:
    """Bars (L,) of the same shape and sum, open while a subject moves by `length`, no longer than that takes; for the
    whole window, where it moves less. And for how many frames that is.

    way: of `travelled`, in the unit of the length
    shown: the time in 0 … L that keeps its place; of bars that are closed there, the nearest that is open. Where an end
    of the span reaches the window's, only the other one goes on"""
    bars = np.where(bars > _CLOSED * bars.sum(), bars, 0)
    first, last = shutters.open_span(bars)
    about = min(max(shown, first), last)
    before = (about - first) / (last - first)
    boundaries = np.arange(len(way), dtype=np.float64)

    def starts(widths: np.ndarray | float) -> np.ndarray:
        return np.clip(about - before * widths, 0, len(bars) - widths)

    # The way within a span is piecewise linear in its width, and bends where an end passes a boundary.
    bends = [boundaries]
    bends += [(boundaries - about) / share for share in (-before, 1 - before) if share]
    widths = np.unique(np.concatenate(bends).clip(0, len(bars)))
    moved = np.interp(starts(widths) + widths, boundaries, way) - np.interp(starts(widths), boundaries, way)
    moved = np.maximum.accumulate(moved)  # by rounding alone would it fall
    # Backward, for of widths that add no motion the least counts: a trail of no length is a still frame.
    width = float(np.interp(-length, -moved[::-1], widths[::-1]) if length <= moved[-1] else len(bars))
    width = max(width, _SHORTEST)
    start = float(starts(width))
    return shutters.spanning(bars, start, start + width), width
