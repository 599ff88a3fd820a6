"""Outlines: closed curves, their coverage of pixels, and chains of curves from frame to frame with a constant number of
points, as splines with shape keys need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .. import scanlines, stopping
from . import scribbles

# Lines per row of pixels on which coverage is exact.
LINES = 8
_CROSSINGS = 1 << 22  # crossings of curves with lines that are computed at once, in about 300 MB of memory
_PULLED = 12  # the fewest points on either side of a curve that is pulled
_NEAR = 0.005  # accuracy of distances to curves, in heights of the picture
ALIKE = 0.1  # the similarity of two curves, 0 to 1, from which on one continues the other
FAR = 2.0  # in sums of radii, as of circles: curves that are farther apart have no similarity
_LINES = 128  # rows of the pictures in which similarity is measured
_STEP, _POINTS = 0.008, (12, 256)  # the distance of points in heights of the picture; limits of their number

Curves = tuple[tuple[tuple[float, float], ...], ...]  # hashable strokes: fractions of the picture, y up
# Inside of a curve: its middle (2,) in heights of the picture, and its coverage (rows, columns), moved to the centre.
_Shape = tuple[np.ndarray, np.ndarray]


def curves(strokes: Sequence[np.ndarray]) -> Curves:
    """Return strokes (n, 2) as tuples."""
    return tuple(tuple((float(x), float(y)) for x, y in stroke) for stroke in strokes)


def coverage(strokes: Sequence, width: int, height: int) -> np.ndarray:
    """Return the share (height, width) float32, 0 to 1, of each pixel that is inside closed curves, the top row first.

    Where two curves overlap is outside (even-odd).

    Args:
        strokes: (n, 2) in fractions of the picture, y up.
    """
    rows, bands = max(_CROSSINGS // (LINES * max(sum(map(len, strokes)), 1)), 1), []
    for top in range(0, height, rows):
        stopping.check()
        bands.append(_covered(strokes, width, height, range(top, min(top + rows, height))))
    return np.concatenate(bands)


def _covered(strokes: Sequence, width: int, height: int, band: range) -> np.ndarray:
    """Return the coverage of a band of rows."""
    lines, scale = range(band.start * LINES, band.stop * LINES), (width, -height * LINES)
    curves = [np.asarray(stroke, np.float64) * scale + (0, height * LINES) for stroke in strokes if len(stroke) > 2]
    _, rows, places = scanlines.crossings(*scanlines.edges(curves), lines)
    rows -= lines.start
    order = np.lexsort((places, rows))
    rows, places = rows[order], np.clip(places[order], 0, width)
    rank = np.arange(len(rows)) - np.searchsorted(rows, rows)
    signs = np.where(rank % 2 == 0, 1.0, -1.0) / LINES
    columns = np.minimum(places.astype(np.intp), width - 1)
    beyond = places - columns  # the share of the pixel before the crossing
    changes = np.zeros((len(band), width + 1))
    np.add.at(changes, (rows // LINES, columns), signs * (1 - beyond))
    np.add.at(changes, (rows // LINES, columns + 1), signs * beyond)
    return np.clip(np.cumsum(changes[:, :-1], axis=1), 0, 1).astype(np.float32)


def nearest(shapes: Curves, point: tuple[float, float], aspect: float) -> tuple[int, float]:
    """Return the index of the curve that is nearest to a point, and its distance in heights of the picture.

    Args:
        aspect: The picture's width / height.

    Raises:
        ValueError: There is no curve.
    """
    apart = [_apart(_finer(shape, aspect, _NEAR)[0], point, aspect).min() for shape in shapes]
    index = int(np.argmin(apart))
    return index, float(apart[index])


def dragged(
    shapes: Curves, index: int, grabbed: tuple[float, float], by: tuple[float, float], reach: float, aspect: float
) -> Curves:
    """Return curves after pulling one of them.

    The curve's nearest place to `grabbed` moves `by` as much, and its neighbourhood less and less, up to `reach`.

    Args:
        index: Of the pulled curve.
        grabbed, by: Fractions of the picture, y up.
        reach: Heights of the picture, along the curve.
    """
    points, own = _finer(shapes[index], aspect, reach / _PULLED)
    start = int(_apart(points, grabbed, aspect).argmin())
    points, own = np.roll(points, -start, axis=0), np.roll(own, -start)
    steps = np.hypot(*(np.diff(points, axis=0, append=points[:1]) * (aspect, 1)).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    way = np.minimum(along[:-1], along[-1] - along[:-1])  # from the start, in the shorter direction
    share = np.square(1 - np.minimum(way / reach, 1) ** 2)
    moved = (points + share[:, None] * by)[own | (share > 0)]
    return tuple(curves([moved])[0] if i == index else shape for i, shape in enumerate(shapes))


def _finer(shape: Sequence, aspect: float, most: float) -> tuple[np.ndarray, np.ndarray]:
    """Add points to a closed curve: return points (n, 2), at most `most` heights apart, and which (n,) are original."""
    points = np.asarray(shape, dtype=np.float64)
    ends = np.roll(points, -1, axis=0)
    counts = np.ceil(np.hypot(*((ends - points) * (aspect, 1)).T) / most).astype(int).clip(1)
    share = np.concatenate([np.arange(count) / count for count in counts])
    finer = np.repeat(points, counts, axis=0) * (1 - share[:, None]) + np.repeat(ends, counts, axis=0) * share[:, None]
    return finer, share == 0


def _apart(points: np.ndarray, point: tuple[float, float], aspect: float) -> np.ndarray:
    """Return the distances of points (n, 2) from another one, in heights of the picture."""
    return np.hypot(*((points - point) * (aspect, 1)).T)


class Chain(NamedTuple):
    """A curve that continues from frame to frame.

    Attributes:
        frames: Ascending.
        points: (frames, points, 2) float64, fractions of the picture, y up.
        gone: The first frame without the curve; None: it stays.
    """

    frames: tuple[int, ...]
    points: np.ndarray
    gone: int | None


def chains(drawn: Sequence[tuple[int, Curves]], aspect: float) -> list[Chain]:
    """Return chains of the curves of ascending frames: a curve continues as the most similar one of the next frame.

    Args:
        aspect: The picture's width / height.
    """
    open_ones: list[list[tuple[int, np.ndarray]]] = []
    found: list[tuple[list[tuple[int, np.ndarray]], int | None]] = []
    for frame, curves in drawn:
        shapes = [_turned(np.asarray(curve, np.float64)) for curve in curves if len(curve) > 2]
        pairs = _pairs([chain[-1][1] for chain in open_ones], shapes, aspect)
        found += [(chain, frame) for index, chain in enumerate(open_ones) if index not in pairs]
        going = [[*open_ones[index], (frame, shapes[to])] for index, to in pairs.items()]
        new = set(range(len(shapes))) - set(pairs.values())
        open_ones = going + [[(frame, shapes[index])] for index in sorted(new)]
    return [_chain(curves, gone, aspect) for curves, gone in (*found, *((chain, None) for chain in open_ones))]


def _pairs(before: list[np.ndarray], after: list[np.ndarray], aspect: float) -> dict[int, int]:
    """Pair similar curves, the most similar ones first; return indices by indices."""
    shapes = [[_shape(curve, aspect) for curve in curves] for curves in (before, after)]
    alike = {(i, j): _alike(a, b) for i, a in enumerate(shapes[0]) for j, b in enumerate(shapes[1])}
    pairs: dict[int, int] = {}
    for (i, j), share in sorted(alike.items(), key=lambda entry: -entry[1]):
        if share >= ALIKE and i not in pairs and j not in pairs.values():
            pairs[i] = j
    return pairs


def _shape(curve: np.ndarray, aspect: float) -> _Shape:
    middle = (curve.min(axis=0) + curve.max(axis=0)) / 2
    inside = coverage([curve - middle + 0.5], max(1, round(_LINES * aspect)), _LINES)
    return middle * (aspect, 1), inside


def _alike(one: _Shape, other: _Shape) -> float:
    """Return the similarity of two shapes, 0 to 1, in area and place."""
    (middle, inside), (other_middle, other_inside) = one, other
    reach = sum(np.sqrt(each.sum() / np.pi) / _LINES for each in (inside, other_inside)) * FAR
    if reach == 0:
        return 0.0
    common = np.minimum(inside, other_inside).sum() / np.maximum(inside, other_inside).sum()
    return float(common * max(0.0, 1 - np.hypot(*(middle - other_middle)) / reach))


def _turned(curve: np.ndarray) -> np.ndarray:
    """Return the curve in counter-clockwise order."""
    x, y = curve.T
    return curve if np.dot(x, np.roll(y, -1)) >= np.dot(y, np.roll(x, -1)) else curve[::-1]


def _chain(curves: list[tuple[int, np.ndarray]], gone: int | None, aspect: float) -> Chain:
    closed = [np.concatenate([curve, curve[:1]]) for _frame, curve in curves]
    longest = max(np.hypot(*(np.diff(curve, axis=0) * (aspect, 1)).T).sum() for curve in closed)
    count = int(np.clip(np.ceil(longest / _STEP), *_POINTS))
    points = [scribbles.resample(curve, count + 1, aspect)[:-1] for curve in closed]
    for before, index in enumerate(range(1, len(points))):
        points[index] = _aligned(points[before], points[index], aspect)
    return Chain(tuple(frame for frame, _curve in curves), np.stack(points), gone)


def _aligned(before: np.ndarray, curve: np.ndarray, aspect: float) -> np.ndarray:
    """Rotate the order of a curve's points so that each is near that of the curve before."""
    fixed, moved = ((points - points.mean(axis=0)) * (aspect, 1) for points in (before, curve))
    alike = sum(np.fft.irfft(np.conj(np.fft.rfft(fixed[:, k])) * np.fft.rfft(moved[:, k]), len(curve)) for k in (0, 1))
    return np.roll(curve, -int(np.argmax(alike)), axis=0)
