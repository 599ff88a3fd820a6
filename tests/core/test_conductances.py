"""Conductances, and the exact solution, against their definitions written out pixel by pixel."""

import math

import numpy as np
import pytest

from shutter_addon.core.pixels.conductances import conductances, resistances


def by_hand(guide, strength):
    """The resistance of each cell, by the steeper of its slopes; at the picture's edge the last cell goes on."""
    height, width, _ = guide.shape
    found = np.ones((height, width))
    for y, x in np.ndindex(found.shape):
        before, after = guide[y, max(x - 1, 0)], guide[y, min(x + 1, width - 1)]
        above, below = guide[max(y - 1, 0), x], guide[min(y + 1, height - 1), x]
        slopes = [abs(float(b) - float(a)) / 2 for a, b in zip((*before, *above), (*after, *below), strict=True)]
        found[y, x] = max(math.exp(-((max(slopes) / 0.03) ** 2)), 3e-3) ** -strength
    return found


def noise(height, width):
    return (0.5 + 0.03 * np.random.default_rng(1).standard_normal((height, width, 3))).astype(np.float32)


@pytest.mark.parametrize("strength", [0.0, 0.3, 1.0])
def test_conductances_are_those_of_the_definition(strength):
    guide = noise(5, 7)
    cells = by_hand(guide, strength)
    assert cells.max() < 400
    np.testing.assert_allclose(resistances(guide, strength), cells, rtol=0, atol=6e-4)
    right, down = conductances(guide, strength, (5, 7))
    np.testing.assert_allclose(1 / right, (cells[:, 1:] + cells[:, :-1]) / 2, rtol=0, atol=6e-4)
    np.testing.assert_allclose(1 / down, (cells[1:] + cells[:-1]) / 2, rtol=0, atol=6e-4)


@pytest.mark.parametrize("side", [2, 4])
def test_between_the_middles_of_larger_cells_resistances_are_linear(side):
    height, width = 5 * side - 1, 7 * side - side // 2
    guide = noise(5, 7)

    def widened(rows, count):
        places = (np.arange(count) + 0.5) / side - 0.5
        return np.array([np.interp(places, np.arange(len(row)), row) for row in rows])

    pixels = widened(widened(by_hand(guide, 1.0), width).T, height).T
    right, down = conductances(guide, 1.0, (height, width))
    np.testing.assert_allclose(1 / right, (pixels[:, 1:] + pixels[:, :-1]) / 2, rtol=0, atol=1e-3)
    np.testing.assert_allclose(1 / down, (pixels[1:] + pixels[:-1]) / 2, rtol=0, atol=1e-3)


def test_alpha_does_not_count():
    guide = np.random.default_rng(2).random((4, 5, 3)).astype(np.float32)
    with_alpha = np.dstack([guide, np.random.default_rng(3).random((4, 5))])
    np.testing.assert_array_equal(resistances(with_alpha, 1), resistances(guide, 1))


@pytest.mark.parametrize("size", [(1, 1), (1, 4), (4, 1)])
def test_pictures_of_one_row_or_column(size):
    right, down = conductances(np.zeros((*size, 3)), 1.0, size)
    assert (right.shape, down.shape) == ((size[0], size[1] - 1), (size[0] - 1, size[1]))
