"""A matte on the picture's grid, against the same in float64, written out."""

import math

import numpy as np
import pytest

from shutter_addon.core.pixels.matte_grid import EDGE_SIGMAS, block_means, feathered, fitted

LEVEL = 1 / 255
SIZES = [  # of the matte, and of the picture
    ((32, 18), (48, 27)),
    ((96, 54), (48, 27)),
    ((40, 30), (64, 36)),
    ((90, 90), (64, 36)),
    ((64, 27), (64, 36)),
    ((37, 64), (41, 23)),
    ((7, 3), (64, 36)),
]


def noise(width, height, seed=0):
    return np.random.default_rng(seed).random((height, width)).astype(np.float32)


def along(length, size, scale):
    """The matrix (size, length) that fits a row: exact areas, or lines between the middles of pixels."""
    matrix = np.zeros((size, length))
    for pixel in range(size):
        start, stop = ((pixel + i - size / 2) / scale + length / 2 for i in (0, 1))
        cover = max(0.0, min(stop, length) - max(start, 0.0)) * scale
        if scale < 1:
            for i in range(length):
                matrix[pixel, i] = max(0.0, min(stop, i + 1) - max(start, i)) * scale
        elif cover > 0:
            middle = (start + stop) / 2 - 0.5
            for i in (math.floor(middle), math.floor(middle) + 1):
                matrix[pixel, min(max(i, 0), length - 1)] += cover * (1 - abs(middle - i))
    return matrix


def reference(values, width, height):
    scale = min(width / values.shape[1], height / values.shape[0])
    down, across = along(values.shape[0], height, scale), along(values.shape[1], width, scale)
    return down @ values.astype(np.float64) @ across.T


@pytest.mark.parametrize(("size", "picture"), SIZES)
def test_fitted(size, picture):
    values = noise(*size)
    result = fitted(values, *picture)
    assert (result.dtype, result.shape, result.flags.c_contiguous) == (np.float32, picture[::-1], True)
    assert np.abs(result - reference(values, *picture)).max() < 1e-5


def test_what_changes_nothing_is_the_same_array():
    values = noise(64, 36)
    assert block_means(values, 1) is fitted(values, 64, 36) is feathered(values, 0) is values


@pytest.mark.parametrize("width", [0.5, 1, 2, 5, 10.7, 21.6, 24, 40, 43.3, 86])
def test_a_hard_edge_becomes_the_error_function(width):
    for at in (100, 101, 102, 103):
        values = np.zeros((203, 4), np.float32)
        values[at:] = 1
        expected = [0.5 + 0.5 * math.erf((row + 0.5 - at) * EDGE_SIGMAS / width / math.sqrt(2)) for row in range(203)]
        for result in (feathered(values, width)[:, 1], feathered(np.ascontiguousarray(values.T), width)[1]):
            assert np.abs(result - expected).max() < LEVEL


@pytest.mark.parametrize("width", [4, 8.5, 18.7, 25, 60])
def test_the_pictures_edges_go_on(width):
    """As if the picture were larger all around."""
    values = noise(40, 30, 3)
    values[:, :12] = 1
    large = feathered(np.pad(values, 100, "edge"), width)[100:-100, 100:-100]
    assert np.abs(feathered(values, width) - large).max() < 1.5 * LEVEL
    white = feathered(np.ones((30, 40), np.float32), width)
    assert 1 - 1e-5 < white.min() <= white.max() <= 1
    half = np.tile(np.float32([0, 0, 0, 1, 1, 1]), (4, 1))
    assert np.abs(feathered(half, 600) - 0.5).max() < 0.01, "it is wider than the picture"
