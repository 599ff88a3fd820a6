"""How much what is tracked counts over time: nothing where its track has ended, all where it is followed, and fading
in between, while it is still where it was seen."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from itertools import pairwise
from typing import NamedTuple

from .keyframes import Ease

# Frames over which a region fades.
FADE = 5


class Stop(NamedTuple):
    """Where a track ended: frame, the first without it in that direction; is_cut: the shot ends there."""

    frame: int
    is_forward: bool
    is_cut: bool = False


class Key(NamedTuple):
    """value: 0 or 1; ease: of the span that it starts, in a recipe's words"""

    frame: int
    value: float
    ease: Ease


class Gap(NamedTuple):
    """Frames at which nothing is there, from the first to the last, perhaps without an end; hard: whether it begins,
    and ends, at a cut."""

    first: float
    last: float
    hard_first: bool = False
    hard_last: bool = False


_NONE_LATER = Gap(first=math.inf, last=math.inf)


def keys(
    seen: Collection[int], stops: Iterable[Stop], kept: Collection[int], fade: int = FADE, beside: int = 0
) -> list[Key]:
    """Keys of how much something counts, ascending; none where its track has no end.

    seen: the frames at which it was found. A gap goes from a stop to the next of them; a stop at one of them, behind
    which it is found by another way, is as long as that frame
    kept: frames at which all of it counts, if only one beside a gap
    fade: frames over which it comes and goes, fewer between gaps that are close; at a cut it does so at once, as a fade
    would show there
    beside: frames on each side of a gap at which it counts for nothing as well"""
    changes: list[Key] = []
    before = -math.inf
    for gap, following in pairwise([*gaps(seen, stops, beside), _NONE_LATER]):
        after = following.first
        if math.isfinite(gap.first):
            kept_before = max((frame for frame in kept if frame < gap.first), default=-math.inf)
            room = min(gap.first - kept_before, max((gap.first - before) // 2, 1))
            length = 1 if gap.hard_first else int(min(fade, room))
            changes.append(Key(int(gap.first) - length, 1.0, "constant" if gap.hard_first else "linear"))
            changes.append(Key(int(gap.first), 0.0, "constant"))
        if math.isfinite(gap.last):
            kept_after = min((frame for frame in kept if frame > gap.last), default=math.inf)
            room = min(kept_after - gap.last, max((after - gap.last) // 2, 1))
            length = 1 if gap.hard_last else int(min(fade, room))
            changes.append(Key(int(gap.last), 0.0, "constant" if gap.hard_last else "linear"))
            changes.append(Key(int(gap.last) + length, 1.0, "constant"))
        before = gap.last
    # Of two at the same frame the later one counts.
    places = {key.frame: place for place, key in enumerate(changes)}
    return [changes[place] for place in sorted(places.values())]


def gaps(seen: Collection[int], stops: Iterable[Stop], beside: int = 0) -> list[Gap]:
    """Where nothing is there, ascending and apart; arguments like those of `keys`."""
    merged: list[Gap] = []
    for each in sorted(_gap(seen, stop) for stop in stops):
        gap = each._replace(first=each.first - beside, last=each.last + beside)
        if merged and gap.first <= merged[-1].last + 1:
            before = merged.pop()
            later = max(before, gap, key=lambda each: each.last)
            gap = before._replace(last=later.last, hard_last=later.hard_last)
        merged.append(gap)
    return merged


def _gap(seen: Collection[int], stop: Stop) -> Gap:
    frame = stop.frame
    if frame in seen:
        return Gap(first=frame, last=frame)
    if stop.is_forward:
        return Gap(first=frame, last=min((s for s in seen if s > frame), default=math.inf) - 1, hard_first=stop.is_cut)
    return Gap(first=max((s for s in seen if s < frame), default=-math.inf) + 1, last=frame, hard_last=stop.is_cut)
