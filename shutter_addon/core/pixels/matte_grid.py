"""Fit mattes to the picture's pixels: scale, feather, average blocks. And other filters by rows and columns."""

import math
from typing import Literal

import numpy as np
from numpy.typing import DTypeLike

Taps = tuple[np.ndarray, np.ndarray]  # for each row of the result: input rows and their weights, both (rows, k)

EDGE_SIGMAS = 4  # standard deviations per width of a feather, which contain 95 % of an edge's step
_COARSE = 2.7  # standard deviation of a Gaussian on a coarser grid, in cells: edges are within 1/255 of the exact ones
_REACH = 3.3  # standard deviations
_ROWS = 32  # rows at a time, which fit into a processor's cache


def fitted(values: np.ndarray, width: int, height: int) -> np.ndarray:
    """Return a matte, scaled to fit into the middle of a picture with its aspect kept and black around it.

    A pixel is the mean of what it covers where the matte is reduced, and linearly interpolated where it is enlarged. A
    pixel on the matte's edge is black in proportion. A matte of the right size is returned itself.

    Args:
        values: (h, w) float32, 0 … 1.
        width, height: Of the picture.
    """
    if values.shape == (height, width):
        return values
    rows, columns = values.shape
    scale = min(width / columns, height / rows)
    return _resampled(values, _fit(rows, height, scale), _fit(columns, width, scale))


def feathered(values: np.ndarray, width: float) -> np.ndarray:
    """Return values (h, w) float32, 0 … 1, blurred by a Gaussian that spreads a hard edge over `width` pixels.

    Beyond the picture its edges continue. With width 0, the values are returned themselves.
    """
    if width <= 0:
        return values
    sigma = width / EDGE_SIGMAS
    step = max(1, int(sigma / _COARSE))
    if step == 1:
        return blurred(values, _gaussian(sigma))
    # Coarse cells and interpolation also widen an edge, by a quarter of a cell squared on average.
    narrower = math.sqrt((sigma / step) ** 2 - 1 / 4)
    coarse = _resampled(values, *(_means(length, step) for length in values.shape))
    return _resampled(blurred(coarse, _gaussian(narrower)), *(_lines(length, step) for length in values.shape))


def block_means(values: np.ndarray, block: int) -> np.ndarray:
    """Return means (⌈h/block⌉, ⌈w/block⌉) float32 of blocks of values (h, w); the last blocks may be smaller."""
    if block == 1:
        return values
    return _resampled(values, *(_blocks(length, block) for length in values.shape))


def block_sums(
    picture: np.ndarray, size: int, dtype: DTypeLike, *, beyond: Literal["edge", "constant"] = "edge"
) -> np.ndarray:
    """Return sums (⌈h/size⌉, ⌈w/size⌉, C) over blocks of a picture's pixels (h, w, C).

    Args:
        beyond: How the picture continues, as in numpy.pad: "constant" for 0.
    """
    down, right = (-length % size for length in picture.shape[:2])
    if down or right:
        picture = np.pad(picture, [(0, down), (0, right), (0, 0)], beyond)
    rows = picture[::size].astype(dtype)
    for row in range(1, size):
        rows += picture[row::size]
    total = rows[:, ::size].copy()
    for column in range(1, size):
        total += rows[:, column::size]
    return total


def _resampled(values: np.ndarray, down: Taps, across: Taps) -> np.ndarray:
    """Return values (h, w) resampled along rows and columns.

    Args:
        values: The values.
        down: The taps that make the new rows.
        across: The taps that make the new columns.
    """
    if len(across[0]) > values.shape[1]:  # transpose while it is small
        return _weighted(_turned(_weighted(_turned(values), *across)), *down)
    return _turned(_weighted(_turned(_weighted(values, *down)), *across))


