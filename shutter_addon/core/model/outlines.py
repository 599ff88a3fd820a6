"""Outlines: closed curves, and how much of each pixel they enclose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from .. import scanlines, stopping

# Lines of each row of pixels on which coverage is exact.
LINES = 8
_CROSSINGS = 1 << 22  # of curves with lines that are looked at at once: some 300 MB of memory
_PULLED = 12  # points at least, of either side of a curve that is pulled
_NEAR = 0.005  # parts of the picture's height, within which it is known how near a curve is

Curves = tuple[tuple[tuple[float, float], ...], ...]  # hashable strokes: fractions of the picture, y up


def curves(strokes: Sequence[np.ndarray]) -> Curves:
    """Strokes (n, 2) as plain tuples."""
    return tuple(tuple((float(x), float(y)) for x, y in stroke) for stroke in strokes)


def coverage(strokes: Sequence, width: int, height: int) -> np.ndarray:
    """The share (height, width) float32, 0 to 1, of each pixel that closed curves enclose, the top row first; what two
    of them enclose lies outside (even-odd). strokes: (n, 2) in fractions of the picture, y up"""
    rows = max(_CROSSINGS // (LINES * max(sum(map(len, strokes)), 1)), 1)
    return np.concatenate([_covered(strokes, width, height, band) for band in _bands(height, rows)])


def _bands(height: int, rows: int) -> Iterator[range]:
    for top in range(0, height, rows):
        stopping.check()
        yield range(top, min(top + rows, height))


def _covered(strokes: Sequence, width: int, height: int, band: range) -> np.ndarray:
    """The coverage of the rows of a band."""
    lines, scale = range(band.start * LINES, band.stop * LINES), (width, -height * LINES)
    curves = [np.asarray(stroke, np.float64) * scale + (0, height * LINES) for stroke in strokes if len(stroke) > 2]
    _, rows, places = scanlines.crossings(*scanlines.edges(curves), lines)
    rows -= lines.start
    order = np.lexsort((places, rows))
    rows, places = rows[order], np.clip(places[order], 0, width)
    rank = np.arange(len(rows)) - np.searchsorted(rows, rows)
    signs = np.where(rank % 2 == 0, 1.0, -1.0) / LINES
    columns = np.minimum(places.astype(np.intp), width - 1)
    beyond = places - columns  # the share of that pixel that lies before the crossing
    changes = np.zeros((len(band), width + 1))
    np.add.at(changes, (rows // LINES, columns), signs * (1 - beyond))
    np.add.at(changes, (rows // LINES, columns + 1), signs * beyond)
    return np.clip(np.cumsum(changes[:, :-1], axis=1), 0, 1).astype(np.float32)


def nearest(shapes: Curves, point: tuple[float, float], aspect: float) -> tuple[int, float]:
    """Which of some curves comes nearest to a point, and how near: in parts of the picture's height. ValueError: there
    is none. aspect: the picture's width over its height"""
    apart = [_apart(_finer(shape, aspect, _NEAR)[0], point, aspect).min() for shape in shapes]
    index = int(np.argmin(apart))
    return index, float(apart[index])


def dragged(
    shapes: Curves, index: int, grabbed: tuple[float, float], by: tuple[float, float], reach: float, aspect: float
) -> Curves:
    """Curves, one of which is pulled: where it comes nearest to the point `grabbed`, it moves `by` as much, and less
    and less along its way, up to `reach`.

    index: which one; grabbed, by: fractions of the picture, y up; reach: in parts of its height, along the curve"""
    points, own = _finer(shapes[index], aspect, reach / _PULLED)
    start = int(_apart(points, grabbed, aspect).argmin())
    points, own = np.roll(points, -start, axis=0), np.roll(own, -start)
    steps = np.hypot(*(np.diff(points, axis=0, append=points[:1]) * (aspect, 1)).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    way = np.minimum(along[:-1], along[-1] - along[:-1])  # from the start, whichever way is shorter
    share = np.square(1 - np.minimum(way / reach, 1) ** 2)
    moved = (points + share[:, None] * by)[own | (share > 0)]
    return tuple(curves([moved])[0] if i == index else shape for i, shape in enumerate(shapes))


def _finer(shape: Sequence, aspect: float, most: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) of a closed curve, with more of them where two are farther apart than `most`, in parts of the
    picture's height; and which (n,) are its own."""
    points = np.asarray(shape, dtype=np.float64)
    ends = np.roll(points, -1, axis=0)
    counts = np.ceil(np.hypot(*((ends - points) * (aspect, 1)).T) / most).astype(int).clip(1)
    share = np.concatenate([np.arange(count) / count for count in counts])
    finer = np.repeat(points, counts, axis=0) * (1 - share[:, None]) + np.repeat(ends, counts, axis=0) * share[:, None]
    return finer, share == 0


def _apart(points: np.ndarray, point: tuple[float, float], aspect: float) -> np.ndarray:
    """How far points (n, 2) are from one, in parts of the picture's height."""
    return np.hypot(*((points - point) * (aspect, 1)).T)
