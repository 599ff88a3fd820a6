"""Fill closed polygons line by line.

Polygons (n, 2) are in pixels from the corner of the first pixel, x along the lines and y across them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def edges(polygons: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the starts and ends of all edges of closed polygons, (m, 2) each."""
    start = np.concatenate([np.zeros((0, 2)), *polygons])
    return start, np.concatenate([np.zeros((0, 2)), *(np.roll(polygon, -1, axis=0) for polygon in polygons)])


def crossings(start: np.ndarray, end: np.ndarray, lines: range) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find where edges of polygons cross the middles of rows of pixels (lines).

    Args:
        start, end: The starts and ends of the n edges, (n, 2) each: x, y in pixels.
        lines: The numbers of the lines to look at; line i has its middle at y = i + 0.5.

    Returns:
        Three arrays (m,), with an entry for each crossing: the index of its edge, the number of its line, and its x.
    """
    lower, upper = np.where((start[:, 1] < end[:, 1])[:, None], (start, end), (end, start))
    first, last = (
        np.clip(np.ceil(y - 0.5), lines.start, lines.stop).astype(np.intp) for y in (lower[:, 1], upper[:, 1])
    )
    edge, line = ranges(first, last)
    below, (width, height) = lower[edge], (upper - lower)[edge].T
    x = below[:, 0] + (line + 0.5 - below[:, 1]) * width / height
    return edge, line, x


def fill(
    picture: np.ndarray, polygons: Sequence[np.ndarray], value: float, *, odd: bool = False, seam: float = 0.0
) -> bool:
    """Set the pixels of a picture whose middles are inside closed polygons, in place. Return whether any pixel was set.

    Args:
        picture: The picture (h, w).
        polygons: The corners of each polygon, (n, 2), x and y in pixels; the last corner is joined to the first.
        value: The value to set.
        odd: Choose the even-odd rule: a place is inside if an odd number of windings goes around it. By default, the
            nonzero rule holds: a place is inside if the windings around it, of all polygons together, do not add up to
            0. Those in opposite directions cancel each other.
        seam: By how many pixels each filled span of a row is longer at its end, so that rounding leaves no gap between
            polygons that touch.
    """
    height, width = picture.shape
    start, end = edges(polygons)
    edge, line, x = crossings(start, end, range(height))
    turn = np.where(start[:, 1] < end[:, 1], 1, -1)[edge]
    order = np.lexsort((x, line))
    line, x, winding = line[order], x[order], np.cumsum(turn[order])[:-1]
    # A span lies between two consecutive edges on the same line.
    inside = (winding % 2 != 0 if odd else winding != 0) & (line[1:] == line[:-1])
    ends = x[:-1][inside], x[1:][inside] + seam
    first, last = (np.ceil(np.clip(x - 0.5, 0, width)).astype(int) for x in ends)
    for y, a, b in zip(line[:-1][inside].tolist(), first.tolist(), last.tolist(), strict=True):
        picture[y, a:b] = value
    return bool((first < last).any())


def ranges(first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Put the integers of several ranges into one array, one range after the other.

    Args:
        first: The first integer of each range, (r,).
        last: The integer after the last one of each range, (r,). A range is empty if this is not above `first`.

    Returns:
        Two arrays (n,), with an entry for each integer: the index of its range, and the integer.
    """
    counts = np.maximum(last - first, 0)
    index = np.repeat(np.arange(len(counts)), counts)
    return index, np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts - first, counts)
