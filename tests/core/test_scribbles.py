"""Scribbles that are long, thin or far away. tests/differential has what others cover."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shutter_addon.core.model import scribbles
from shutter_addon.core.model.scribbles import Shape

coordinate = st.floats(-0.3, 1.3)
strokes = st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=6).map(np.array)


@settings(deadline=5000, max_examples=40)
@given(
    st.lists(st.tuples(st.floats(-math.pi, math.pi), st.floats(0, 39), st.floats(0, 1)), min_size=1, max_size=4),
    st.sampled_from([0.0, 0.05, 3.0, 1e6]),
    st.sampled_from(["line", "lasso"]),
)
def test_what_lies_far_outside_costs_nothing(corners, line_width, kind):
    away = [(10**far * math.cos(angle), 10**far * math.sin(angle)) for angle, far, _ in corners]
    stroke = np.array([p for place, (*_, near) in zip(away, corners, strict=True) for p in (place, (near, 0.5))])
    labels = scribbles.rasterise([Shape(0, kind, line_width, (stroke,))], 640, 360)
    assert labels.shape == (360, 640)


@pytest.mark.parametrize(("far", "line_width"), [(1e3, 0.0), (1e9, 0.0), (1e9, 0.1)])
def test_a_line_from_far_away_to_far_away(far, line_width):
    """The same as its part near the picture."""
    long = Shape(0, "line", line_width, (np.array([[-far, -far * 0.5], [far, far * 0.5]]) + 0.5,))
    short = Shape(0, "line", line_width, (np.array([[-4.0, -2.0], [4.0, 2.0]]) + 0.5,))
    different = scribbles.rasterise([long], 320, 180) != scribbles.rasterise([short], 320, 180)
    assert different.sum() <= 2  # pixels whose centers lie on its edge


def test_a_thick_line_of_many_points_is_soon_drawn():
    stroke = np.random.default_rng(0).random((5_000, 2))
    assert (scribbles.rasterise([Shape(0, "line", 1000.0, (stroke,))], 320, 180) == 1).all()


def test_a_lasso_that_holds_no_pixel_centre_marks_its_place_and_one_that_crosses_itself_has_no_hole():
    thin = np.array([[0.1, 0.5], [0.9, 0.501], [0.5, 0.5005]])
    assert (scribbles.rasterise([Shape(0, "lasso", 0, (thin,))], 20, 20) == 1).any()
    turns = np.linspace(0, 4 * np.pi, 60)
    spiral = np.stack([0.5 + 0.3 * np.cos(turns), 0.5 + 0.3 * np.sin(turns)], axis=1)
    assert scribbles.rasterise([Shape(0, "lasso", 0, (spiral,))], 50, 50)[25, 25] == 1


def test_the_thinnest_line_is_tight_for_a_diffusion():
    """No path of side-by-side pixels crosses it."""
    line = np.array([[-0.1, 0.13], [1.1, 0.92]])
    free = scribbles.rasterise([Shape(0, "line", 0, (line,))], 97, 61) == 0
    reached = np.zeros_like(free)
    reached[0] = free[0]
    for _ in range(400):
        spread = reached.copy()
        spread[1:] |= reached[:-1]
        spread[:-1] |= reached[1:]
        spread[:, 1:] |= reached[:, :-1]
        spread[:, :-1] |= reached[:, 1:]
        reached = spread & free
    assert reached[0].sum() > 0
    assert not reached[-1, -30:].any()


@settings(max_examples=30)
@given(strokes, st.integers(2, 20))
def test_resampling_keeps_the_ends_and_the_spacing(stroke, count):
    points = scribbles.resample(stroke, count)
    assert points.shape == (count, 2)
    assert np.allclose(points[0], stroke[0])
    if len(stroke) > 1 and not np.allclose(stroke, stroke[0]):
        assert np.allclose(points[-1], stroke[-1])
