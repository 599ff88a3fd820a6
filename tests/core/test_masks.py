"""What masks and ramps cover, beside what tests/blender/test_mask_reading.py compares with Blender's own Mask strip."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shutter_addon.core.model import mattes
from shutter_addon.core.model.masks import MaskLayer, MaskShape, MaskSpline
from shutter_addon.core.model.mattes import Ramp
from shutter_addon.core.model.motions import Placement

RECTANGLE = ((0.25, 0.35), (0.25, 0.65), (0.75, 0.65), (0.75, 0.35))


def straight(corners, weight=0.0, **options):
    """A spline of straight lines; clockwise ones have their feather outside."""
    corners, ends = np.asarray(corners, float), (np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0))
    points = np.stack([corners + (ends[0] - corners) / 3, corners, corners + (ends[1] - corners) / 3], axis=1)
    weights = (weight,) * len(corners)
    points = tuple(tuple(map(tuple, point)) for point in points.tolist())
    return MaskSpline(points, weights, ((),) * len(corners), **options)


def covered(splines, size, **layer):
    return MaskShape((MaskLayer(tuple(splines), **layer),)).values(*size)


def places(size):
    """Pixel centers (H, W, 2) in mask space."""
    width, height = size
    x, y = np.meshgrid(np.arange(width) + 0.5, height - 0.5 - np.arange(height))
    larger = max(size)
    return np.stack([(x - width / 2) / larger + 0.5, (y - height / 2) / larger + 0.5], axis=-1)


@pytest.mark.parametrize("interpolation", ["LINEAR", "EASE"])
def test_feather_points_widen_their_segment(interpolation):
    size = 200, 200
    spline = straight(RECTANGLE, 0.05, weight_interpolation=interpolation)
    # The upper edge goes from left to right: a point in its middle, where the feather is thrice as wide.
    spline = replace(spline, feathers=((), ((0.5, 3.0),), (), ()))
    value = covered([spline], size, falloff="LINEAR")
    x, y = np.moveaxis(places(size), -1, 0)
    share = np.clip(1 - np.abs(x - 0.5) / 0.25, 0, 1)
    share = share if interpolation == "LINEAR" else share**2 * (3 - 2 * share)
    expected = np.clip(1 - (y - 0.65) / (0.05 + 0.1 * share), 0, 1)
    above = (np.abs(x - 0.5) < 0.23) & (y > 0.65) & (y < 0.8)
    # Between the normals of two points of the outline, values bend a little.
    assert np.abs(value - expected)[above].mean() < 0.004


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_points_cover_nothing(count):
    spline = straight(RECTANGLE[:count], cyclic=False) if count else MaskSpline((), (), ())
    value = covered([spline], (32, 18))
    assert (value.dtype, value.shape) == (np.float32, (18, 32))
    assert value.max(initial=0) < 1


def test_sizes_that_no_picture_has():
    for far in (1e4, 1e-9):
        corners = np.array([(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]) * far - far / 3
        value = covered([straight(corners, far / 10)], (32, 18))
        assert 0 <= value.min() <= value.max() <= 1


# On a coarse grid points coincide, lines lie on one another and cross in corners.
grid = st.tuples(st.integers(-1, 5), st.integers(-1, 5)).map(lambda place: (place[0] / 4, place[1] / 4))


@settings(max_examples=60)
@given(st.lists(st.lists(grid, min_size=1, max_size=6), min_size=1, max_size=3), st.data())
def test_no_mask_is_too_odd(polygons, data):
    splines = [
        straight(corners, data.draw(st.sampled_from([0, 0.1, -0.1, 2])), cyclic=data.draw(st.booleans()))
        for corners in polygons
    ]
    options = {name: data.draw(st.booleans()) for name in ("holes", "invert")}
    value = covered(splines, (16, 12), fill_solver=data.draw(st.sampled_from(["CDT", "SWEEP_LINE"])), **options)
    assert 0 <= value.min() <= value.max() <= 1


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
