import numpy as np
import pytest

from shutter_addon.core.model import keyframes


def test_span():
    frames = [1, 5, 9]
    assert keyframes.span(frames, 0) == (0, 0, 0)
    assert keyframes.span(frames, 1) == (0, 0, 0)
    assert keyframes.span(frames, 3) == (0, 1, 0.5)
    assert keyframes.span(frames, 5) == (1, 1, 0)
    assert keyframes.span(frames, 8) == (1, 2, 0.75)
    assert keyframes.span(frames, 9) == (2, 2, 0)
    assert keyframes.span(frames, 20) == (2, 2, 0)


def test_eases():
    assert keyframes.eased(0.3, "linear") == 0.3
    assert keyframes.eased(0.999, "constant") == 0
    assert keyframes.eased(1.0, "constant") == 1
    assert keyframes.eased(0.25, "bezier") == pytest.approx(0.15625)
    assert [keyframes.eased(u, "bezier") for u in (0, 0.5, 1)] == [0, 0.5, 1]


def test_keyed_deltas_stay_one_sharp_frame():
    first, second = np.eye(9)[0], np.eye(9)[8]
    for k in range(9):
        assert keyframes.between_bars(first, second, k / 8) == pytest.approx(np.eye(9)[k], abs=1e-12)


def test_ends_are_exact():
    first, second = np.array([0.3, 0.7]), np.array([0.1, 0.2])
    assert np.array_equal(keyframes.between_bars(first, second, 0), first)
    assert np.array_equal(keyframes.between_bars(first, second, 1), second)
    assert keyframes.between_bars(first, second, 0.5).sum() == pytest.approx(0.65)


def test_bars_by_value_are_the_curves_own():
    assert keyframes.between_bars([1, 0, 3], [0, 2, 1], 0.25, "value") == pytest.approx([0.75, 0.5, 2.5])
