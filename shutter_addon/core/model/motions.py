"""Motions of regions and of the picture, and the keys that describe them."""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, TypeVar

import numpy as np

# Directions in which a shape's farthest points are searched: any other point is at most 1/2 % farther.
_DIRECTIONS = np.exp(1j * np.linspace(0, 2 * np.pi, 32, endpoint=False))

# What counts of a motion: its location, also its rotation, or also its scale.
Motion = Literal["location", "rotation", "scale"]

Size = tuple[int, int]  # width and height of a picture in pixels
Points = TypeVar("Points", complex, np.ndarray)

# The offset from a pixel's corner to its middle.
_CORNER = 0.5 + 0.5j


@dataclass(frozen=True)
class Placement:
    """How the keys of a region or of the camera move it at a frame, about its center (see scribbles.transform).

    Attributes:
        location: By how much it is shifted: x as a fraction of the picture's width, y of its height, y up.
        rotation: Degrees counter-clockwise.
        scale: A factor.
    """

    location: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: float = 1.0


Placements = Mapping[int, Placement]  # by frame


@dataclass(frozen=True)
class Similarity:
    """A motion of the picture that turns, scales and shifts it: a point z moves to turn · z + shift.

    Points are complex numbers z = x + iy in pixels, y down. Whole numbers are the middles of pixels.

    Attributes:
        turn: Rotation and scale: the angle of this number is the rotation (clockwise in the picture, as y is down), its
            absolute value the scale.
        shift: The shift in pixels, dx + i·dy.
    """

    turn: complex = 1 + 0j
    shift: complex = 0j

    def __call__(self, points: Points) -> Points:
        """Move points, complex numbers x + iy in pixels, and return where they go."""
        return self.turn * points + self.shift

    def after(self, first: Similarity) -> Similarity:
        """Return the motion that applies `first` and then this one."""
        return Similarity(self.turn * first.turn, self(first.shift))

    def inverse(self) -> Similarity:
        """Return the opposite motion, which takes moved points back to where they were."""
        return Similarity(1 / self.turn, -self.shift / self.turn)


def centre(strokes: Iterable) -> np.ndarray:
    """Return the center (2,) of the bounding box of all strokes, about which they scale and turn."""
    points = _points(strokes)
    return (points.min(axis=0) + points.max(axis=0)) / 2


# The corners of the picture, as fractions.
PICTURE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


def corners(strokes: Iterable) -> np.ndarray:
    """Return the corners (4, 2) of the bounding box of all strokes, counter-clockwise from the lower left one."""
    points = _points(strokes)
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    return np.array([(left, bottom), (right, bottom), (right, top), (left, top)])


def offsets(strokes: Iterable) -> np.ndarray:
    """Return all points (n, 2) of strokes relative to the strokes' common center, in fractions of the picture."""
    return _points(strokes) - centre(strokes)


def _points(strokes: Iterable) -> np.ndarray:
    """Return the points (n, 2) of all strokes in one array."""
    return np.concatenate([np.asarray(stroke, dtype=np.float64) for stroke in strokes])


def pixel(place: Sequence[float] | np.ndarray, size: Size) -> complex:
    """Convert a place in fractions of the picture (x, y up) to pixels x + iy (y down), as in Similarity."""
    return complex(place[0] * size[0], (1 - place[1]) * size[1]) - _CORNER


def fractions(pixel: complex, size: Size) -> tuple[float, float]:
    """Convert a place in pixels x + iy (y down), as in Similarity, to fractions of the picture (x, y up)."""
    corner = pixel + _CORNER
    return corner.real / size[0], 1 - corner.imag / size[1]


def carried(placement: Placement, motion: Similarity, before: np.ndarray, after: np.ndarray, size: Size) -> Placement:
    """Return a region's placement after a motion of the picture (such as a tracked one) with which it moves.

    Args:
        placement: The region's placement at the motion's start.
        motion: The motion of the picture from its start to its end.
        before, after: Centers (2,) of what is drawn of the region, before any placement, at the motion's start and end,
            in fractions of the picture. They differ if the drawing changes.
        size: Width and height of the picture, in pixels, in which the motion is measured.
    """
    x, y = fractions(motion(pixel(np.add(before, placement.location), size)), size)
    location = x - float(after[0]), y - float(after[1])
    rotation = placement.rotation - math.degrees(cmath.phase(motion.turn))
    return Placement(location, rotation, placement.scale * abs(motion.turn))


