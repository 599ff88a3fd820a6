"""The splines of a mask as polygons: their outlines, and how far their feathers reach.

Polygons are in units of the picture: x to the right and y up from the lower left corner, both from 0 to 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .mask import MaskSpline

# Points a segment has at least and at most.
_FEWEST, _MOST = 4, 32
# The direction of a spline at a point is that of the way through points so far before and behind it on its segment.
_REACH = 0.05
# The round ends of an open spline that is not filled have a point every two pixels, in these limits.
_CAP_POINTS = 8, 64


def outlines(spline: MaskSpline, width: int, height: int) -> tuple[np.ndarray, np.ndarray] | None:
    """The outline of a spline and that of its feather, (n, 2) float64 each, point by point; None: it covers nothing.

    A feather is a pixel wide at least: that is all there is of anti-aliasing.
    """
    points, weights = np.array(spline.points, np.float64), np.array(spline.weights, np.float64)
    if len(points) < 2:
        return None
    steps = _steps(spline, points, weights, max(width, height))
    segment, u = _positions(spline, len(points), steps)
    edge = _at(spline, points, segment, u)
    if len(edge) < 4:
        return None
    feather = _offset(spline, points, weights, segment, u, edge)
    larger = max(width, height)
    edge, feather = ((p - 0.5) * (larger / width, larger / height) + 0.5 for p in (edge, feather))
    return edge, _pixel_wide(edge, feather, 1 / min(width, height))


def _longest_segment(points: np.ndarray, cyclic: bool) -> float:
    """Of the segments of a spline (n, 3, 2), the length of the longest, along its handles."""
    following = np.roll(points, -1, axis=0)
    hull = np.stack([points[:, 1], points[:, 2], following[:, 0], following[:, 1]], axis=1)
    lengths = np.linalg.norm(np.diff(hull, axis=1), axis=2).sum(axis=1)
    return float(lengths[: None if cyclic else -1].max(initial=0))


def _steps(spline: MaskSpline, points: np.ndarray, weights: np.ndarray, larger: int) -> int:
    """Points that a segment is cut into: one in four pixels of the longest segment, more where its feather changes."""
    longest = _longest_segment(points, spline.cyclic) * larger
    steepest = 0.0
    for weight, feather in zip(weights, spline.feathers, strict=True):
        u, factor = np.array([(0.0, weight), *feather]).T
        apart = np.diff(u) > 1e-7
        steepest = max(steepest, np.abs(np.diff(factor)[apart] / np.diff(u)[apart]).max(initial=0))
    return int(np.clip(min(max(longest, 1), 128) // 1 + steepest / 0.005, 4 * _FEWEST, 4 * _MOST)) // 4


def _positions(spline: MaskSpline, count: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Where on a spline of `count` points its outline's points lie: segment (n,) and u (n,) 0 to 1."""
    segments = count if spline.cyclic else count - 1
    segment, u = np.repeat(np.arange(segments), steps), np.tile(np.arange(steps) / steps, segments)
    return (segment, u) if spline.cyclic else (np.append(segment, segments - 1), np.append(u, 1.0))


def _bezier(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, u: np.ndarray) -> np.ndarray:
    u = u[:, None]
    v = 1 - u
    return v * v * v * a + 3 * u * v * v * b + 3 * u * u * v * c + u * u * u * d


