"""Pictures of polygons and of the feathers around them, a value at each pixel's centre.

Polygons are in units of the picture: x to the right and y up from the lower left corner, both from 0 to 1. Pictures
have the lowest row first.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .mask_outlines import crossings

# Pixels that are computed at once: what their numbers take stays in a processor's cache.
_BLOCK = 1 << 15


def fill(value: np.ndarray, polygons: list[np.ndarray], solver: str, holes: bool, overlap: bool) -> None:
    """Sets the pixels of `value` (h, w) that polygons (n, 2) fill to 1, by the rules of Blender's solvers.

    CDT fills what the polygons together go around, by their winding number, and without `holes` also what they enclose.
    SWEEP_LINE fills what lies inside an odd number of polygons, or without `holes` of any by itself; with `overlap`
    each is first cut down to its outer loops.
    """
    if solver == "CDT":
        _fill_together(value, polygons, lambda winding: winding != 0, not holes)
        return
    if overlap:
        polygons = [loop for polygon in polygons for loop in _outer_loops(polygon)]
    for group in [polygons] if holes else [[polygon] for polygon in polygons]:
        _fill_together(value, group, lambda winding: winding % 2 != 0, False)


def _fill_together(value: np.ndarray, polygons: list[np.ndarray], rule, enclosed: bool) -> None:
    height, width = value.shape
    rows = (-height, 2 * height) if enclosed else (0, height)
    row, left, right, winding = _spans(polygons, height, rows)
    inside = rule(winding)
    if enclosed:
        inside[~inside] = _enclosed(row, left, right, ~inside)
    inside &= (row >= 0) & (row < height)
    start = np.ceil(np.clip(left * width - 0.5, 0, width)).astype(int)
    stop = np.floor(np.clip(right * width + 0.5, 0, width)).astype(int)
    for y, a, b in zip(row[inside].tolist(), start[inside].tolist(), stop[inside].tolist(), strict=True):
        value[y, a:b] = 1


def _spans(polygons: list[np.ndarray], height: int, rows: tuple[int, int]):
    """Along the middle of each row of pixels, what lies between two edges that follow each other: row, left, right and
    winding number (n,) each, in order."""
    none = np.zeros((0, 2))
    start = np.concatenate([none, *polygons])
    end = np.concatenate([none, *(np.roll(p, -1, axis=0) for p in polygons)])
    edge, row, x = _at_rows(start, end, height, rows)
    order = np.lexsort((x, row))
    row, x = row[order], x[order]
    winding = np.cumsum(np.where(end[:, 1] > start[:, 1], 1, -1)[edge[order]])
    same = row[1:] == row[:-1]
    return row[:-1][same], x[:-1][same], x[1:][same], winding[:-1][same]


def _at_rows(start: np.ndarray, end: np.ndarray, height: int, rows: tuple[int, int]):
    """Where edges (n, 2) cross the middles of the rows from the first to before the last: index of edge, row, x."""
    lowest, highest = np.minimum(start[:, 1], end[:, 1]), np.maximum(start[:, 1], end[:, 1])
    first, last = (np.clip(np.ceil(y * height - 0.5), *rows).astype(int) for y in (lowest, highest))
    edge, row = _ranges(first, last)
    share = ((row + 0.5) / height - start[edge, 1]) / (end[edge, 1] - start[edge, 1])
    return edge, row, start[edge, 0] + (end[edge, 0] - start[edge, 0]) * share


def _ranges(first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All whole numbers from first to before last (n,): the index of the range each is of, and the number."""
    counts = np.maximum(last - first, 0)
    index = np.repeat(np.arange(len(counts)), counts)
    return index, np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts - first, counts)


def _enclosed(row, left, right, empty) -> np.ndarray:
    """Which of the empty spans the others shut in: no way leads outside from them, up, down or along a row."""
    rows = dict.fromkeys(range(row.min(initial=0) - 1, row.max(initial=0) + 2), ((-np.inf, np.inf, None),))
    for y in np.unique(row).tolist():
        here = row == y
        rows[y] = ((-np.inf, left[here][0], None), (right[here][-1], np.inf, None))
    places = np.flatnonzero(empty).tolist()
    for index, place in enumerate(places):
        rows[int(row[place])] += ((left[place], right[place], index),)
    shut = np.ones(len(places), bool)
    reached = [(y, span) for y, spans in rows.items() for span in spans if span[2] is None] if places else []
    while reached:
        y, (a, b, _) = reached.pop()
        for beside in (y - 1, y + 1):
            for span in rows.get(beside, ()):
                if span[2] is not None and shut[span[2]] and span[0] < b and a < span[1]:
                    shut[span[2]] = False
                    reached.append((beside, span))
    return shut


