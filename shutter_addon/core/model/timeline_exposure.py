"""Length: Timeline. A shutter's bars are the shape of its exposure over a frame of the timeline, however fast the
footage runs there, as if a camera of the timeline's frame rate had filmed what is seen.

Footage that runs s source frames in a frame of the timeline is exposed for s of them by a shutter that is open
throughout; in a freeze, for the shown frame alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .clip import Clip, Shown
from .effect import Effect
from .frame_state import FrameState, Options

# In frames: what is open for less is open in one.
_SHORTEST = 1e-6
# Of the exposure, what has to be in the window.
_LEAST = 1e-9


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
    if np.ptp(places) < _SHORTEST:
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
    if end - start < _SHORTEST:
        return (np.arange(window) == np.floor(start + _SHORTEST)).astype(float)
    boundaries = np.clip(np.arange(window + 1), start, end)
    return np.diff(boundaries) / (end - start)
