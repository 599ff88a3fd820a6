"""Windows: the source frames around the shown one that an exposure can use, also at the ends of a shot.

A shot is the source frames between two cuts. A position is the number that a frame of the window would have if the
footage went on beyond its ends.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import shutters
from .frame_state import FrameState, Options


def positions(options: Options, index: int, direction: int = 1) -> np.ndarray:
    """Return the frame numbers (L,) of a window around a shown frame, as if the footage had no ends.

    They are in the window's order, from its first frame to its last.

    A filmed frame lasts until the next one. So if the footage plays backward, the moments after it come first, and the
    filmed frame last.

    Args:
        options: Of the state.
        index: The shown source frame.
        direction: 1, or −1 if the footage plays backward: later frames of the window then have lower positions.
    """
    return origin(options, index, direction) + direction * np.arange(options.window)


def reach(state: FrameState, index: int, direction: int = 1) -> tuple[int, int]:
    """Return the lowest and the highest position, as a frame number of the footage, that any shutter exposes.

    Positions can lie beyond the footage. Arguments as for `positions`.
    """
    first = origin(state.options, index, direction)
    ends = [first + direction * place for place in (state.open_span[0], state.open_span[1] - 1)]
    return min(ends), max(ends)


def origin(options: Options, index: int, direction: int = 1) -> int:
    """Return the position of the window's first frame, as a frame number of the footage, possibly beyond its ends.

    Arguments as for `positions`.
    """
    return (index if direction > 0 else index + options.step - 1) - direction * options.before


def slid(state: FrameState, index: int, direction: int, shot: range, *, whole: bool = False) -> FrameState:
    """Return the state with exposures moved into the shot if its edges are "slide", else the state itself.

    Each shutter moves only as far as it has to. An exposure that is longer than the shot covers it and goes beyond.

    Args:
        state: The state.
        index: The shown source frame.
        direction: As for `positions`.
        shot: The source frames of the shot.
        whole: Move the window even if no bars have to move, since trails may become as long as it is.
    """
    options = state.options
    first, last_filmed = origin(options, index, direction), (shot.stop - 1) // options.step * options.step
    ends = shot.start, last_filmed + options.step - 1  # the last filmed frame has moments, too
    low, high = sorted(direction * (end - first) for end in ends)

    def way(start: int, stop: int) -> int:
        return sorted((0, low - start, high + 1 - stop))[1]

    spans = [_filmed(shutters.open_span(shutters.are_open(bars)), options) for bars in state.bars]
    if options.edges != "slide" or not (whole or any(way(*span) for span in spans)):
        return state
    moved, by = np.zeros_like(state.bars), way(0, options.window)
    for new, bars, (start, stop) in zip(moved, state.bars, spans, strict=True):
        place = start + way(start, stop) - by
        new[place : place + stop - start] = bars[start:stop]
    return replace(state, bars=moved, options=replace(options, slid=options.slid + by))


def _filmed(span: tuple[int, int], options: Options) -> tuple[int, int]:
    """Extend a span of the window (first frame, one past the last) to whole filmed frames, since bars move by these."""
    start, stop = span
    return start - start % options.step, min(stop + -stop % options.step, options.window)


def source_frames(options: Options, positions: np.ndarray, shot: range) -> np.ndarray:
    """Return the source frame that a window shows at each of its positions; −1 for none.

    Beyond the shot's ends, "hold" and "slide" repeat its first or last frame, and "mirror" plays back from there
    without repeating it. "shorten" leaves frames out, unless all are beyond: then it repeats the first or last frame,
    too.

    Args:
        options: Of the state.
        positions: From `positions`, any of them.
        shot: The source frames between two cuts, or range(count) for a whole clip.
    """
    first, count = shot.start, len(shot)
    held = np.minimum(np.maximum(positions, first), shot.stop - 1)  # faster than np.clip for short arrays
    if options.edges == "mirror" and count > 1:
        folded = np.mod(positions - first, 2 * (count - 1))
        return first + np.where(folded < count, folded, 2 * (count - 1) - folded)
    if options.edges == "shorten" and (positions == held).any():
        return np.where(positions == held, held, -1)
    return held


def indices(options: Options, index: int, shot: range, direction: int = 1) -> np.ndarray:
    """Return the source frames (L,) that can be exposed when a frame is shown; −1 for those that are left out.

    Args:
        options: Of the state.
        index: The shown source frame.
        shot: As for `source_frames`.
        direction: As for `positions`.
    """
    return source_frames(options, positions(options, index, direction), shot)
