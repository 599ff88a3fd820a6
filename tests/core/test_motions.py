"""A region's placements against the motion of its points, and keys against every frame between them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shutter_addon.core.model import motions, scribbles
from shutter_addon.core.model.motions import Placement, Similarity

coordinate = st.floats(-0.3, 1.3)
shapes = st.lists(st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=5), min_size=1, max_size=3)
placements = st.builds(
    Placement, st.tuples(st.floats(-2, 2), st.floats(-2, 2)), st.floats(-720, 720), st.floats(0.05, 20)
)
similarities = st.builds(
    lambda size, angle, x, y: Similarity(size * np.exp(1j * angle), complex(x, y)),
    st.floats(0.1, 10),
    st.floats(-3.1, 3.1),
    st.floats(-500, 500),
    st.floats(-500, 500),
)
sizes = st.tuples(st.integers(16, 2000), st.integers(16, 2000))


def shown(shape, placement, size):
    """The points of a placed shape as pixels x + iy, y down, as OpenCV counts them."""
    width, height = size
    strokes = scribbles.transform(shape, placement.location, placement.rotation, placement.scale, width / height)
    x, y = np.concatenate(strokes).T
    return x * width - 0.5 + 1j * ((1 - y) * height - 0.5)


@given(shapes, placements, similarities, sizes, st.tuples(coordinate, coordinate))
def test_a_carried_shape_lies_where_the_motion_takes_its_points(shape, placement, motion, size, shift):
    """Also if it is redrawn elsewhere."""
    centre, expected = motions.centre(shape), motion(shown(shape, placement, size))
    for by in ((0, 0), shift):
        redrawn = [np.asarray(stroke) + by for stroke in shape]
        carried = motions.carried(placement, motion, centre, centre + by, size)
        assert shown(redrawn, carried, size) == pytest.approx(expected, rel=1e-9, abs=1e-6)


@given(shapes, placements, similarities, sizes, st.complex_numbers(max_magnitude=1000))
def test_the_motion_between_two_placements_is_the_one_that_carried_the_shape(shape, placement, motion, size, point):
    centre = motions.centre(shape)
    carried = motions.carried(placement, motion, centre, centre, size)
    found = motions.motion_between(placement, carried, centre, centre, size)
    assert found(point) == pytest.approx(motion(point), rel=1e-7, abs=1e-5)


def test_a_rotation_goes_on_where_it_was():
    assert motions.unwound(Placement(rotation=-170), Placement(rotation=185)).rotation == 190
    assert motions.unwound(Placement(rotation=10), Placement(rotation=-3 * 360)).rotation == 10 - 3 * 360


def worst(track, keys, offsets, size):
    """How far in pixels a shape's points lie from where linear keys put them, at most, at any frame."""

    def at(numbers):
        x, y, rotation, scale = numbers
        turn = np.radians(rotation)
        matrix = scale * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        return (offsets * size) @ matrix.T + np.array([x, y]) * size

    def numbers(placement):
        return np.array([*placement.location, placement.rotation, placement.scale])

    table = np.array([numbers(track[key]) for key in keys])
    off = 0.0
    for frame, placement in track.items():
        between = [np.interp(frame, keys, column) for column in table.T]
        off = max(off, np.hypot(*(at(between) - at(numbers(placement))).T).max())
    return off


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(3, 60), st.floats(0.2, 5), st.sets(st.integers(0, 70), max_size=4))
def test_thinned_keys_lie_within_the_tolerance(seed, count, tolerance, kept):
    random = np.random.default_rng(seed)
    steps = np.cumsum(random.normal(0, (0.003, 0.003, 1, 0.004), (count, 4)), axis=0)
    frames = sorted(random.choice(80, count, replace=False).tolist())
    track = {n: Placement((x, y), turn, 1 + grown) for n, (x, y, turn, grown) in zip(frames, steps, strict=True)}
    offsets, size = random.uniform(-0.2, 0.2, (50, 2)), (640, 360)
    keys = motions.thinned(track, offsets, size, kept, tolerance)
    assert {frames[0], frames[-1], *kept & set(frames)} <= set(keys) <= set(frames)
    # of fifty points, those farthest in 32 directions are looked at
    assert worst(track, keys, offsets, size) <= 1.01 * tolerance


def test_a_straight_way_needs_its_ends_alone_and_a_bent_one_its_bends():
    def at(n):
        return Placement((0.01 * abs(n - 30), 0.0), 2.0 * n, 1 + 0.01 * n)

    offsets = np.array([[0.05, 0.0], [-0.05, 0.1]])
    assert motions.thinned({n: at(n) for n in range(61)}, offsets, (1920, 1080)) == [0, 30, 60]
    assert motions.thinned({n: at(n) for n in range(31)}, offsets, (1920, 1080)) == [0, 30]
    assert motions.thinned({n: at(n) for n in range(31)}, offsets, (1920, 1080), {7, 90}) == [0, 7, 30]
