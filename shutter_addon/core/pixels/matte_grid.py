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
    """Scale a matte to fit into the middle of a picture. Its aspect is kept, and the rest of the picture is black (0).

    Where the matte is reduced, a pixel is the mean of the matte's area that it covers. Where it is enlarged, values are
    interpolated linearly. A pixel that the matte covers only in part is darker in proportion.

    Args:
        values: The matte (h, w) float32, 0 to 1.
        width, height: The picture's size in pixels.

    Returns:
        The scaled matte (height, width) float32; `values` itself if it has this size already.
    """
    if values.shape == (height, width):
        return values
    rows, columns = values.shape
    scale = min(width / columns, height / rows)
    return _resampled(values, _fit(rows, height, scale), _fit(columns, width, scale))


def feathered(values: np.ndarray, width: float) -> np.ndarray:
    """Blur a matte with a Gaussian. Beyond the matte's edges, the pixels at the edge are repeated.

    Args:
        values: The matte (h, w) float32, 0 to 1.
        width: Over how many pixels a hard edge spreads: 95 % of its step lie within this width.

    Returns:
        The blurred matte (h, w) float32; `values` itself if `width` is 0.
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
    """Sum the pixels of each block of size × size pixels of a picture.

    Args:
        picture: The picture (h, w, C).
        size: The side of a block in pixels.
        dtype: The type of the sums, in which they are added; it has to hold the largest sum.
        beyond: How the picture continues if its last blocks are incomplete: "edge" repeats its last row and column,
            "constant" adds zeros.

    Returns:
        The sums (⌈h/size⌉, ⌈w/size⌉, C).
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
    """Resample values (h, w) along both axes: each new row and column is a weighted sum of old ones.

    Args:
        values: The values (h, w) float32.
        down: For each of the H new rows, the indices of the old rows and their weights (see Taps).
        across: For each of the W new columns, the same of the old columns.

    Returns:
        The new values (H, W) float32, clipped to at most 1.
    """
    if len(across[0]) > values.shape[1]:  # transpose while it is small
        return _weighted(_turned(_weighted(_turned(values), *across)), *down)
    return _turned(_weighted(_turned(_weighted(values, *down)), *across))


def blurred(values: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Filter values with a symmetric kernel, vertically and horizontally. Beyond the edges, edge pixels are repeated.

    Args:
        values: The values (h, w) float32, at most 1.
        kernel: The weights at distances 0, 1, 2, … pixels; each but the first counts on both sides.

    Returns:
        The filtered values (h, w), clipped to at most 1, since rounded weights can add up to slightly more.
    """
    return _turned(_convolved(_turned(_convolved(values, kernel)), kernel))


def _turned(values: np.ndarray) -> np.ndarray:
    """Return values with rows and columns swapped, in C order."""
    return np.ascontiguousarray(values.T)


def _weighted(values: np.ndarray, indices: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return weighted sums of rows.

    Args:
        values: The rows to choose from, (h, w).
        indices: For each sum, the indices of the k rows that are added, (n, k).
        weights: The weights of these rows, (n, k).

    Returns:
        The sums (n, w) float32, clipped to at most 1, since rounded weights can add up to slightly more.
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
    """Find how `fitted` computes the picture's pixels along one axis from the matte's pixels.

    Args:
        length: The matte's number of pixels along the axis.
        size: The picture's number of pixels along the axis.
        scale: How many pixels of the picture one pixel of the matte becomes. The matte lies in the picture's middle.

    Returns:
        For each of the picture's pixels, the indices of the matte's pixels to add and their weights, (size, k) each.
        Pixels of the picture beyond the matte have weights of 0.
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
    """Find which rows to average for means of blocks of successive rows.

    Args:
        length: The number of rows.
        block: Rows per block. The last block may have fewer.

    Returns:
        For each block, the indices of its rows and their weights, (⌈length/block⌉, block) each. In a smaller last
        block, the surplus weights are 0.
    """
    indices = np.arange(0, length, block)[:, None] + np.arange(block)
    present = indices < length
    return indices.clip(0, length - 1), present / present.sum(axis=1, keepdims=True)


def _gaussian(sigma: float) -> np.ndarray:
    """Return one side of the kernel of a Gaussian blur, as `blurred` takes it.

    Each weight is the Gaussian's integral over one pixel, so a hard edge becomes the error function.

    Args:
        sigma: The standard deviation in pixels.

    Returns:
        The weights float32 at distances 0, 1, 2, … pixels, to 3.3 standard deviations. Both sides together add up to 1.
    """
    reach = math.ceil(_REACH * sigma)
    ends = np.array([math.erf((i - 0.5) / (sigma * math.sqrt(2))) for i in range(reach + 2)])
    return (np.diff(ends) / (2 * ends[-1])).astype(np.float32)


def _means(length: int, step: int) -> Taps:
    """Find which pixels to average for a coarser grid, whose cells are `step` pixels wide.

    The grid has one more cell before the first pixel and one after the last. They repeat the pixel at that end, so that
    `_lines` can interpolate up to the ends.

    Args:
        length: The number of pixels along the axis.
        step: Pixels per cell.

    Returns:
        For each cell, the indices of its pixels and their equal weights, (⌈length/step⌉ + 2, step) each.
    """
    cells = np.arange(-1, math.ceil(length / step) + 1)[:, None]
    indices = (cells * step + np.arange(step)).clip(0, length - 1)
    return indices, np.full(indices.shape, 1 / step)


def _lines(length: int, step: int) -> Taps:
    """Find which cells to mix to turn the coarser grid of `_means` into pixels again, by linear interpolation.

    Args:
        length: The number of pixels along the axis.
        step: Pixels per cell.

    Returns:
        For each pixel, the indices of the two cells whose middles are nearest, and their weights, (length, 2) each.
    """
    place = (np.arange(length)[:, None] + 0.5) / step + 0.5
    indices = np.floor(place).astype(int) + np.arange(2)
    return indices, 1 - np.abs(place - indices)


Box = tuple[slice, slice]  # rows and columns


def box_around(cover: np.ndarray, reach: int) -> Box | None:
    """Return the smallest box that contains all pixels of a matte above 0, enlarged by a margin.

    Args:
        cover: The matte (h, w).
        reach: The margin on each side in pixels. The box is cut off at the matte's edges.

    Returns:
        The slices of rows and of columns, which index the box; None if no pixel is above 0.
    """
    places = [np.flatnonzero(cover.max(axis=axis) > 0) for axis in (1, 0)]
    if not places[0].size:
        return None
    low = [max(int(each[0]) - reach, 0) for each in places]
    high = [min(int(each[-1]) + 1 + reach, length) for each, length in zip(places, cover.shape, strict=True)]
    return slice(low[0], high[0]), slice(low[1], high[1])
