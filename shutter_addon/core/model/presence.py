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
    """Where tracking a subject stopped.

    Attributes:
        frame: The first frame that tracking did not reach: after the last tracked one if it went forward, before if
            backward.
        is_forward: Whether tracking went forward in time.
        is_cut: Whether it stopped because the shot ends there.
    """

    frame: int
    is_forward: bool
    is_cut: bool = False


class Key(NamedTuple):
    """A key of the factor that fades a region's opacity, or the camera's influence, out and in.

    Attributes:
        value: 0 (faded out) or 1 (in full).
        ease: How the value changes from this key to the next one: "linear" or "constant" (it jumps at the next key).
    """

    frame: int
    value: float
    ease: Ease


class Gap(NamedTuple):
    """A span of frames in which the subject was not found.

    Attributes:
        first, last: The first and the last frame of the span; −∞ or ∞ if it has no end on that side.
        hard_first: Whether the span begins at a cut, so that the region disappears at once instead of fading.
        hard_last: Whether the span ends at a cut, so that the region appears at once.
    """

    first: float
    last: float
    hard_first: bool = False
    hard_last: bool = False


def keys(
    seen: Collection[int], stops: Iterable[Stop], kept: Collection[int], fade: int = FADE, beside: int = 0
) -> list[Key]:
    """Return keys, ascending by frame, of a factor that is 0 in the gaps of a track and 1 elsewhere, with fades.

    The value fades to 0 before each gap and back to 1 after it. An end without limit (see Gap) has no fade.

    Args:
        seen: Frames in which the subject was found. A gap lasts from a stop until just before the nearest such frame in
            the direction of tracking. If the stop itself is one, since another track found the subject there, the gap
            is that frame only.
        stops: Where tracking stopped. Without any, there are no gaps and no keys.
        kept: Frames outside the gaps that have the value 1. They shorten fades that would reach beyond them.
        fade: The length of a fade, in frames. Between two gaps it is at most half their distance. At a cut there is a
            jump.
        beside: Frames on each side of a gap that are part of it, too.
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
    """Return the spans in which the subject was not found, ascending. Spans that touch or overlap are merged.

    Args:
        seen: As for `keys`.
        stops: As for `keys`.
        beside: Frames by which a span is longer on each side.
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
    """Return the span without the subject at a stop: from there on if tracking went forward, up to there if backward.

    It ends just before the nearest frame of `seen` in that direction, or has no end (∞ or −∞). If the stop is at a
    frame of `seen`, the span is that frame only.

    Args:
        seen: Frames in which the subject was found.
        stop: Where tracking stopped.
    """
    frame = stop.frame
    if frame in seen:
        return Gap(first=frame, last=frame)
    if stop.is_forward:
        return Gap(first=frame, last=min((s for s in seen if s > frame), default=math.inf) - 1, hard_first=stop.is_cut)
    return Gap(first=max((s for s in seen if s < frame), default=-math.inf) + 1, last=frame, hard_last=stop.is_cut)
