"""Curves of successive drawings, paired for what lies between."""

import numpy as np
import pytest

from shutter_addon.core.model import outlines, scribbles

ASPECT, SIZE = 1.5, (240, 160)


def circle(x, y, radius, points=40, turned=1, start=0.0):
    angle = start + turned * np.linspace(0, 2 * np.pi, points, endpoint=False)
    return [(x + radius * np.cos(a) / ASPECT, y + radius * np.sin(a)) for a in angle]


def test_what_is_drawn_is_covered_and_goes_straight_in_between():
    """Whichever way round it is drawn, from wherever, with however many points, and a hole stays one."""
    large, hole, apart = circle(0.3, 0.5, 0.2), circle(0.3, 0.5, 0.1), circle(0.7, 0.5, 0.1)
    second = [circle(0.72, 0.5, 0.1, 25, -1, 2.0), circle(0.4, 0.5, 0.15), circle(0.4, 0.5, 0.25, 70, -1, 1.0)]
    drawn = [[large, hole, apart], second]
    ordered = outlines.in_order(drawn, ASPECT)
    for curves, found in zip(drawn, ordered, strict=True):
        assert np.abs(outlines.coverage(found, *SIZE) - outlines.coverage(curves, *SIZE)).mean() < 0.002
    between = [circle(0.35, 0.5, 0.225), circle(0.35, 0.5, 0.125), circle(0.71, 0.5, 0.1)]
    found = scribbles.between_strokes(*ordered, 0.5, ASPECT)
    assert np.abs(outlines.coverage(found, *SIZE) - outlines.coverage(between, *SIZE)).mean() < 0.002


def test_what_stays_is_itself_where_another_curve_goes():
    """The larger one leaves the picture and comes back; what lies far away is another one."""
    gone, stays = circle(0.2, 0.5, 0.15), circle(0.8, 0.5, 0.05)
    first, second, third = outlines.in_order([[gone, stays], [stays], [gone, stays]], ASPECT)
    for found in (scribbles.between_strokes(first, second, 0.5, ASPECT), scribbles.between_strokes(second, third, 0.5)):
        assert np.abs(np.mean(found[0], axis=0) - (0.8, 0.5)).max() < 0.01


@pytest.mark.parametrize("drawn", [[], [[]], [[[(0.1, 0.1), (0.5, 0.5)]]]])
def test_nothing_is_no_curve(drawn):
    assert not any(outlines.in_order(drawn, ASPECT))
