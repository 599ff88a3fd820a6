"""Outlines: closed curves, and how much of each pixel they enclose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# Lines of each row of pixels on which coverage is exact.
LINES = 8

Curves = tuple[tuple[tuple[float, float], ...], ...]  # hashable strokes: fractions of the picture, y up


def curves(strokes: Sequence[np.ndarray]) -> Curves:
    """Strokes (n, 2) as plain tuples."""
    return tuple(tuple((float(x), float(y)) for x, y in stroke) for stroke in strokes)


def coverage(strokes: Sequence, width: int, height: int) -> np.ndarray:
    """The share (height, width) float32, 0 to 1, of each pixel that closed curves enclose, the top row first; what two
    of them enclose lies outside (even-odd). strokes: (n, 2) in fractions of the picture, y up"""
    rows, places = _crossings(strokes, width, height)
    order = np.lexsort((places, rows))
    rows, places = rows[order], np.clip(places[order], 0, width)
    rank = np.arange(len(rows)) - np.searchsorted(rows, rows)
    signs = np.where(rank % 2 == 0, 1.0, -1.0) / LINES
    columns = np.minimum(places.astype(np.intp), width - 1)
    beyond = places - columns  # the share of that pixel that lies before the crossing
    changes = np.zeros((height, width + 1))
    np.add.at(changes, (rows // LINES, columns), signs * (1 - beyond))
    np.add.at(changes, (rows // LINES, columns + 1), signs * beyond)
    return np.clip(np.cumsum(changes[:, :-1], axis=1), 0, 1).astype(np.float32)


def _crossings(strokes: Sequence, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Where curves cross the lines: which of these, (n,) from the top, and places (n,) in pixels from the left."""
    rows, places = [np.zeros(0, np.intp)], [np.zeros(0)]
    for stroke in strokes:
        if len(stroke) < 3:
            continue
        points = np.asarray(stroke, dtype=np.float64) * (width, -height * LINES) + (0, height * LINES)
        ends = np.roll(points, -1, axis=0)
        upper, lower = np.where(points[:, 1:] <= ends[:, 1:], (points, ends), (ends, points))
        first = np.clip(np.ceil(upper[:, 1] - 0.5), 0, height * LINES).astype(np.intp)
        count = np.clip(np.ceil(lower[:, 1] - 0.5), first, height * LINES).astype(np.intp) - first
        edge = np.repeat(np.arange(len(count)), count)
        row = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count) + first[edge]
        along = (row + 0.5 - upper[edge, 1]) / (lower[edge, 1] - upper[edge, 1])
        rows.append(row)
        places.append(upper[edge, 0] + along * (lower[edge, 0] - upper[edge, 0]))
    return np.concatenate(rows), np.concatenate(places)
