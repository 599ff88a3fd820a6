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
    """Return the source frame (L,) at each place of a window around a shown frame, as if the footage had no ends.

    The order is that of the window: time as the footage plays, so that numbers fall if it plays backward. A filmed
    frame is followed by its moments, made between it and the next one. Backward, it comes last, after its moments.

    Args:
        options: Of the state.
        index: The shown source frame.
        direction: 1 if the footage plays forward, −1 if backward.
    """
    return origin(options, index, direction) + direction * np.arange(options.window)


def reach(state: FrameState, index: int, direction: int = 1) -> tuple[int, int]:
    """Return the lowest and the highest position (frame number of the footage) that any shutter exposes.

    They can lie beyond the footage's ends. If a shutter has a threshold, the shown frame is always included.

    Args:
        state: The state; its bars tell which places of the window are open.
        index: The shown source frame.
        direction: As for `positions`.
    """
    first = origin(state.options, index, direction)
    ends = [first + direction * place for place in (state.open_span[0], state.open_span[1] - 1)]
    return min(ends), max(ends)


def origin(options: Options, index: int, direction: int = 1) -> int:
    """Return the position (frame number of the footage) of the window's first frame, also beyond the footage.

    Args:
        options: Of the state.
        index: The shown source frame.
        direction: As for `positions`.
    """
    return (index if direction > 0 else index + options.step - 1) - direction * options.before


def slid(state: FrameState, index: int, direction: int, shot: range, *, whole: bool = False) -> FrameState:
    """Return the state with its exposures moved into a shot, for Options.edges "slide". Else the state is unchanged.

    Each shutter moves no farther than needed to bring the filmed frames that it exposes, with their moments, into the
    shot. An exposure longer than the shot covers all of it and reaches beyond.

    Args:
        index: The shown source frame.
        direction: As for `positions`.
        shot: The source frames of the shot.
        whole: Whether the window moves into the shot even if all open bars lie there already. Trails need this, since
            they may become as long as the window.
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
    """Return the source frame that the window uses at each position; −1 for a frame that is left out.

    Beyond the shot's ends it depends on Options.edges: "hold" and "slide" use the first or last frame. "mirror" runs
    back from the end, without using the last frame twice. "shorten" leaves frames out; if all would be, it uses the
    first or last frame like "hold".

    Args:
        options: Of the state.
        positions: Positions as from `positions`: all of them, or some.
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
