"""Frames seen elsewhere than where their pixels are, with NumPy: what core.pixels.compositor.seen does, for a part."""

from __future__ import annotations

import numpy as np


def around(places: np.ndarray, shape: tuple[int, ...]) -> tuple[slice, slice, np.ndarray, np.ndarray]:
    """The rows and columns of a frame of a shape (height, width, …) that are needed to see it at places (h, w), x + iy;
    and where the places lie in these."""
    height, width = shape[:2]
    # Far outside all is the same, and large numbers have no fractions.
    x, y = np.clip(places.real, -2, width + 1), np.clip(places.imag, -2, height + 1)
    rows, columns = _reached(y, height), _reached(x, width)
    return rows, columns, x - columns.start, y - rows.start


def _reached(along: np.ndarray, size: int) -> slice:
    """The pixels of a line of `size` that filters at these places read."""
    first, last = int(np.floor(along.min())) - 1, int(np.floor(along.max())) + 2
    return slice(min(max(first, 0), size - 1), max(min(last, size - 1), 0) + 1)


def resampled(planes: np.ndarray, x: np.ndarray, y: np.ndarray, *, sharp: bool) -> np.ndarray:
    """Planes (C, H, W) float32 at x, y (h, w), as (C, h, w). sharp: by Catmull and Rom's cubic, kept between the four
    pixels around; else linearly. Beyond their edges they go on as their last pixels."""
    count, height, width = planes.shape
    column, row = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    across, down = _weights((x - column).astype(np.float32), sharp), _weights((y - row).astype(np.float32), sharp)
    columns = {i: np.clip(column + i, 0, width - 1) for i in across}
    flat = planes.reshape(count, -1)
    total: np.ndarray | float = 0.0
    low: np.ndarray | float = np.inf
    high: np.ndarray | float = -np.inf
    for j, weight in down.items():
        line: np.ndarray | float = 0.0
        start = np.clip(row + j, 0, height - 1) * width
        for i, own in across.items():
            pixels = flat.take(start + columns[i], axis=1)
            if {i, j} <= {0, 1}:
                low, high = np.minimum(low, pixels), np.maximum(high, pixels)
            line = line + own * pixels
        total = total + weight * line
    return np.clip(total, low, high)


def _weights(t: np.ndarray, sharp: bool) -> dict[int, np.ndarray]:
    """The weights of the pixels around a place between 0 and 1, by where they are."""
    if not sharp:
        return {0: 1 - t, 1: t}
    return {
        -1: t * (t * (1 - t / 2) - np.float32(0.5)),
        0: 1 + t * t * (np.float32(1.5) * t - np.float32(2.5)),
        1: t * (t * (2 - np.float32(1.5) * t) + np.float32(0.5)),
        2: t * t * (t - 1) / 2,
    }
