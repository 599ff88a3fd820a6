"""Ways along edges, from one point of an outline to the next."""

import numpy as np
import pytest

from shutter_addon.core.model import outlines
from shutter_addon.media import outlining

WIDTH, HEIGHT = 240, 160
RADIUS = 0.3


@pytest.fixture
def picture():
    """A bright disc before a dark ground, both of noise."""
    y, x = np.indices((HEIGHT, WIDTH))
    noise = np.random.default_rng(5).normal(0, 6, (HEIGHT, WIDTH, 3))
    inside = np.hypot(x + 0.5 - WIDTH / 2, y + 0.5 - HEIGHT / 2) < RADIUS * HEIGHT
    return np.clip(np.where(inside[..., None], 190, 70) + noise, 0, 255).astype(np.uint8)


def on_circle(count, radius=RADIUS):
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.stack([0.5 + radius * np.cos(angle) * HEIGHT / WIDTH, 0.5 + radius * np.sin(angle)], axis=1)


def way(picture, points):
    pairs = zip(points, np.roll(points, -1, axis=0), strict=True)
    return np.concatenate([outlining.along_edges(picture, *pair) for pair in pairs])


def common(curve):
    """With the disc, as its intersection over union."""
    disc = outlines.coverage([on_circle(200)], WIDTH, HEIGHT) > 0.5
    found = outlines.coverage([curve], WIDTH, HEIGHT) > 0.5
    return (disc & found).sum() / (disc | found).sum()


def test_six_points_are_enough_for_a_disc(picture):
    """Straight lines between them leave a sixth of it out; points may lie beside its edge."""
    points = on_circle(6)
    assert common(points) < 0.85
    assert common(way(picture, points)) > 0.97
    assert common(way(picture, on_circle(6, RADIUS + 2 / HEIGHT))) > 0.97


def test_what_is_short_or_outside_is_straight(picture):
    for ends in (((0.5, 0.8), (0.52, 0.8)), ((-0.1, 0.5), (0.5, 0.8))):
        np.testing.assert_array_equal(outlining.along_edges(picture, *map(np.array, ends)), ends)


def test_without_edges_it_is_about_straight():
    ends = np.array([[0.2, 0.3], [0.8, 0.6]])
    found = outlining.along_edges(np.full((HEIGHT, WIDTH, 3), 90, np.uint8), *ends)
    assert np.abs(found[[0, -1]] - ends).max() < 4 / HEIGHT
    assert len(found) < 12