def _at(spline: MaskSpline, points: np.ndarray, segment: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Points (n, 2) of a spline; behind the end of an open one its last point."""
    this, following = points[segment % len(points)], points[(segment + 1) % len(points)]
    inside = _bezier(this[:, 1], this[:, 2], following[:, 0], following[:, 1], u)
    return inside if spline.cyclic else np.where((segment == len(points) - 1)[:, None], points[-1, 1], inside)


def _offset(
    spline: MaskSpline, points: np.ndarray, weights: np.ndarray, segment: np.ndarray, u: np.ndarray, edge: np.ndarray
) -> np.ndarray:
    """The feather's outline (n, 2), at right angles to the spline."""
    before, after = u - _REACH < 0, u + _REACH > 1
    last = _at(spline, points, segment - before, u - _REACH + before)
    following = _at(spline, points, segment + after, u + _REACH - after)
    along = _normalized(edge - last) + _normalized(following - edge)
    if not spline.cyclic:
        start = before & (segment == 0)
        along[start] = (following - points[0, 1])[start]
    return edge + _left_of(along) * _widths(spline, weights, segment, u)[:, None]


def _widths(spline: MaskSpline, weights: np.ndarray, segment: np.ndarray, u: np.ndarray) -> np.ndarray:
    """The feather's width (n,) in mask space, eased or linear between points and feather points."""
    result = np.empty(len(u))
    for index, feather in enumerate(spline.feathers):
        here = segment == index
        at, factor = np.array([(0.0, 1.0), *feather, (1.0, 1.0)]).T
        ends = weights[index], weights[(index + 1) % len(weights)]
        width = factor * (ends[0] * (1 - at) + ends[1] * at)
        first = np.clip(np.searchsorted(at, u[here]) - 1, 0, len(at) - 2)
        gap = at[first + 1] - at[first]
        share = (u[here] - at[first]) / np.where(gap > 0, gap, 1)
        if spline.weight_interpolation == "EASE":
            share = share * share * (3 - 2 * share)
        result[here] = width[first] + (width[first + 1] - width[first]) * share
    return result


def _pixel_wide(edge: np.ndarray, feather: np.ndarray, pixel: float) -> np.ndarray:
    """The feather's outline, a pixel from the edge where it was nearer. The normal is that of the point before, as
    Blender has it."""
    steps = _normalized(np.roll(edge, 1, axis=0) - edge)
    along = _normalized(np.roll(steps, 1, axis=0) + steps)
    narrow = np.sum((feather - edge) ** 2, axis=1) < pixel * pixel
    return np.where(narrow[:, None], edge + np.stack([along[:, 1], -along[:, 0]], axis=1) * pixel, feather)


def feather_quads(spline: MaskSpline, edge: np.ndarray, feather: np.ndarray, width: int, height: int) -> np.ndarray:
    """The feather of a spline as quads (n, 4, 2): two corners on the spline, whose value is 1, and two beyond, of 0."""
    if spline.fill:
        return _between(edge, feather, closed=True)
    other = 2 * edge - feather
    sides = [_between(edge, feather, spline.cyclic), _between(edge, other, spline.cyclic)]
    if spline.cyclic:
        return np.concatenate(sides)
    size = np.array([width, height]) / min(width, height)
    caps = [_cap(edge[0], feather[0], 1.0, size, width, height), _cap(edge[-1], feather[-1], -1.0, size, width, height)]
    return np.concatenate(sides + caps)


def _between(edge: np.ndarray, feather: np.ndarray, closed: bool) -> np.ndarray:
    quads = np.stack([edge, np.roll(edge, -1, axis=0), np.roll(feather, -1, axis=0), feather], axis=1)
    return quads if closed else quads[:-1]


def _cap(centre: np.ndarray, start: np.ndarray, turn: float, size: np.ndarray, width: int, height: int) -> np.ndarray:
    """The half disc (n, 4, 2) at an end of an open spline, from a point of its feather on."""
    pixels = np.linalg.norm(start - centre) * min(width, height)
    count = int(np.clip(pixels // 2, *_CAP_POINTS))
    angle = turn * np.pi * np.arange(count + 1) / count
    x, y = (start - centre) * size
    around = np.stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)], axis=1)
    rim = centre + around / size
    middle = np.broadcast_to(centre, rim[1:].shape)
    return np.stack([middle, middle, rim[:-1], rim[1:]], axis=1)


def _normalized(vectors: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


def _left_of(vectors: np.ndarray) -> np.ndarray:
    """Directions (n, 2) of length 1 at a right angle to vectors, to their left."""
    return _normalized(np.stack([-vectors[:, 1], vectors[:, 0]], axis=1))
