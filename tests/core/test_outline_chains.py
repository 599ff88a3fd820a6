"""Curves that are joined to chains, as masks with shape keys have them."""

import numpy as np
import pytest

from shutter_addon.core.model import outlines

ASPECT, SIZE = 1.5, (240, 160)


def circle(x, y, radius, points=40, turned=1, start=0.0):
    angle = start + turned * np.linspace(0, 2 * np.pi, points, endpoint=False)
    return [(x + radius * np.cos(a) / ASPECT, y + radius * np.sin(a)) for a in angle]


def covered(chains, frame):
    """By the chains that are there, as a mask has them: straight from key to key, held beyond."""
    curves = []
    for chain in chains:
        if chain.frames[0] <= frame and (chain.gone is None or frame < chain.gone):
            flat = chain.points.reshape(len(chain.frames), -1).T
            curves.append(np.array([np.interp(frame, chain.frames, row) for row in flat]).reshape(-1, 2))
    return outlines.coverage(curves, *SIZE)


def test_what_is_drawn_is_covered_and_goes_straight_in_between():
    """Whichever way round it is drawn, from wherever, with however many points."""
    drawn = [
        (0, [circle(0.3, 0.5, 0.2), circle(0.7, 0.5, 0.1)]),
        (10, [circle(0.72, 0.5, 0.1, 25, -1, 2.0), circle(0.4, 0.5, 0.25, 70, -1, 1.0)]),
        (14, [circle(0.4, 0.5, 0.25), circle(0.75, 0.5, 0.1)]),
    ]
    chains = outlines.chains(drawn, ASPECT)
    assert [(chain.frames, chain.gone) for chain in chains] == [((0, 10, 14), None)] * 2
    for frame, curves in drawn:
        assert np.abs(covered(chains, frame) - outlines.coverage(curves, *SIZE)).mean() < 0.002
    between = [circle(0.35, 0.5, 0.225), circle(0.71, 0.5, 0.1)]
    assert np.abs(covered(chains, 5) - outlines.coverage(between, *SIZE)).mean() < 0.002


def test_curves_come_and_go():
    """A hole is a curve of its own, and none goes into what lies elsewhere."""
    large, hole, apart = circle(0.4, 0.5, 0.3), circle(0.4, 0.5, 0.15), circle(0.8, 0.2, 0.1)
    chains = outlines.chains([(2, [large]), (5, [hole, large]), (9, [apart, large]), (12, [apart])], ASPECT)
    assert sorted((chain.frames, chain.gone) for chain in chains) == [((2, 5, 9), 12), ((5,), 9), ((9, 12), None)]
    for frame, curves in ((2, [large]), (4, [large]), (5, [hole, large]), (8, [hole, large]), (12, [apart])):
        assert np.abs(covered(chains, frame) - outlines.coverage(curves, *SIZE)).mean() < 0.002, frame


@pytest.mark.parametrize("drawn", [[], [(1, [])], [(1, [[(0.1, 0.1), (0.5, 0.5)]])]])
def test_nothing_is_no_chain(drawn):
    assert outlines.chains(drawn, ASPECT) == []


def test_points_are_as_many_as_the_longest_needs():
    (chain,) = outlines.chains([(1, [circle(0.5, 0.5, 0.15)]), (2, [circle(0.5, 0.5, 0.4)])], ASPECT)
    assert chain.points.shape[0] == 2
    assert 200 < chain.points.shape[1] <= 256
