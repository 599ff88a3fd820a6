"""Blender's masks: their data at one frame, and their values for each pixel, as Blender's Mask strip shows them.

Mask space is a square around the picture, as large as the picture's larger side and centered on it: x to the right and
y up, from 0 to 1. Outlines are polygons in fractions of the picture: x to the right and y up from the lower left
corner, from 0 to 1. Arrays have the picture's lowest row first, unless stated otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .. import scanlines
from ..scanlines import ranges

# Limits of a segment's number of points.
_FEWEST, _MOST = 4, 32
# A spline's direction at a point is taken between points this far before and after it on its segment.
_REACH = 0.05
# Pixels that are computed at once: their numbers fit into a processor's cache.
_BLOCK = 1 << 14
# Pixels by which quads overlap, so that rounding opens no seam between them.
_SEAM = 1e-6
# Share 0 to 1 of the way inward through a feather -> value.
_FALLOFFS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "SMOOTH": lambda v: v * v * (3 - 2 * v),
    "SPHERE": lambda v: np.sqrt(2 * v - v * v),
    "ROOT": np.sqrt,
    "INVERSE_SQUARE": lambda v: v * (2 - v),
    "SHARP": np.square,
    "LINEAR": lambda v: v,
}
# Values of the layers below and of this layer -> both. Sums are clamped after each layer.
_BLENDS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "MERGE_ADD": lambda below, v: below + v * (1 - below),
    "MERGE_SUBTRACT": lambda below, v: below - v * below,
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "LIGHTEN": np.maximum,
    "DARKEN": np.minimum,
    "MUL": np.multiply,
    "DIFFERENCE": lambda below, v: np.abs(below - v),
}


@dataclass(frozen=True)
class MaskSpline:
    """A Bézier spline of a mask, in mask space, a square as large as the picture's larger side and centered on it.

    Coordinates are 0 to 1 across that square, y up. All is in tuples, so that a spline is hashable.

    Attributes:
        points: For each point its left handle, itself and its right handle: ((x, y), (x, y), (x, y)).
        weights: For each point the width of the feather (the soft edge) there, in mask space.
        feathers: For each point the feather points ((u, factor), …) on the segment from it to the next point, by
            ascending u: the place on the segment, 0 to 1. The feather's width there is the factor times the width that
            the weights at the segment's ends give by linear interpolation.
        cyclic: Whether the spline is closed: a last segment goes from the last point to the first.
        weight_interpolation: How the feather's width changes between these places: "EASE" (slow at both) or "LINEAR".
    """

    points: tuple[tuple[tuple[float, float], ...], ...]
    weights: tuple[float, ...]
    feathers: tuple[tuple[tuple[float, float], ...], ...]
    cyclic: bool = True
    weight_interpolation: str = "EASE"  # EASE | LINEAR


@dataclass(frozen=True)
class MaskLayer:
    """A layer of a mask: its splines, and how they are filled and blended, with the values of Blender's MaskLayer."""

    splines: tuple[MaskSpline, ...]
    alpha: float = 1.0
    blend: str = "MERGE_ADD"
    invert: bool = False
    falloff: str = "SMOOTH"
    fill_solver: str = "CDT"  # CDT | SWEEP_LINE
    holes: bool = False


@dataclass(frozen=True)
class MaskShape:
    """A mask at one frame: those of its layers that are rendered, the lowest first."""

    layers: tuple[MaskLayer, ...]

    def values(self, width: int, height: int) -> np.ndarray:
        """Return the mask's values for a picture of this size: (height, width) float32, 0 to 1, the top row first."""
        value = np.zeros((height, width), np.float32)
        for layer in self.layers:
            value = _blend(layer, value, _layer_value(layer, width, height))
        return np.ascontiguousarray(value[::-1])


