"""What outlines enclose, how they are pulled, and how curves of successive drawings are paired.

tests/differential has how much they cover of a pixel.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shutter_addon.core import scanlines
from shutter_addon.core.model import outlines, scribbles

SQUARE = [[(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)]]


@pytest.mark.parametrize("strokes", [[], [[]], [[(0.5, 0.5)]], [[(0.1, 0.1), (0.9, 0.9)]], [[(2, 2), (3, 2), (3, 3)]]])
def test_what_encloses_nothing(strokes):
    assert not outlines.coverage(strokes, 16, 9).any()


ASPECT = 2.0


def circle(x, y, radius, points=40, turned=1, start=0.0):
    angle = start + turned * np.linspace(0, 2 * np.pi, points, endpoint=False)
    return [(x + radius * np.cos(a) / ASPECT, y + radius * np.sin(a)) for a in angle]


CIRCLE = tuple(circle(0.5, 0.5, 0.2))


def test_the_nearest_curve():
    square = outlines.curves(SQUARE)[0]
    assert outlines.nearest((square, CIRCLE), (0.61, 0.5), ASPECT) == pytest.approx((1, 0.02), abs=1e-3)
    assert outlines.nearest((square, CIRCLE), (0.3, 0.5), ASPECT) == pytest.approx((0, 0.1), abs=1e-3)


@given(st.floats(0, 6.28), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(0.02, 2))
def test_a_curve_that_is_pulled(angle, right, up, reach):
    """It goes through the place that the pointer is at, nothing beyond the reach moves, nor do other curves."""
    grabbed, square = (0.5 + 0.1 * np.cos(angle), 0.5 + 0.2 * np.sin(angle)), outlines.curves(SQUARE)[0]
    other, pulled = outlines.dragged((square, CIRCLE), 1, grabbed, (right, up), reach, ASPECT)
    assert other == square
    moved = (grabbed[0] + right, grabbed[1] + up)
    assert np.hypot(*((np.array(pulled) - moved) * (ASPECT, 1)).T).min() <= reach / 12 + 0.002
    far = [(x, y) for x, y in CIRCLE if np.hypot(ASPECT * (x - grabbed[0]), y - grabbed[1]) > 1.1 * reach + 0.002]
    assert set(far) <= set(pulled)


def test_what_lies_opposite_is_not_pulled_along():
    """The other side of a thin arm is near to the pointer, and far along the curve."""
    arm = ((0.1, 0.5), (0.9, 0.5), (0.9, 0.51), (0.1, 0.51))
    (pulled,) = outlines.dragged((arm,), 0, (0.5, 0.51), (0, 0.1), 0.1, 1.0)
    assert max(y for _x, y in pulled) == pytest.approx(0.61, abs=1e-3)
    assert min(y for _x, y in pulled) == 0.5


def test_many_points_take_no_more_memory(monkeypatch):
    """Rows are covered in bands, which changes nothing of what is covered."""
    strokes = [np.random.default_rng(2).random((300, 2)) * 1.4 - 0.2]
    whole = outlines.coverage(strokes, 64, 48)
    # These are what takes the memory.
    looked, crossings = [], scanlines.crossings

    def counted(*arguments):
        looked.append(crossings(*arguments))
        return looked[-1]

    monkeypatch.setattr(scanlines, "crossings", counted)
    monkeypatch.setattr(outlines, "_CROSSINGS", 10_000)  # likewise
    assert (outlines.coverage(strokes, 64, 48) == whole).all()
    assert max(len(rows) for rows, *_ in looked) <= 10_000 < sum(len(rows) for rows, *_ in looked)


def test_what_is_drawn_is_covered_and_goes_straight_in_between():
    """Whichever way round it is drawn, from wherever, with however many points, and a hole stays one."""
    large, hole, apart = circle(0.3, 0.5, 0.2), circle(0.3, 0.5, 0.1), circle(0.7, 0.5, 0.1)
    second = [circle(0.72, 0.5, 0.1, 25, -1, 2.0), circle(0.4, 0.5, 0.15), circle(0.4, 0.5, 0.25, 70, -1, 1.0)]
    drawn = [[large, hole, apart], second]
    ordered = outlines.in_order(drawn, ASPECT)
    for curves, found in zip(drawn, ordered, strict=True):
        assert np.abs(outlines.coverage(found, 320, 160) - outlines.coverage(curves, 320, 160)).mean() < 0.002
    between = [circle(0.35, 0.5, 0.225), circle(0.35, 0.5, 0.125), circle(0.71, 0.5, 0.1)]
    found = scribbles.between_strokes(*ordered, 0.5, ASPECT)
    assert np.abs(outlines.coverage(found, 320, 160) - outlines.coverage(between, 320, 160)).mean() < 0.002


def test_what_stays_is_itself_where_another_curve_goes():
    """The larger one leaves the picture and comes back; what lies far away is another one."""
    gone, stays = circle(0.2, 0.5, 0.15), circle(0.8, 0.5, 0.05)
    first, second, third = outlines.in_order([[gone, stays], [stays], [gone, stays]], ASPECT)
    for found in (scribbles.between_strokes(first, second, 0.5, ASPECT), scribbles.between_strokes(second, third, 0.5)):
        assert np.abs(np.mean(found[0], axis=0) - (0.8, 0.5)).max() < 0.01


@pytest.mark.parametrize("drawn", [[], [[]], [[[(0.1, 0.1), (0.5, 0.5)]]]])
def test_nothing_is_no_curve(drawn):
    assert not any(outlines.in_order(drawn, ASPECT))
