"""Fading of tracked regions: keys of their opacity, or of the camera's influence, where a track ends or has a gap.

The value is 0 where the subject is not found, and 1 where it is. It fades in between, while the subject is still
visible.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from itertools import pairwise
from typing import NamedTuple

from .keyframes import Ease

# Frames over which a region fades.
FADE = 5


class Stop(NamedTuple):
    """Where a track ends.

    Attributes:
        frame: The first frame without the track, in the direction of tracking.
        is_forward: Whether that direction is forward.
        is_cut: Whether the shot ends there.
    """

    frame: int
    is_forward: bool
    is_cut: bool = False


class Key(NamedTuple):
    """A key that fades a region in or out.

    Attributes:
        frame: The frame.
        value: 0 or 1, a factor for the opacity.
        ease: The ease until the next key, as in recipes.
    """

    frame: int
    value: float
    ease: Ease


class Gap(NamedTuple):
    """Frames without the subject.

    Attributes:
        first, last: The first and the last of these frames, or −∞ and ∞.
        hard_first, hard_last: Whether the first, or the last, frame is at a cut, where nothing fades.
    """

    first: float
    last: float
    hard_first: bool = False
    hard_last: bool = False


def keys(
    seen: Collection[int], stops: Iterable[Stop], kept: Collection[int], fade: int = FADE, beside: int = 0
) -> list[Key]:
    """Return keys, ascending, that fade a region out before each gap of its track and in again after it.

    Args:
        seen: Frames where the subject was found. A gap lasts from a stop to the next of these frames. If a stop is at
            such a frame, because another track has found the subject there, the gap is only that frame.
        stops: Where tracks end. Without any, there are no keys.
        kept: Frames that keep the value 1, even next to a gap.
        fade: Frames of a fade. It is shorter between gaps that are close, and a jump at cuts.
        beside: Frames on each side of a gap that have the value 0 as well.
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
    """Return the spans of frames without the subject (gaps), ascending, with adjoining ones merged.

    Arguments as for `keys`.
    """
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
    """Return the frames without the subject that begin where tracking stopped, or end there if it went backward.

    Args:
        seen: Frames where the subject was found. They bound the gap; if tracking stopped at one, the gap is that frame.
        stop: Where tracking stopped.
    """
    frame = stop.frame
    if frame in seen:
        return Gap(first=frame, last=frame)
    if stop.is_forward:
        return Gap(first=frame, last=min((s for s in seen if s > frame), default=math.inf) - 1, hard_first=stop.is_cut)
    return Gap(first=max((s for s in seen if s < frame), default=-math.inf) + 1, last=frame, hard_last=stop.is_cut)