def _blend(layer: MaskLayer, below: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Return a layer's values (h, w) blended with those of the layers below, 0 to 1."""
    alpha = np.float32(layer.alpha)
    if layer.blend != "REPLACE" and alpha != 1:
        value = value * alpha
    if layer.invert:
        value = 1 - value
    both = below + (value - below) * alpha if layer.blend == "REPLACE" else _BLENDS[layer.blend](below, value)
    return np.clip(both, 0, 1, out=both)


def _layer_value(layer: MaskLayer, width: int, height: int) -> np.ndarray:
    """Return the values of one layer, with filled splines and their feathers: (height, width) float32, 0 to 1."""
    value = np.zeros((height, width), np.float32)
    outlined = [_outlines(spline, width, height) for spline in layer.splines if len(spline.points) > 1]
    if not outlined or layer.alpha == 0:
        return value
    _fill(value, [edge for edge, _ in outlined], layer.fill_solver, layer.holes)
    feather(value, np.concatenate([_feather_quads(*both) for both in outlined]), _FALLOFFS[layer.falloff])
    return value


def _outlines(spline: MaskSpline, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a spline and the outer edge of its feather (soft edge) as polygons.

    A feather is at least a pixel wide, which is the only anti-aliasing.

    Args:
        spline: The spline, with at least two points.
        width, height: The picture's size in pixels.

    Returns:
        The spline's polygon and the feather's, (n, 2) float64 each, in fractions of the picture, y up. Points with the
        same index belong together.
    """
    points, weights = np.array(spline.points, np.float64), np.array(spline.weights, np.float64)
    steps = _steps(spline, points, weights, max(width, height))
    segment, u = _positions(spline, len(points), steps)
    edge = _at(spline, points, segment, u)
    feather = _offset(spline, points, weights, segment, u, edge)
    larger = max(width, height)
    edge, feather = ((p - 0.5) * (larger / width, larger / height) + 0.5 for p in (edge, feather))
    return edge, _pixel_wide(edge, feather, 1 / min(width, height))


def _steps(spline: MaskSpline, points: np.ndarray, weights: np.ndarray, larger: int) -> int:
    """Return into how many straight pieces each segment of a spline is divided, the same number for all: 4 to 32.

    It is one for every 4 pixels of the longest segment, and more if feather points change the feather's width quickly.

    Args:
        points: MaskSpline.points as an array (n, 3, 2).
        weights: MaskSpline.weights as an array (n,).
        larger: The picture's larger side in pixels.
    """
    following = np.roll(points, -1, axis=0)
    hull = np.stack([points[:, 1], points[:, 2], following[:, 0], following[:, 1]], axis=1)
    lengths = np.linalg.norm(np.diff(hull, axis=1), axis=2).sum(axis=1)  # of segments, along their handles
    longest = float(lengths[: None if spline.cyclic else -1].max(initial=0)) * larger
    steepest = 0.0
    for weight, feather in zip(weights, spline.feathers, strict=True):
        u, factor = np.array([(0.0, weight), *feather]).T
        apart = np.diff(u) > 1e-7
        steepest = max(steepest, np.abs(np.diff(factor)[apart] / np.diff(u)[apart]).max(initial=0))
    return int(np.clip(min(max(longest, 1), 128) // 1 + steepest / 0.005, 4 * _FEWEST, 4 * _MOST)) // 4


def _positions(spline: MaskSpline, count: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return at which places of a spline the n points of its polygon lie.

    Args:
        count: The number of the spline's own points. Segment i goes from point i to the next one.
        steps: Into how many pieces each segment is divided.

    Returns:
        For each point of the polygon the index of its segment (n,), and its place u (n,) on that, from 0 to 1. Each
        segment has the places 0, 1 / steps, … below 1. An open spline has one more: 1, on the last segment.
    """
    segments = count if spline.cyclic else count - 1
    segment, u = np.repeat(np.arange(segments), steps), np.tile(np.arange(steps) / steps, segments)
    return (segment, u) if spline.cyclic else (np.append(segment, segments - 1), np.append(u, 1.0))


def _at(spline: MaskSpline, points: np.ndarray, segment: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the points of a spline at n places.

    Args:
        points: MaskSpline.points as an array (count, 3, 2).
        segment: For each place the index of its segment (n,). Segment i goes from point i to the next one. For a closed
            spline, indices wrap around; for an open one, segment count − 1 gives the last point.
        u: The place on the segment (n,), 0 to 1.

    Returns:
        The points, (n, 2), in mask space.
    """
    this, following = points[segment % len(points)], points[(segment + 1) % len(points)]
    a, b, c, d = this[:, 1], this[:, 2], following[:, 0], following[:, 1]
    u, v = u[:, None], 1 - u[:, None]
    inside = v * v * v * a + 3 * u * v * v * b + 3 * u * u * v * c + u * u * u * d
    return inside if spline.cyclic else np.where((segment == len(points) - 1)[:, None], points[-1, 1], inside)


def _offset(
    spline: MaskSpline, points: np.ndarray, weights: np.ndarray, segment: np.ndarray, u: np.ndarray, edge: np.ndarray
) -> np.ndarray:
    """Return the feather's outer edge (n, 2): the spline's polygon `edge`, moved outward by the feather's width."""
    before, after = u - _REACH < 0, u + _REACH > 1
    last = _at(spline, points, segment - before, u - _REACH + before)
    following = _at(spline, points, segment + after, u + _REACH - after)
    along = _normalized(edge - last) + _normalized(following - edge)
    if not spline.cyclic:
        start = before & (segment == 0)
        along[start] = (following - points[0, 1])[start]
    left = _normalized(np.stack([-along[:, 1], along[:, 0]], axis=1))
    return edge + left * _widths(spline, weights, segment, u)[:, None]


def _widths(spline: MaskSpline, weights: np.ndarray, segment: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the feather's width at n places of a spline, (n,), in mask space.

    Between the spline's points and feather points the width is interpolated, by MaskSpline.weight_interpolation.

    Args:
        weights: MaskSpline.weights as an array.
        segment: For each place the index of its segment (n,). Segment i goes from point i to the next one.
        u: The place on the segment (n,), 0 to 1.
    """
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
    """Make a feather at least a pixel wide.

    A point of the feather that is nearer than `pixel` to its point of the spline is replaced: by that point, moved by
    `pixel` to the left of the spline's direction, where feathers lie. As in Blender, it is moved along the normal at
    the point before.

    Args:
        edge: The spline's polygon (n, 2), in fractions of the picture, y up.
        feather: The feather's outer edge (n, 2), a point for each point of `edge`.
        pixel: The least distance, in fractions of the picture. It is the same fraction in both directions.

    Returns:
        The new outer edge, (n, 2).
    """
    steps = _normalized(np.roll(edge, 1, axis=0) - edge)
    along = _normalized(np.roll(steps, 1, axis=0) + steps)
    narrow = np.sum((feather - edge) ** 2, axis=1) < pixel * pixel
    return np.where(narrow[:, None], edge + np.stack([along[:, 1], -along[:, 0]], axis=1) * pixel, feather)


def _feather_quads(edge: np.ndarray, feather: np.ndarray) -> np.ndarray:
    """Return the feather of a spline as quads (n, 4, 2): two corners on the spline (value 1), two outside (0)."""
    return np.stack([edge, np.roll(edge, -1, axis=0), np.roll(feather, -1, axis=0), feather], axis=1)


def _normalized(vectors: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


def _fill(value: np.ndarray, polygons: list[np.ndarray], solver: str, holes: bool) -> None:
    """Set the pixels of `value` whose middles are inside polygons to 1, in place. Other pixels stay.

    Args:
        value: The pixels (h, w), the picture's lowest row first.
        polygons: (n, 2) each, in fractions of the picture, y up.
        solver: Used only if `holes` is true. "CDT": a place is inside if the polygons' windings around it do not add up
            to 0. "SWEEP_LINE": it is inside if an odd number of them goes around it (even-odd).
        holes: Whether the polygons are filled together, so that one inside another can make a hole. Otherwise each is
            filled alone, and they add up.
    """
    in_pixels = [polygon * value.shape[::-1] for polygon in polygons]
    for group in [in_pixels] if holes else [[polygon] for polygon in in_pixels]:
        scanlines.fill(value, group, 1, odd=holes and solver == "SWEEP_LINE", seam=_SEAM)


def feather(value: np.ndarray, quads: np.ndarray, falloff: Callable[[np.ndarray], np.ndarray]) -> None:
    """Draw feathers: raise the pixels of `value` that are inside quads, in place.

    A pixel gets the quad's value at its middle if that is higher than its own. The value is 1 between the first two
    corners of a quad, 0 between the last two, and interpolated by mean value coordinates elsewhere.

    Args:
        value: The pixels (h, w), 0 to 1, the picture's lowest row first.
        quads: Corners (n, 4, 2) in fractions of the picture, y up, in order around the quad: two on the spline, two on
            the feather's outer edge.
        falloff: Converts the interpolated values, 0 to 1, to the values of pixels (see _FALLOFFS).
    """
    height, width = value.shape
    flat = value.reshape(-1)
    quad, row, start, stop = _quad_rows(quads, width, height)
    x_of, y_of = np.ascontiguousarray(quads.transpose(2, 1, 0), np.float32)
    last = np.cumsum(stop - start)
    blocks = np.searchsorted(last, np.arange(0, last[-1] if len(last) else 0, _BLOCK))
    for a, b in pairwise(np.unique([*blocks, len(quad)]).tolist()):
        span, x = ranges(start[a:b], stop[a:b])
        pixel = row[a:b][span] * width + x
        bare = np.flatnonzero(flat[pixel] < 1)
        span, x, pixel = span[bare] + a, x[bare], pixel[bare]
        of = quad[span]
        ways_x = np.take(x_of, of, axis=1) - (x.astype(np.float32) + np.float32(0.5)) / np.float32(width)
        ways_y = np.take(y_of, of, axis=1) - (row[span].astype(np.float32) + np.float32(0.5)) / np.float32(height)
        np.maximum.at(flat, pixel, falloff(_nearness(ways_x, ways_y)))


def _quad_rows(quads: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the pixels that quads cover, as m spans: runs of pixels in a row.

    A quad that is not convex is divided into triangles between its first and third corner, as in Blender. So a quad can
    have more than one span in a row.

    Args:
        quads: Corners (n, 4, 2) in fractions of the picture, y up.
        width, height: Of the picture, in pixels.

    Returns:
        Four arrays (m,): for each span the quad's index, the row from the bottom, the first pixel, and one past the
        last pixel.
    """
    sides = np.roll(quads, -1, axis=1) - quads
    following = np.roll(sides, -1, axis=1)
    turns = sides[..., 0] * following[..., 1] - sides[..., 1] * following[..., 0]
    convex = (turns >= 0).all(axis=1) | (turns <= 0).all(axis=1)
    others = np.flatnonzero(~convex)
    parts = np.concatenate([quads[convex], quads[others][:, [0, 1, 2, 2]], quads[others][:, [0, 2, 3, 3]]])
    index = np.concatenate([np.flatnonzero(convex), others, others])
    start, end = (corners.reshape(-1, 2) * (width, height) for corners in (parts, np.roll(parts, -1, axis=1)))
    edge, row, x = scanlines.crossings(start, end, range(height))
    # The span of each part on each row is from the first to the last crossing of its edges.
    place = edge // 4 * height + row
    order = np.argsort(place, kind="stable")
    place, x = place[order], x[order]
    first = np.flatnonzero(np.diff(place, prepend=-1))
    left, right = (extreme.reduceat(x, first) if len(x) else x for extreme in (np.minimum, np.maximum))
    part, row = np.divmod(place[first], height)
    start = np.ceil(np.clip(left - 0.5 - _SEAM, 0, width)).astype(int)
    stop = np.floor(np.clip(right + 0.5 + _SEAM, 0, width)).astype(int)
    some = stop > start
    return index[part[some]], row[some], start[some], stop[some]


def _nearness(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return how near points are to the first two corners of their quads: (n,), from 0 (at the last two) to 1.

    This is the sum of the mean value coordinates of the first two corners; 0.5 where these are undefined.

    Args:
        x, y: (4, n), for each of a quad's four corners the vector's x or y from the point to the corner.
    """
    lengths = np.sqrt(x * x + y * y)
    tangents = []
    for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
        area = x[a] * y[b] - y[a] * x[b]
        far = lengths[a] * lengths[b] - (x[a] * x[b] + y[a] * y[b])
        tangents.append(np.abs(np.divide(far, area, out=np.zeros_like(far), where=area != 0)))
    np.maximum(lengths, np.float32(1e-7), out=lengths)
    near = (tangents[3] + tangents[0]) / lengths[0] + (tangents[0] + tangents[1]) / lengths[1]
    away = (tangents[1] + tangents[2]) / lengths[2] + (tangents[2] + tangents[3]) / lengths[3]
    total = near + away
    return np.divide(near, total, out=np.full_like(near, 0.5), where=total > 0)
