"""Windows: which source frames those of a window are, around the shown one, at the ends of a shot as well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import shutters
from .frame_state import FrameState, Options


def positions(options: Options, index: int, direction: int = 1) -> np.ndarray:
    """Where the window's frames (L,) lie around source frame `index`, beyond the clip's ends as well.

    direction: 1, or −1 where the source plays in reverse, and the window's next frames are those before `index`. A
    filmed frame lasts until the next one, so that in reverse the moments after it come first, from the last one on.
    """
    return origin(options, index, direction) + direction * np.arange(options.window)


def reach(state: FrameState, index: int, direction: int = 1) -> tuple[int, int]:
    """The first and the last of the positions that any shutter exposes."""
    first = origin(state.options, index, direction)
    ends = [first + direction * place for place in (state.open_span[0], state.open_span[1] - 1)]
    return min(ends), max(ends)


def origin(options: Options, index: int, direction: int = 1) -> int:
    """The position of the window's first frame; arguments like those of `positions`."""
    return (index if direction > 0 else index + options.step - 1) - direction * options.before


def slid(state: FrameState, index: int, direction: int, shot: range, *, whole: bool = False) -> FrameState:
    """The state whose edges "slide", with the bars of shutters that reach beyond the ends of `shot` moved back into it,
    each shutter's by no more frames than it has to; one that is longer than the shot covers it, and goes beyond.

    whole: the window moves even if no bars do, as trails may become as long as it is. Else it moves with them, as it
    has no room for all otherwise"""
    options = state.options
    first, last_filmed = origin(options, index, direction), (shot.stop - 1) // options.step * options.step
    ends = shot.start, last_filmed + options.step - 1  # a filmed frame lasts until the next one
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
    """A span of the window's frames with all of the filmed ones that it is in: bars move by whole ones."""
    start, stop = span
    return start - start % options.step, min(stop + -stop % options.step, options.window)


def source_frames(options: Options, positions: np.ndarray, shot: range) -> np.ndarray:
    """The frames that are seen at `positions` by a window that shows those of `shot` alone; −1: none.

    shot: range(count) for a whole clip, or the frames between two of its cuts.
    Past its ends "hold" repeats the last frame, as "slide" does where bars are not moved (`slid`); "mirror" plays back
    from it without showing it twice.
    "shorten" leaves frames out, but keeps the nearest when all lie outside.
    """
    first, count = shot.start, len(shot)
    held = np.minimum(np.maximum(positions, first), shot.stop - 1)  # quicker than np.clip for so few
    if options.edges == "mirror" and count > 1:
        folded = np.mod(positions - first, 2 * (count - 1))
        return first + np.where(folded < count, folded, 2 * (count - 1) - folded)
    if options.edges == "shorten" and (positions == held).any():
        return np.where(positions == held, held, -1)
    return held


def indices(options: Options, index: int, shot: range, direction: int = 1) -> np.ndarray:
    """Source frames (L,) of the window around source frame `index`; −1: left out. Arguments as above."""
    return source_frames(options, positions(options, index, direction), shot)