def blurred(values: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return values (h, w) ≤ 1 filtered with a kernel, vertically and horizontally.

    Beyond the picture its edges continue.

    Args:
        values: The values.
        kernel: Weights at distances 0, 1, 2, … to both sides.
    """
    return _turned(_convolved(_turned(_convolved(values, kernel)), kernel))


def _turned(values: np.ndarray) -> np.ndarray:
    """Return values with rows and columns swapped, in C order."""
    return np.ascontiguousarray(values.T)


def _weighted(values: np.ndarray, indices: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return rows (n, w) float32 that are weighted sums of the rows of `values` (h, w), at most 1.

    Args:
        values: The values.
        indices: Which rows are summed, (n, k).
        weights: Their weights, (n, k).
    """
    result = np.empty((len(indices), values.shape[1]), np.float32)
    weights = weights.astype(np.float32)[:, :, None]
    for start in range(0, len(indices), _ROWS):
        rows = slice(start, start + _ROWS)
        total = np.multiply(values[indices[rows, 0]], weights[rows, 0], out=result[rows])
        for tap in range(1, indices.shape[1]):
            part = values[indices[rows, tap]]
            part *= weights[rows, tap]
            total += part
        np.minimum(total, 1, out=total)  # weights are rounded
    return result


def _convolved(values: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return values (h, w) filtered vertically with a kernel, as for `blurred`."""
    reach = len(kernel) - 1
    padded = np.pad(values, ((reach, reach), (0, 0)), "edge")
    result = np.empty_like(values)
    for start in range(0, len(values), _ROWS):
        total, row = result[start : start + _ROWS], start + reach
        np.multiply(padded[row : row + len(total)], kernel[0], out=total)
        for distance in range(1, reach + 1):
            before, after = row - distance, row + distance
            part = padded[before : before + len(total)] + padded[after : after + len(total)]
            part *= kernel[distance]
            total += part
        np.minimum(total, 1, out=total)
    return result


def _fit(length: int, size: int, scale: float) -> Taps:
    """Return the taps (which pixels are summed for each new one, and their weights) of an axis for `fitted`.

    Args:
        length: The matte's pixels along the axis.
        size: The picture's.
        scale: The picture's pixels for each pixel of the matte, which lies in the picture's middle.
    """
    edges = (np.arange(size + 1) - size / 2) / scale + length / 2
    start, stop = edges[:-1, None], edges[1:, None]
    if scale < 1:
        indices = np.floor(start + 1e-6).astype(int) + np.arange(math.ceil(1 / scale) + 1)
        weights = np.minimum(stop, indices + 1) - np.maximum(start, indices)
        weights[(indices < 0) | (indices >= length)] = 0
    else:
        left = (start + stop - 1) / 2
        indices = np.floor(left + 1e-6).astype(int) + np.arange(2)
        weights = 1 - np.abs(left - indices)
        weights *= np.minimum(stop, length) - np.maximum(start, 0)
    weights = (weights * scale).clip(0)
    used = weights.max(axis=0) > 1e-5
    return indices.clip(0, length - 1)[:, used], weights[:, used]


def _blocks(length: int, block: int) -> Taps:
    """Return the taps (which rows are summed, and their weights) for means of blocks of rows.

    The last block may be smaller.
    """
    indices = np.arange(0, length, block)[:, None] + np.arange(block)
    present = indices < length
    return indices.clip(0, length - 1), present / present.sum(axis=1, keepdims=True)


def _gaussian(sigma: float) -> np.ndarray:
    """Return the weights float32 of a Gaussian blur at distances 0, 1, 2, … pixels.

    They are the Gaussian's integral over each pixel, so a hard edge becomes the error function.

    Args:
        sigma: The standard deviation in pixels.
    """
    reach = math.ceil(_REACH * sigma)
    ends = np.array([math.erf((i - 0.5) / (sigma * math.sqrt(2))) for i in range(reach + 2)])
    return (np.diff(ends) / (2 * ends[-1])).astype(np.float32)


def _means(length: int, step: int) -> Taps:
    """Return the taps (which pixels are summed, and their weights) for means of cells of `step` pixels.

    One more cell at each end repeats the last pixel.
    """
    cells = np.arange(-1, math.ceil(length / step) + 1)[:, None]
    indices = (cells * step + np.arange(step)).clip(0, length - 1)
    return indices, np.full(indices.shape, 1 / step)


def _lines(length: int, step: int) -> Taps:
    """Return the taps (which cells are summed, and their weights) for `length` pixels.

    They interpolate linearly between the middles of the cells of `_means`.
    """
    place = (np.arange(length)[:, None] + 0.5) / step + 0.5
    indices = np.floor(place).astype(int) + np.arange(2)
    return indices, 1 - np.abs(place - indices)


Box = tuple[slice, slice]  # rows and columns


def box_around(cover: np.ndarray, reach: int) -> Box | None:
    """Return the rows and columns of the box around all pixels of a matte (h, w) above 0, or None without any.

    Args:
        cover: The matte.
        reach: Pixels by which the box is larger on each side, within the matte.
    """
    places = [np.flatnonzero(cover.max(axis=axis) > 0) for axis in (1, 0)]
    if not places[0].size:
        return None
    low = [max(int(each[0]) - reach, 0) for each in places]
    high = [min(int(each[-1]) + 1 + reach, length) for each, length in zip(places, cover.shape, strict=True)]
    return slice(low[0], high[0]), slice(low[1], high[1])
