"""Conductances, and the exact solution, against their definitions written out pixel by pixel."""

import math

import numpy as np
import pytest

from shutter_addon.core import exact_diffusion
from shutter_addon.core.conductances import conductances


def by_hand(a, b, strength):
    difference = max(abs(float(x) - float(y)) for x, y in zip(a, b, strict=True))
    return max(math.exp(-((difference / 0.03) ** 2)), 3e-3) ** strength


@pytest.mark.parametrize("strength", [0.0, 0.3, 1.0])
def test_conductances_are_those_of_the_definition(strength):
    guide = 0.5 + 0.03 * np.random.default_rng(1).standard_normal((5, 7, 3))
    right, down = conductances(guide, strength)
    assert right.shape == (5, 6)
    assert down.shape == (4, 7)
    for y, x in np.ndindex(right.shape):
        assert right[y, x] == pytest.approx(by_hand(guide[y, x], guide[y, x + 1], strength), rel=1e-9)
    for y, x in np.ndindex(down.shape):
        assert down[y, x] == pytest.approx(by_hand(guide[y, x], guide[y + 1, x], strength), rel=1e-9)


def test_alpha_does_not_count():
    guide = np.random.default_rng(2).random((4, 5, 3)).astype(np.float32)
    with_alpha = np.dstack([guide, np.random.default_rng(3).random((4, 5))])
    for one, other in zip(conductances(guide, 1), conductances(with_alpha, 1), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("size", [(1, 1), (1, 4), (4, 1)])
def test_pictures_of_one_row_or_column(size):
    right, down = conductances(np.zeros((*size, 3)), 1.0)
    assert right.shape == (size[0], size[1] - 1)
    assert down.shape == (size[0] - 1, size[1])


def test_the_exact_solution_balances_every_free_pixel():
    rng = np.random.default_rng(4)
    guide, labels = 0.5 + 0.05 * rng.standard_normal((9, 11, 3)), np.zeros((9, 11), np.uint16)
    labels[2, 3], labels[7, 8], labels[0, 10] = 1, 2, 3
    solution = exact_diffusion.solve(labels, 3, guide, 0.8)
    right, down = conductances(guide, 0.8)
    flow = np.zeros_like(solution)
    across, along = right * np.diff(solution, axis=2), down * np.diff(solution, axis=1)
    flow[:, :, :-1] += across
    flow[:, :, 1:] -= across
    flow[:, :-1] += along
    flow[:, 1:] -= along
    assert abs(flow[:, labels == 0]).max() < 1e-12
    np.testing.assert_array_equal(solution[:, labels > 0].T, np.eye(3)[labels[labels > 0] - 1])
    np.testing.assert_allclose(solution.sum(axis=0), 1, atol=1e-12)


def test_without_scribbles_the_exact_solution_is_the_first_shutter():
    np.testing.assert_array_equal(exact_diffusion.solve(np.zeros((3, 4), np.uint16), 2)[0], 1)
