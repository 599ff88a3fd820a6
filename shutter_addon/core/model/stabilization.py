"""How Blender's 2D stabilization lays the picture of a movie clip at each frame, from tracks and settings.

Each track says by how much it is away from where it was at the anchor frame; one that begins later starts from what the
others say there. The picture is shifted back by their weighted mean, and turned and scaled back about the markers'
mean. Where no track has a marker, it is laid as between the frames beside. Places are complex, x + iy in heights of the
picture, y up.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import NamedTuple

from .motions import Similarity

_LEAST_WEIGHT = 0.005  # below it a track is none
# Heights of the picture that are added to a marker's distance from the pivot: near to that it says little of scale.
_BIAS = 0.01


@dataclass(frozen=True)
class Track:
    """markers: places by frame; weight: 0 to 1 at a frame; location, turn: what it is used for"""

    markers: dict[int, complex]
    weight: Callable[[int], float]
    location: bool
    turn: bool

    def frames(self) -> list[int]:
        """Those at which it says something, ascending."""
        return [frame for frame in sorted(self.markers) if self.weight(frame) >= _LEAST_WEIGHT]


class Measured(NamedTuple):
    """How the picture has moved since the anchor frame: shifted; turned in radians and scaled, about a pivot."""

    shift: complex
    pivot: complex = 0j
    angle: float = 0.0
    log_scale: float = 0.0

    def between(self, other: Measured, share: float) -> Measured:
        return Measured._make((1 - share) * here + share * there for here, there in zip(self, other, strict=True))


class Stabilization:
    """turned, scaled: whether the tracks for rotation say that, and scale as well."""

    def __init__(self, tracks: Collection[Track], anchor: int, *, turned: bool, scaled: bool):
        self._turned, self._scaled = turned, scaled
        self._bases: list[tuple[Track, Measured]] = []
        near = [(min(frames, key=lambda f: (abs(f - anchor), f)), t) for t in tracks if (frames := t.frames())]
        location = [track for track in tracks if track.location]
        known = sorted({frame for track in location for frame in track.frames()})
        before = max((frame for frame in known if frame <= anchor), default=known[0] if known else anchor)
        frame, there = anchor, Measured(shift=0, pivot=_mean(location, before) or 0)
        for reference, track in sorted(near, key=lambda each: abs(each[0] - anchor)):
            if reference != frame:
                still = Measured(shift=0, pivot=there.pivot)
                frame, there = reference, self._averaged(reference) or still
            away = track.markers[reference] - there.pivot
            angle, scale = there.angle - cmath.phase(away), there.log_scale - math.log(abs(away) + _BIAS)
            base = Measured(there.shift - track.markers[reference], angle=angle, log_scale=scale)
            self._bases.append((track, base))  # what is added to a track's shift, angle and logarithm of the scale
        self.frames = known  # at which a track for the location has a marker, ascending

    def at(self, frame: int) -> Measured | None:
        """None: there are no tracks for the location."""
        if not self.frames:
            return None
        lower = max((f for f in self.frames if f <= frame), default=self.frames[0])
        upper = min((f for f in self.frames if f >= frame), default=self.frames[-1])
        before, after = self._averaged(lower), self._averaged(upper)
        if lower == upper or before is None or after is None:
            return before or after
        return before.between(after, (frame - lower) / (upper - lower))

    def _averaged(self, frame: int) -> Measured | None:
        """None: no track that is known so far has a marker there."""
        seen = [(t, base, t.weight(frame), t.markers[frame]) for t, base in self._bases if frame in t.markers]
        located = [(weight, place, base.shift + place) for track, base, weight, place in seen if track.location]
        total = sum(weight for weight, *_ in located)
        if total <= _LEAST_WEIGHT:
            return None
        pivot = sum(weight * place for weight, place, _ in located) / total
        shift = sum(weight * offset for weight, _, offset in located) / total
        angle = log_scale = total = 0.0
        for track, base, weight, place in seen if self._turned else ():
            if track.turn and weight > _LEAST_WEIGHT:
                away = place - pivot
                share = weight * -math.expm1(-(abs(away) ** 2))
                total += share
                angle += share * cmath.phase(away * cmath.rect(1, base.angle))
                log_scale += share * (math.log(abs(away) + _BIAS) + base.log_scale)
        if not total:
            return Measured(shift=shift, pivot=pivot)
        return Measured(
            shift=shift, pivot=pivot, angle=angle / total, log_scale=log_scale / total if self._scaled else 0.0
        )


def _mean(tracks: list[Track], frame: int) -> complex | None:
    """The weighted mean of the markers at a frame."""
    seen = [(track.weight(frame), track.markers[frame]) for track in tracks if frame in track.markers]
    total = sum(weight for weight, _ in seen)
    return sum(weight * place for weight, place in seen) / total if total > _LEAST_WEIGHT else None


def laid(
    measured: Measured,
    target: complex,
    target_angle: float,
    target_scale: float,
    *,
    location: float,
    rotation: float,
    scale: float,
) -> Similarity:
    """How the stabilized picture is laid, y up.

    target, target_angle, target_scale: where it is to lie; location, rotation, scale: how much of each is taken back, 0
    to 1"""
    shift = target - location * measured.shift
    angle = target_angle - rotation * measured.angle
    size = (target_scale or 1.0) * math.exp(-scale * measured.log_scale)
    turn = cmath.rect(size, angle)
    return Similarity(turn, shift + measured.pivot - turn * measured.pivot)
