"""Mattes as plain data: where ramps lie, and which frame of a file is shown."""

import numpy as np
import pytest

from shutter_addon.core.model import mattes
from shutter_addon.core.model.mattes import Ramp
from shutter_addon.core.model.motions import Placement

WIDTH, HEIGHT = 64, 36


@pytest.mark.parametrize("kind", ["linear", "radial", "angle"])
def test_a_negative_scale_turns_a_ramp_round(kind):
    place = {"location": (0.1, 0.05), "rotation": 20.0}
    found = Ramp(kind, Placement(scale=-0.5, **place))
    turned = Ramp(kind, Placement(scale=0.5, **place | {"rotation": 200.0}))
    assert np.abs(found.values(WIDTH, HEIGHT) - turned.values(WIDTH, HEIGHT)).max() < 1e-6


def test_values_stay_within_0_and_1():
    rng = np.random.default_rng(1)
    for _ in range(50):
        kind = ("linear", "radial", "angle")[rng.integers(3)]
        numbers = tuple(rng.normal(0, 3, 2)), rng.normal(0, 1e4), rng.normal(0, 2) * (rng.random() > 0.1)
        found = Ramp(kind, Placement(*numbers)).values(9, 14)
        assert found.dtype == np.float32
        assert 0 <= found.min() <= found.max() <= 1


def test_blended_leaves_what_it_is_given():
    coefficients = np.array([1.0, 0.0]).reshape(2, 1, 1)
    matte = mattes.Matte(1, Ramp("linear"))
    found = mattes.blended(coefficients, (matte,), [matte.content.values(4, 2)])
    assert found.shape == (2, 2, 4)
    assert coefficients.ravel().tolist() == [1, 0]
