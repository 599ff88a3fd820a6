"""Outlines: closed curves, the pixels inside them, and which curves of two drawings belong together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from .. import scanlines, stopping
from . import scribbles

# Lines per row of pixels on which coverage is exact.
LINES = 8
_CROSSINGS = 1 << 22  # crossings of curves with lines that are computed at once, in about 300 MB of memory
_NEAR = 0.005  # accuracy of distances to curves, in heights of the picture
_ALIKE = 2.0  # sizes of a curve by which it may move or grow from drawing to drawing
_POINTS = 256  # of a curve that is paired with others

Curves = tuple[tuple[tuple[float, float], ...], ...]  # hashable strokes: fractions of the picture, y up


def curves(strokes: Sequence[np.ndarray]) -> Curves:
    """Convert strokes, arrays (n, 2), to tuples, which are hashable."""
    return tuple(tuple((float(x), float(y)) for x, y in stroke) for stroke in strokes)


def coverage(strokes: Sequence, width: int, height: int) -> np.ndarray:
    """Return the share of each pixel that is inside closed curves: (height, width) float32, 0 to 1, the top row first.

    A place inside two overlapping curves is outside (even-odd).

    Args:
        strokes: The curves, (n, 2) in fractions of the picture, y up.
        width, height: Of the picture, in pixels.
    """
    rows, bands = max(_CROSSINGS // (LINES * max(sum(map(len, strokes)), 1)), 1), []
    for top in range(0, height, rows):
        stopping.check()
        bands.append(_covered(strokes, width, height, range(top, min(top + rows, height))))
    return np.concatenate(bands)


def _covered(strokes: Sequence, width: int, height: int, band: range) -> np.ndarray:
    """Return the rows `band` of what `coverage` returns."""
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
    """Return the index of the curve that is nearest to a point, and the distance to it in heights of the picture.

    Distances are accurate to _NEAR.

    Args:
        shapes: The closed curves.
        point: In fractions of the picture, y up.
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
    """Return the curves after one of them has been pulled by hand.

    The point of the curve that is nearest to `grabbed` moves by the vector `by`. Points farther along the curve move
    less, and from the distance `reach` on not at all. The pulled part of the curve gets more points; the other curves
    stay.

    Args:
        shapes: The closed curves.
        index: The index of the pulled curve.
        grabbed: The place that was grabbed, in fractions of the picture, y up.
        by: The movement, in fractions of the picture, y up.
        reach: How far the pull acts, along the curve in both directions, in heights of the picture.
        aspect: The picture's width / height.
    """
    points, own = _finer(shapes[index], aspect, reach / 12)  # at least 12 points on either side are pulled
    start = int(_apart(points, grabbed, aspect).argmin())
    points, own = np.roll(points, -start, axis=0), np.roll(own, -start)
    steps = np.hypot(*(np.diff(points, axis=0, append=points[:1]) * (aspect, 1)).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    way = np.minimum(along[:-1], along[-1] - along[:-1])  # from the start, in the shorter direction
    share = np.square(1 - np.minimum(way / reach, 1) ** 2)
    moved = (points + share[:, None] * by)[own | (share > 0)]
    return tuple(curves([moved])[0] if i == index else shape for i, shape in enumerate(shapes))


def _finer(shape: Sequence, aspect: float, most: float) -> tuple[np.ndarray, np.ndarray]:
    """Add points to a closed curve until neighbors are close to each other. Its shape stays.

    Args:
        shape: The curve, (n, 2) in fractions of the picture.
        aspect: The picture's width / height.
        most: The largest distance between two neighboring points, in heights of the picture.

    Returns:
        All points (m, 2) in the curve's order, and a mask (m,) bool that is true for the curve's original points.
    """
    points = np.asarray(shape, dtype=np.float64)
    ends = np.roll(points, -1, axis=0)
    counts = np.ceil(np.hypot(*((ends - points) * (aspect, 1)).T) / most).astype(int).clip(1)
    share = np.concatenate([np.arange(count) / count for count in counts])
    finer = np.repeat(points, counts, axis=0) * (1 - share[:, None]) + np.repeat(ends, counts, axis=0) * share[:, None]
    return finer, share == 0


def _apart(points: np.ndarray, point: tuple[float, float], aspect: float) -> np.ndarray:
    """Return the distances (n,) of points (n, 2) from another point, in heights of the picture."""
    return np.hypot(*((points - point) * (aspect, 1)).T)


def in_order(drawings: Iterable[Curves], aspect: float) -> list[Curves]:
    """Return drawings with curves and points reordered, so that curves can be interpolated between drawings.

    Interpolation pairs curves by their index in two drawings, and points by their index in the curve
    (scribbles.between_strokes). So a curve and the curve in the next drawing that resembles it (place and size) get the
    same index, as far as possible; curves that are present for longest come first. Each gets _POINTS points,
    counter-clockwise, beginning at a similar place. Curves of fewer than 3 points are dropped.

    Args:
        drawings: The curves of each drawing, in fractions of the picture, in order of time.
        aspect: The picture's width / height.
    """
    chains: list[dict[int, np.ndarray]] = []  # a curve by the numbers of its drawings
    count = 0
    for count, drawing in enumerate(drawings, 1):
        left = dict(
            enumerate(_resampled(_turned(np.asarray(each, float)), aspect) for each in drawing if len(each) > 2)
        )
        going = {i: chain[count - 1] for i, chain in enumerate(chains) if count - 1 in chain}
        for apart, i, j in sorted((_differ(a, b), i, j) for i, a in going.items() for j, b in left.items()):
            if apart <= _ALIKE and count not in chains[i] and j in left:
                chains[i][count] = _aligned(going[i], left.pop(j), aspect)
        chains += [{count: curve} for curve in left.values()]
    chains.sort(key=len, reverse=True)  # what stays keeps its position
    return [curves([chain[number] for chain in chains if number in chain]) for number in range(1, count + 1)]


def _differ(curve: np.ndarray, other: np.ndarray) -> float:
    """Return how much two curves' bounding boxes differ: the largest distance of equal sides / the longest side."""
    boxes = np.array([(points.min(axis=0), points.max(axis=0)) for points in (curve, other)])
    sides = float(np.ptp(boxes, axis=1).max())
    return float(np.abs(boxes[0] - boxes[1]).max()) / max(sides, 1e-9)


def _resampled(curve: np.ndarray, aspect: float) -> np.ndarray:
    """Return a closed curve (n, 2) as _POINTS points at equal distances along it, (_POINTS, 2)."""
    return scribbles.resample(np.concatenate([curve, curve[:1]]), _POINTS + 1, aspect)[:-1]


def _turned(curve: np.ndarray) -> np.ndarray:
    """Return a curve with its points in counter-clockwise order."""
    x, y = curve.T
    return curve if np.dot(x, np.roll(y, -1)) >= np.dot(y, np.roll(x, -1)) else curve[::-1]


def _aligned(before: np.ndarray, curve: np.ndarray, aspect: float) -> np.ndarray:
    """Rotate the order of a closed curve's points (n, 2), so that each is near the point of `before` with its index."""
    fixed, moved = ((points - points.mean(axis=0)) * (aspect, 1) for points in (before, curve))
    alike = sum(np.fft.irfft(np.conj(np.fft.rfft(fixed[:, k])) * np.fft.rfft(moved[:, k]), len(curve)) for k in (0, 1))
    return np.roll(curve, -int(np.argmax(alike)), axis=0)
