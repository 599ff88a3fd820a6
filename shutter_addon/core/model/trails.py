"""How long exposures are whose bars say their shape alone.

Trail length: an exposure whose span has what it follows move by a given length, however fast that is. The times of its
bars are scaled about the shown frame, so that the quantile keeps its shape, until the way has its length; the span is
no whole number of frames, and changes without jumps.

Length: Timeline. A shutter's bars are the shape of its exposure over a frame of the timeline, however fast the footage
runs there, as if a camera of the timeline's frame rate had filmed what is seen. Footage that runs s source frames in a
frame of the timeline is exposed for s of them by a shutter that is open throughout; in a freeze, for the shown frame
alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import shutters
from .clip import Clip, Shown
from .effect import Effect
from .frame_state import FrameState, Options

# In frames.
_SHORTEST = 1e-3
# In frames: what is open for less of the timeline is open in one.
_INSTANT = 1e-6
# Of the exposure, what has to be in the window.
_LEAST = 1e-9


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
    bars = np.where(shutters.are_open(bars), bars, 0)
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
    bars = np.where(shutters.are_open(bars), bars, 0)
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


def exposed(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """The effect's state at a timeline frame, with the bars of those shutters whose length is the timeline's, and for
    how many frames they are open (FrameState.open_for)."""
    chosen = [i for i, shutter in enumerate(effect.shutters) if shutter.length == "timeline"]
    if not chosen:
        return state
    places = np.array([clip.position(at.frame + k) for k in (-1, -0.5, 0, 0.5, 1)])
    here = places[2]
    if places[0] == here in clip.ends:  # there a strip goes on with the same frame: it is no freeze
        places[:2] = 2 * here - places[:2:-1]
    elif places[4] == here in clip.ends:
        places[3:] = 2 * here - places[1::-1]
    bars, open_for = state.bars.copy(), dict(state.open_for)
    for index in chosen:
        bars[index], open_for[index] = on_timeline(bars[index], state.options, places)
    return replace(state, bars=bars, open_for=open_for)


def on_timeline(bars: np.ndarray, options: Options, positions: np.ndarray) -> tuple[np.ndarray, float]:
    """Bars (L,) of a window by those that are the shape of an exposure over a timeline frame, of the same sum; and how
    many frames it goes through, from its first open time to its last.

    positions: (n,), n odd, in the source, in frames, of the timeline frame before, the shown one in the middle, and the
    next, evenly apart; even in between
    What the window does not reach is left out. By Options.position the exposure begins with the shown filmed frame, has
    its middle there, or ends with it."""
    window, here = len(bars), positions[len(positions) // 2]
    begin, anchor = {
        "start": (0.0, 0.0),
        "center": (-0.5, options.step / 2),
        "end": (-1.0, float(options.step)),
    }[options.position]
    times = begin + np.arange(window + 1) / window
    way = np.interp(times, np.linspace(-1, 1, len(positions)), positions) - here
    places = options.before + anchor + (-way if options.backward else way)
    found, shown = np.zeros(window), min(options.shown, window - 1)  # it may be shorter than a filmed frame
    if np.ptp(places) < _INSTANT:
        found[shown] = bars.sum()
        return found, 0.0
    for weight, start, end in zip(bars, places[:-1], places[1:], strict=True):
        found += weight * _spread(min(start, end), max(start, end), window)
    is_open = np.flatnonzero(bars)
    length = float(np.ptp(places[is_open[0] : is_open[-1] + 2]))
    if found.sum() <= _LEAST * bars.sum():  # all of it lies beyond the window
        found[shown] = 1.0
    return found * (bars.sum() / found.sum()), length


def _spread(start: float, end: float, window: int) -> np.ndarray:
    """How much of a time from start to end falls on each frame of a window (L,)."""
    if end - start < _INSTANT:
        return (np.arange(window) == np.floor(start + _INSTANT)).astype(float)
    boundaries = np.clip(np.arange(window + 1), start, end)
    return np.diff(boundaries) / (end - start)
