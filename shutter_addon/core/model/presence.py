"""Fading of tracked regions: keys that are 0 where a track has ended, 1 where it is followed, and fade in between, at
frames where the region is still visible."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from itertools import pairwise
from typing import NamedTuple

from .keyframes import Ease

# Frames over which a region fades.
FADE = 5


class Stop(NamedTuple):
    """The end of a track: the first frame without it in that direction, and whether the shot ends there."""

    frame: int
    is_forward: bool
    is_cut: bool = False


class Key(NamedTuple):
    """A key: value 0 or 1, and the ease until the next key, as in recipes."""

    frame: int
    value: float
    ease: Ease


class Gap(NamedTuple):
    """Frames without the subject, first to last, possibly infinite; hard: whether an end is at a cut."""

    first: float
    last: float
    hard_first: bool = False
    hard_last: bool = False


def keys(
    seen: Collection[int], stops: Iterable[Stop], kept: Collection[int], fade: int = FADE, beside: int = 0
) -> list[Key]:
    """Return keys, ascending, of how much a subject counts; none if its track has no end.

    Args:
        seen: Frames where the subject was found. A gap lasts from a stop to the next of them. A stop at one of them, as
            other tracks have found it, is only that frame.
        kept: Frames that keep the value 1, even next to a gap.
        fade: Frames of a fade, fewer between close gaps. At cuts the value jumps.
        beside: Frames on each side of a gap with the value 0, too.
    """
    changes: list[Key] = []
    before = -math.inf
    for gap, following in pairwise([*gaps(seen, stops, beside), Gap(first=math.inf, last=math.inf)]):
        for edge, way, is_hard, other in (
            (gap.first, -1, gap.hard_first, before),
            (gap.last, 1, gap.hard_last, following.first),
        ):
            if math.isfinite(edge):
                kept_beyond = min(
                    (way * (frame - edge) for frame in kept if way * (frame - edge) > 0), default=math.inf
                )
                room = min(kept_beyond, max(way * (other - edge) // 2, 1))
                length = 1 if is_hard else int(min(fade, room))
                first, second = sorted([(int(edge), 0.0), (int(edge) + way * length, 1.0)])
                changes += [Key(*first, "constant" if is_hard else "linear"), Key(*second, "constant")]
        before = gap.last
    # The later of two keys at the same frame counts.
    places = {key.frame: place for place, key in enumerate(changes)}
    return [changes[place] for place in sorted(places.values())]


def gaps(seen: Collection[int], stops: Iterable[Stop], beside: int = 0) -> list[Gap]:
    """Return gaps, ascending and separate, for arguments as in `keys`."""
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