def _outer_loops(polygon: np.ndarray) -> list[np.ndarray]:
    """The loops of a polygon that crosses itself: its way, from the leftmost point on, without every second part
    between two crossings."""
    first, second, at, other = crossings(polygon, np.roll(polygon, -1, axis=0))
    if not len(first):
        return [polygon]
    count, meetings = len(polygon), np.arange(len(first))
    place = np.concatenate([np.arange(count), first + at, second + other])
    corner = np.concatenate([np.arange(count), count + meetings, count + meetings])
    start = place - (np.argmin(polygon[:, 0]) - 1)
    way = corner[np.lexsort((corner, np.where(start < 0, start + count, start)))].tolist()
    following, inside = {}, False
    for here, there in pairwise([*way, way[0]]):
        inside ^= here >= count
        if not inside:
            following[here] = there
    points = np.concatenate([polygon, polygon[first] + (np.roll(polygon, -1, axis=0) - polygon)[first] * at[:, None]])
    loops = []
    while following:
        loop = [next(iter(following))]
        while (there := following.pop(loop[-1], None)) is not None:
            loop.append(there)
        loops.append(points[loop])
    return loops


def feather(value: np.ndarray, quads: np.ndarray, falloff) -> None:
    """Raises the pixels of `value` (h, w) that quads (n, 4, 2) cover to theirs: 1 at the first two corners, 0 at the
    last two, between them by mean value coordinates, and `falloff` of all."""
    height, width = value.shape
    flat = value.reshape(-1)
    quad, row, start, stop = _triangle_rows(quads, width, height)
    bounds = np.searchsorted(np.cumsum(np.maximum(stop - start, 0)), np.arange(0, len(quad) and flat.size * 64, _BLOCK))
    for a, b in pairwise(np.unique([*bounds, len(quad)]).tolist()):
        span, x = _ranges(start[a:b], stop[a:b])
        y, of = row[a:b][span], quad[a:b][span]
        pixel = y * width + x
        open_ = flat[pixel] < 1
        x, y, of, pixel = x[open_], y[open_], of[open_], pixel[open_]
        corners = quads[of].astype(np.float32)
        at = np.stack([(x + 0.5) / width, (y + 0.5) / height], axis=-1).astype(np.float32)
        np.maximum.at(flat, pixel, falloff(_nearness(corners, at)))


def _triangle_rows(quads: np.ndarray, width: int, height: int):
    """The pixels that quads (n, 4, 2) cover, row by row: quad, row, first pixel and that behind the last, (m,) each."""
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    start, end = triangles.reshape(-1, 2), np.roll(triangles, -1, axis=1).reshape(-1, 2)
    edge, row, x = _at_rows(start, end, height, (0, height))
    # A row that crosses a triangle crosses two of its edges.
    order = np.lexsort((x, row, edge // 3))
    triangle, row, x = (edge // 3)[order], row[order], np.clip(x[order] * width, -1, width + 1)
    left, right = x[::2], x[1::2]
    first, stop = np.ceil(left - 0.5).astype(int), np.floor(right + 0.5).astype(int)
    return triangle[::2] % max(len(quads), 1), row[::2], np.maximum(first, 0), np.minimum(stop, width)


def _nearness(corners: np.ndarray, at: np.ndarray) -> np.ndarray:
    """How near points (n, 2) in quads (n, 4, 2) are to their first two corners: 0 to 1 (n,), by mean value
    coordinates."""
    x, y = corners[..., 0].T - at[:, 0], corners[..., 1].T - at[:, 1]
    lengths = np.sqrt(x * x + y * y)
    after = [1, 2, 3, 0]
    area = x * y[after] - y * x[after]
    far = lengths * lengths[after] - (x * x[after] + y * y[after])
    tangents = np.divide(np.abs(far), np.abs(area), out=np.zeros_like(far), where=area != 0)
    weights = (tangents + tangents[[3, 0, 1, 2]]) / np.maximum(lengths, np.float32(1e-7))
    near, total = weights[0] + weights[1], weights.sum(axis=0)
    return np.divide(near, total, out=np.full_like(near, 0.5), where=total > 0)
