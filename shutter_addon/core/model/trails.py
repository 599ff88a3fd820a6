"""Lengths of exposures whose bars only describe their shape.

Trail length: the exposure lasts while the followed subject moves by a given distance, at any speed. The bars' times are
scaled about the shown frame, so that the quantile keeps its shape. The span is not a whole number of frames and changes
without jumps.

Timeline length: the bars are the shape of an exposure over one frame of the timeline, at any speed of the footage, as
if a camera with the timeline's frame rate had filmed what is seen. If the footage runs s source frames per timeline
frame, a fully open shutter exposes s of them. In a freeze it exposes the shown frame.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import shutters
from .clip import Clip, Shown
from .effect import Effect
from .frame_state import FrameState, Options

# Frames: shorter spans of the timeline expose a single frame.
_INSTANT = 1e-6
# Fraction of the exposure that the window has to contain.
_LEAST = 1e-9


def travelled(places: np.ndarray) -> np.ndarray:
    """Return how far a subject has moved at the boundaries of the window's bars: (L + 1,), ascending from 0.

    The fastest point counts for each step. The step between two frames belongs to both of their bars. The outermost
    bars continue at their neighbour's pace.

    Args:
        places: (L, P) complex, P points of the subject in the window's frames.
    """
    steps = np.abs(np.diff(places, axis=0)).max(axis=1, initial=0)
    if not steps.size:
        return np.zeros(2)
    own = (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2
    return np.concatenate([[0.0], np.cumsum(own)])


def shortened(bars: np.ndarray, share: float, shown: float) -> np.ndarray:
    """Return bars (L,) of the same shape and sum that are open for a share of their time.

    They are open for at least one frame.

    Args:
        share: 0 to 1, about the shown frame.
        shown: The middle of the shown frame's bar, in 0 … L; clamped to the open bars.
    """
    bars = np.where(shutters.are_open(bars), bars, 0)
    first, last = shutters.open_span(bars)
    own = min(max(shown - 0.5, first), last - 1)
    start, end = own + share * (first - own), own + 1 + share * (last - own - 1)
    return shutters.spanning(bars, start, end)


def with_length(bars: np.ndarray, way: np.ndarray, length: float, shown: float) -> np.ndarray:
    """Return bars (L,) of the same shape and sum that are open while a subject moves by `length`.

    If the subject moves less, they are open for the whole window.

    Args:
        way: From `travelled`, in the unit of `length`.
        shown: The time in 0 … L that keeps its place, clamped to the open bars. Where one end of the span reaches the
            window's end, only the other one continues.
    """
    bars = np.where(shutters.are_open(bars), bars, 0)
    first, last = shutters.open_span(bars)
    about = min(max(shown, first), last)
    before = (about - first) / (last - first)
    boundaries = np.arange(len(way), dtype=np.float64)

    def starts(widths: np.ndarray | float) -> np.ndarray:
        return np.clip(about - before * widths, 0, len(bars) - widths)

    # The way within a span is piecewise linear in the span's width. It bends where an end passes a boundary.
    bends = [boundaries]
    bends += [(boundaries - about) / share for share in (-before, 1 - before) if share]
    widths = np.unique(np.concatenate(bends).clip(0, len(bars)))
    moved = np.interp(starts(widths) + widths, boundaries, way) - np.interp(starts(widths), boundaries, way)
    moved = np.maximum.accumulate(moved)  # avoids a decrease from rounding
    # Reversed, so that the smallest of the widths without added motion counts: a trail of length 0 is a still frame.
    width = float(np.interp(-length, -moved[::-1], widths[::-1]) if length <= moved[-1] else len(bars))
    width = max(width, 1e-3)  # frames that the shortest trail lasts
    start = float(starts(width))
    return shutters.spanning(bars, start, start + width)


def exposed(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """Return the state at a timeline frame with the bars of shutters with the timeline's length."""
    chosen = [i for i, shutter in enumerate(effect.shutters) if shutter.length == "timeline"]
    if not chosen:
        return state
    places = np.array([clip.position(at.frame + k) for k in (-1, -0.5, 0, 0.5, 1)])
    here = places[2]
    if places[0] == here in clip.ends:  # the strip repeats its end frame there, which is not a freeze
        places[:2] = 2 * here - places[:2:-1]
    elif places[4] == here in clip.ends:
        places[3:] = 2 * here - places[1::-1]
    bars = state.bars.copy()
    for index in chosen:
        bars[index] = on_timeline(bars[index], state.options, places)
    return replace(state, bars=bars)


def on_timeline(bars: np.ndarray, options: Options, positions: np.ndarray) -> np.ndarray:
    """Return bars (L,) of the window for bars that shape an exposure over a timeline frame, with the same sum.

    Light outside the window is left out. By Options.position, the exposure begins with the shown filmed frame, has its
    middle there, or ends with it.

    Args:
        positions: (n,), n odd: positions in the source, in frames, from the previous to the next timeline frame at even
            distances.
    """
    window, here = len(bars), positions[len(positions) // 2]
    begin, anchor = {
        "start": (0.0, 0.0),
        "center": (-0.5, options.step / 2),
        "end": (-1.0, float(options.step)),
    }[options.position]
    times = begin + np.arange(window + 1) / window
    way = np.interp(times, np.linspace(-1, 1, len(positions)), positions) - here
    places = options.before + anchor + (-way if options.backward else way)
    found, shown = np.zeros(window), min(options.shown, window - 1)  # the window may be shorter than a filmed frame
    if np.ptp(places) < _INSTANT:
        found[shown] = bars.sum()
        return found
    for weight, start, end in zip(bars, places[:-1], places[1:], strict=True):
        found += weight * _spread(min(start, end), max(start, end), window)
    if found.sum() <= _LEAST * bars.sum():  # everything is outside the window
        found[shown] = 1.0
    return found * (bars.sum() / found.sum())


def _spread(start: float, end: float, window: int) -> np.ndarray:
    """Return how much of the time from start to end falls on each frame of a window (L,)."""
    if end - start < _INSTANT:
        return (np.arange(window) == np.floor(start + _INSTANT)).astype(float)
    boundaries = np.clip(np.arange(window + 1), start, end)
    return np.diff(boundaries) / (end - start)
