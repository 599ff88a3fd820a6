"""Mattes as plain data: where ramps lie, and which frame of a file is shown."""

import numpy as np
import pytest

from shutter_addon.core.frames.retiming import StripTiming
from shutter_addon.core.model import mattes
from shutter_addon.core.model.mattes import FileFrames, Ramp

WIDTH, HEIGHT = 64, 36


@pytest.mark.parametrize("kind", ["linear", "radial", "angle"])
def test_a_negative_scale_turns_a_ramp_round(kind):
    place = {"location": (0.1, 0.05), "rotation": 20.0}
    found, turned = Ramp(kind, scale=-0.5, **place), Ramp(kind, scale=0.5, **place | {"rotation": 200.0})
    assert np.abs(found.values(WIDTH, HEIGHT) - turned.values(WIDTH, HEIGHT)).max() < 1e-6


def test_values_stay_within_0_and_1():
    rng = np.random.default_rng(1)
    for _ in range(50):
        kind = ("linear", "radial", "angle")[rng.integers(3)]
        numbers = tuple(rng.normal(0, 3, 2)), rng.normal(0, 1e4), rng.normal(0, 2) * (rng.random() > 0.1)
        found = Ramp(kind, *numbers).values(9, 14)
        assert found.dtype == np.float32
        assert found.min() >= 0
        assert found.max() <= 1


class Opened:
    width, height, count, fps, step = 8, 8, 20, None, 1


def test_which_frame_of_a_file_is_shown():
    of_source, of_timeline = FileFrames("f", offset=3), FileFrames("f", offset=3, first=101)
    assert of_source.at(105).index(Opened, 7) == 10
    assert of_timeline.at(105).index(Opened, 7) == 7
    assert of_timeline.at(105.5).index(Opened, 7) == 7
    assert of_source.at(1) == of_source.at(2)  # what does not change with the timeline is equal
    timing = StripTiming("S", 0, 24.0, 101.0, 121.0, 0, 0, 101, True, 1.0)
    assert FileFrames("f", timing=timing).at(105).index(Opened, 7) == 15  # it plays in reverse


def test_blended_leaves_what_it_is_given():
    coefficients = np.array([1.0, 0.0]).reshape(2, 1, 1)
    matte = mattes.Matte(1, Ramp("linear"))
    found = mattes.blended(coefficients, (matte,), [matte.content.values(4, 2)])
    assert found.shape == (2, 2, 4)
    assert coefficients.ravel().tolist() == [1, 0]
