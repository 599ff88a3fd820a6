"""A matte's values on the picture's grid: fitted to it, feathered, by blocks of pixels; and what else is blurred or
summed over blocks. Pure NumPy, and separable."""

import math
from typing import Literal

import numpy as np
from numpy.typing import DTypeLike

Taps = tuple[np.ndarray, np.ndarray]  # for each row that comes out: which rows go in, and their weights, both (rows, k)

EDGE_SIGMAS = 4  # a feather's width is so many standard deviations of its Gaussian; 95 % of an edge's step lie in it
_COARSE = 2.7  # standard deviations that a Gaussian keeps on a coarser grid: edges are within 1/255 of the exact ones
_REACH = 3.3  # standard deviations
_ROWS = 32  # at a time; a processor's cache holds them


def fitted(values: np.ndarray, width: int, height: int) -> np.ndarray:
    """A matte scaled to fit a picture, its aspect kept, in the middle, with black around it.

    values: (h, w) float32, 0 … 1; width, height: of the picture, in pixels
    A pixel is the mean of what it covers where the matte is reduced, and interpolated linearly where it is enlarged;
    one that the matte's edge crosses is black in proportion. The matte itself where nothing is to be done.
    """
    if values.shape == (height, width):
        return values
    rows, columns = values.shape
    scale = min(width / columns, height / rows)
    return _resampled(values, _fit(rows, height, scale), _fit(columns, width, scale))


def feathered(values: np.ndarray, width: float) -> np.ndarray:
    """Values (h, w) float32 behind a Gaussian that spreads a hard edge over `width` pixels, EDGE_SIGMAS of its standard
    deviations. Beyond the picture its edges go on. The values themselves where the width is 0."""
    if width <= 0:
        return values
    sigma = width / EDGE_SIGMAS
    step = max(1, int(sigma / _COARSE))
    if step == 1:
        return blurred(values, _gaussian(sigma))
    # Coarse cells and lines between them widen an edge as well, by a quarter of the square of a cell on average.
    narrower = math.sqrt((sigma / step) ** 2 - 1 / 4)
    coarse = _resampled(values, *(_means(length, step) for length in values.shape))
    return _resampled(blurred(coarse, _gaussian(narrower)), *(_lines(length, step) for length in values.shape))


def block_means(values: np.ndarray, block: int) -> np.ndarray:
    """Means (⌈h/block⌉, ⌈w/block⌉) float32 of blocks of values (h, w), of which the last may be cut. The values
    themselves where a block is one value."""
    if block == 1:
        return values
    return _resampled(values, *(_blocks(length, block) for length in values.shape))


def block_sums(
    picture: np.ndarray, size: int, dtype: DTypeLike | None = None, *, beyond: Literal["edge", "constant"] = "edge"
) -> np.ndarray:
    """Sums (⌈h/size⌉, ⌈w/size⌉, C) over blocks of a picture's pixels (h, w, C).

    beyond: what comes after its last pixels, as numpy.pad has it: these again, or "constant", nothing"""
    height, width, channels = picture.shape
    if height % size or width % size:
        picture = np.pad(picture, [(0, -height % size), (0, -width % size), (0, 0)], beyond)
    rows = picture.reshape(len(picture) // size, size, -1).sum(axis=1, dtype=dtype)
    return rows.reshape(len(rows), -1, size, channels).sum(axis=2)


def _resampled(values: np.ndarray, down: Taps, across: Taps) -> np.ndarray:
    if len(across[0]) > values.shape[1]:  # turned twice before it is large, or after it is small
        return _weighted(_turned(_weighted(_turned(values), *across)), *down)
    return _turned(_weighted(_turned(_weighted(values, *down)), *across))


def blurred(values: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Values (h, w), 1 at most, weighted down and across; beyond the picture its edges go on.

    kernel: the weights of a pixel itself and of those at distances 1, 2, …"""
    return _turned(_convolved(_turned(_convolved(values, kernel)), kernel))


def _turned(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values.T)


def _weighted(values: np.ndarray, indices: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Rows (rows, w) that are weighted sums of others, 1 at most."""
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
    """As `_weighted`, with the same weights everywhere: see `blurred`."""
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
    """For each of `size` pixels in a row: which of `length` pixels it shows that are scaled and lie in the middle."""
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
    """Blocks of rows, the last of those that are left."""
    indices = np.arange(0, length, block)[:, None] + np.arange(block)
    present = indices < length
    return indices.clip(0, length - 1), present / present.sum(axis=1, keepdims=True)


def _gaussian(sigma: float) -> np.ndarray:
    """Weights float32 of a pixel and of those at distances 1, 2, …: what they cover of the Gaussian, so that a hard
    edge becomes the error function itself."""
    reach = math.ceil(_REACH * sigma)
    ends = np.array([math.erf((i - 0.5) / (sigma * math.sqrt(2))) for i in range(reach + 2)])
    return (np.diff(ends) / (2 * ends[-1])).astype(np.float32)


def _means(length: int, step: int) -> Taps:
    """Cells of `step` pixels, with one more at each end, whose pixels repeat the last one."""
    cells = np.arange(-1, math.ceil(length / step) + 1)[:, None]
    indices = (cells * step + np.arange(step)).clip(0, length - 1)
    return indices, np.full(indices.shape, 1 / step)


def _lines(length: int, step: int) -> Taps:
    """The pixels again, on straight lines between the middles of such cells."""
    place = (np.arange(length)[:, None] + 0.5) / step + 0.5
    indices = np.floor(place).astype(int) + np.arange(2)
    return indices, 1 - np.abs(place - indices)
