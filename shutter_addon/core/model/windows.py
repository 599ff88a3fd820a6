"""Windows: the source frames around the shown one that an exposure can use, also at the ends of a shot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import shutters
from .frame_state import FrameState, Options


def positions(options: Options, index: int, direction: int = 1) -> np.ndarray:
    """Return the positions (L,) of the window's frames around source frame `index`, also beyond the clip's ends.

    Args:
        direction: 1, or −1 where the source plays in reverse. Then later frames of the window are before `index`. A
            filmed frame lasts until the next one, so in reverse the moments after it come first, the last one leading.
    """
    return origin(options, index, direction) + direction * np.arange(options.window)


def reach(state: FrameState, index: int, direction: int = 1) -> tuple[int, int]:
    """Return the first and the last position that any shutter exposes."""
    first = origin(state.options, index, direction)
    ends = [first + direction * place for place in (state.open_span[0], state.open_span[1] - 1)]
    return min(ends), max(ends)


def origin(options: Options, index: int, direction: int = 1) -> int:
    """Return the position of the window's first frame, for arguments as in `positions`."""
    return (index if direction > 0 else index + options.step - 1) - direction * options.before


def slid(state: FrameState, index: int, direction: int, shot: range, *, whole: bool = False) -> FrameState:
    """Return the state with exposures moved back into `shot` if its edges are "slide".

    Each shutter moves only as far as it has to. An exposure that is longer than the shot covers it and goes beyond.

    Args:
        whole: Move the window even if no bars move, since trails may become as long as it is. Otherwise it moves only
            with bars that need the room.
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
    """Extend a span of the window's frames to whole filmed frames, since bars move by these."""
    start, stop = span
    return start - start % options.step, min(stop + -stop % options.step, options.window)


def source_frames(options: Options, positions: np.ndarray, shot: range) -> np.ndarray:
    """Return the frames that a window shows at `positions`; −1: none.

    Past the ends, "hold" and "slide" repeat the last frame, and "mirror" plays back from it without repeating it.
    "shorten" leaves frames out, but keeps the nearest if all are outside.

    Args:
        shot: range(count) for a whole clip, or the frames between two of its cuts.
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
    """Return source frames (L,) of the window around source frame `index`; −1: left out. Arguments as above."""
    return source_frames(options, positions(options, index, direction), shot)