def motion_between(
    first: Placement, second: Placement, before: np.ndarray, after: np.ndarray, size: Size
) -> Similarity:
    """Return the motion of the picture with which `carried` takes a shape from one placement to another.

    Args:
        first, second: The shape's placements at the motion's start and end.
        before, after: Centers (2,) of what is drawn, before any placement, at the motion's start and end, in fractions
            of the picture.
        size: Width and height of the picture, in pixels.
    """
    angle = math.radians(first.rotation - second.rotation)
    turn = cmath.rect(second.scale / first.scale, angle)
    start, end = (pixel(np.add(*each), size) for each in ((before, first.location), (after, second.location)))
    return Similarity(turn, end - turn * start)


def unwound(placement: Placement, near: Placement) -> Placement:
    """Return the placement with full turns added to its rotation until it is within half a turn of `near`'s rotation.

    Otherwise linear keys between the two placements would spin.
    """
    turns = round((near.rotation - placement.rotation) / 360)
    return replace(placement, rotation=placement.rotation + 360 * turns)


def between(first: Placement, second: Placement, share: float) -> Placement:
    """Interpolate two placements linearly at a share 0 to 1 of the way, each number by itself."""
    numbers = (1 - share) * as_array([first]) + share * as_array([second])
    return _placement(numbers[0])


def only(placement: Placement, motion: Motion) -> Placement:
    """Reduce a placement to what counts for a motion: location; location and rotation; or these and scale."""
    rotation = 0.0 if motion == "location" else placement.rotation
    return Placement(placement.location, rotation, placement.scale if motion == "scale" else 1.0)


def averaged(placements: Sequence[Placement], weights: np.ndarray) -> Placement:
    """Return the mean of n placements, each number by itself, with weights (n,) whose sum is 1."""
    return _placement(weights @ as_array(placements))


def thinned(
    placements: Placements, points: np.ndarray, size: Size, kept: Collection[float] = (), tolerance: float = 1.0
) -> list[int]:
    """Return the frames, ascending, at which a shape's motion needs keys, so that it has few.

    With placements interpolated linearly between keys, no point of the shape is off by more than the tolerance. A span
    that is too far off gets a key at its worst frame (Ramer, Douglas, Peucker). The first and last frame are always
    keys.

    Args:
        placements: The shape's placement at each frame.
        points: Points (n, 2) of the shape relative to its center, in fractions of the picture, from `offsets`.
        size: Width and height of the picture, in pixels.
        kept: Frames that must be keys; those without a placement do not count.
        tolerance: The largest error, in pixels.
    """
    frames = sorted(placements)
    if len(frames) < 3:
        return frames
    numbers = as_array([placements[frame] for frame in frames])
    scaled = np.asarray(points, dtype=np.float64) * size
    far = scaled[:, 0] + 1j * scaled[:, 1]
    if len(far) > len(_DIRECTIONS):  # no point moves more than those that are farthest in some direction
        far = far[np.unique((far[:, None] * _DIRECTIONS.conj()).real.argmax(axis=0))]
    ends = [i for i, frame in enumerate(frames) if frame in kept or i in (0, len(frames) - 1)]
    chosen, spans = set(ends), list(pairwise(ends))
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        off = _distances(np.array(frames[first : last + 1]), numbers[first : last + 1], far, size)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            middle = first + worst
            chosen.add(middle)
            spans += [(first, middle), (middle, last)]
    return [frames[i] for i in sorted(chosen)]


def as_array(placements: Sequence[Placement]) -> np.ndarray:
    """Return placements as an array (n, 4): location x and y, rotation, scale."""
    return np.array([(*p.location, p.rotation, p.scale) for p in placements], dtype=np.float64)


def _placement(numbers: np.ndarray) -> Placement:
    """Return the placement for numbers (4,) as from `as_array`."""
    x, y, rotation, scale = numbers.tolist()
    return Placement((x, y), rotation, scale)


def _distances(frames: np.ndarray, numbers: np.ndarray, points: np.ndarray, size: Size) -> np.ndarray:
    """Return the error at each frame if a shape's placements are interpolated from the first and last one.

    Args:
        frames: The frames (f,), ascending, at least 2.
        numbers: The true placements (f, 4) at these frames, as from `as_array`.
        points: The shape's points, complex numbers x + iy in pixels relative to its center, y up, unlike Similarity.
        size: Width and height of the picture, in pixels.

    Returns:
        The distance, in pixels, between the true and the interpolated place of the point that is farthest off: (f,).
    """
    share = ((frames - frames[0]) / (frames[-1] - frames[0]))[:, None]
    straight = (1 - share) * numbers[0] + share * numbers[-1]
    (x, y), (turn, other) = ((numbers - straight)[:, :2] * size).T, (_turns(numbers), _turns(straight))
    return np.abs((turn - other)[:, None] * points + (x + 1j * y)[:, None]).max(axis=1)


def _turns(numbers: np.ndarray) -> np.ndarray:
    """Return the rotation and scale of placements (n, 4) as complex factors (n,)."""
    return numbers[:, 3] * np.exp(1j * np.radians(numbers[:, 2]))
