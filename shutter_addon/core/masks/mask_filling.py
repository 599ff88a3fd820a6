"""Pictures of polygons and of the feathers around them, a value at each pixel's centre.

Polygons are in units of the picture: x to the right and y up from the lower left corner, both from 0 to 1. Pictures
have the lowest row first.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from .. import scanlines
from ..scanlines import ranges

# Pixels that are computed at once: what their numbers take stays in a processor's cache.
_BLOCK = 1 << 14
# By so many pixels quads overlap, so that rounding opens no seam between them.
_SEAM = 1e-6


def fill(value: np.ndarray, polygons: list[np.ndarray], solver: str, holes: bool) -> None:
    """Set the pixels of `value` (h, w) that polygons (n, 2) fill to 1.

    Args:
        holes: Fill what the polygons go around together: by CDT, Blender's solver, the sum of their windings, by
            SWEEP_LINE an odd number of them. Otherwise each polygon is filled by itself.
    """
    in_pixels = [polygon * value.shape[::-1] for polygon in polygons]
    for group in [in_pixels] if holes else [[polygon] for polygon in in_pixels]:
        scanlines.fill(value, group, 1, odd=holes and solver == "SWEEP_LINE", seam=_SEAM)


def feather(value: np.ndarray, quads: np.ndarray, falloff: Callable[[np.ndarray], np.ndarray]) -> None:
    """Raises the pixels of `value` (h, w) that quads (n, 4, 2) cover to theirs: 1 at the first two corners, 0 at the
    last two, between them by mean value coordinates, and `falloff` of all."""
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
    """The pixels that quads (n, 4, 2) cover, row by row: quad, row, first pixel and that behind the last, (m,) each.

    A quad is its two triangles on the sides of the way between its first and its third corner, as in Blender, which
    matters where they are not side by side.
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
    # Each part on each row, from the first to the last place where its edges cross it.
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
    """How near points are to the first two corners of quads: 0 to 1 (n,), by mean value coordinates; x, y (4, n): the
    ways from the points to the corners."""
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
