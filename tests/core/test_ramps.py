"""Mattes as plain data: where ramps lie, and which frame of a file is shown."""

import numpy as np
import pytest

from shutter_addon.core.frames.retiming import StripTiming
from shutter_addon.core.model import mattes
from shutter_addon.core.model.mattes import FileFrames, Ramp

WIDTH, HEIGHT = 64, 36


def at(values, x, y):
    """The value at a place in pixels, y down, between four centres of pixels."""
    column, row = int(x - 0.5), int(y - 0.5)
    across, down = x - 0.5 - column, y - 0.5 - row
    box = values[row : row + 2, column : column + 2].astype(float)
    return (box[0] * (1 - down) + box[1] * down) @ [1 - across, across]


def test_a_linear_ramp_goes_from_edge_to_edge():
    columns = (np.arange(WIDTH) + 0.5) / WIDTH
    rows = (HEIGHT - np.arange(HEIGHT) - 0.5)[:, None] / HEIGHT  # y is up
    expected = {0: columns, 180: 1 - columns, 90: rows, -90: 1 - rows}
    for rotation, values in expected.items():
        found = Ramp("linear", rotation=rotation).values(WIDTH, HEIGHT)
        assert found.shape == (HEIGHT, WIDTH)
        assert np.abs(found - values).max() < 1e-6


@pytest.mark.parametrize("rotation", [20, 45, 110, 200])
def test_a_turned_ramp_goes_from_corner_to_corner(rotation):
    found = Ramp("linear", rotation=rotation).values(WIDTH, HEIGHT)
    turn = np.radians(rotation)
    gradient = -np.gradient(found.astype(float))[0][5, 5], np.gradient(found.astype(float))[1][5, 5]  # up, right
    assert np.arctan2(*gradient) % (2 * np.pi) == pytest.approx(turn % (2 * np.pi), abs=1e-3)
    half = np.hypot(*gradient) / 2  # the outermost pixels' centres lie within half a pixel's diagonal
    assert 0 <= found.min() <= 2 * half
    assert 1 - 2 * half <= found.max() <= 1


def test_a_ramp_is_placed_about_the_pictures_centre():
    moved = Ramp("linear", location=(0.25, 0), scale=0.5).values(WIDTH, HEIGHT)
    x = (np.arange(WIDTH) + 0.5) / WIDTH
    assert np.abs(moved - np.clip((x - 0.75) / 0.5 + 0.5, 0, 1)).max() < 1e-6
    assert (Ramp("linear", scale=0).values(WIDTH, HEIGHT) > 0.5).tolist() == [[x > 0.5 for x in x]] * HEIGHT
    assert np.allclose(Ramp("linear", scale=-1).values(WIDTH, HEIGHT), (1 - x)[None], atol=1e-6)


def test_a_radial_ramp_ends_in_the_farthest_corner():
    found = Ramp("radial", location=(0, 0.25), scale=0.5).values(WIDTH, HEIGHT)
    y, x = np.indices((HEIGHT, WIDTH)) + 0.5
    far = np.hypot(WIDTH, HEIGHT) / 2
    expected = np.hypot(x - WIDTH / 2, y - HEIGHT / 4) / (far / 2)
    assert np.abs(found - np.minimum(expected, 1)).max() < 1e-5


def test_an_angle_goes_round_clockwise_from_the_top():
    found = Ramp("angle").values(WIDTH, HEIGHT)
    centre = WIDTH / 2, HEIGHT / 2
    assert at(found, centre[0] + 10, centre[1]) == pytest.approx(0.25, abs=1e-3)
    assert at(found, centre[0], centre[1] + 10) == pytest.approx(0.5, abs=1e-3)
    assert at(found, centre[0] - 10, centre[1]) == pytest.approx(0.75, abs=1e-3)
    assert found[3, WIDTH // 2] < 0.02
    assert found[3, WIDTH // 2 - 1] > 0.98
    turned = Ramp("angle", rotation=90).values(WIDTH, HEIGHT)  # counter-clockwise: it starts on the left
    assert at(turned, centre[0], centre[1] - 10) == pytest.approx(0.25, abs=1e-3)


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
