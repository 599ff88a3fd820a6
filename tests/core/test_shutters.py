"""The mathematics of shutters, as properties of random bars."""

from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from shutter_addon.core.model import shutters, windows
from shutter_addon.core.model.frame_state import Options

BAR = st.one_of(st.just(0.0), st.floats(1e-3, 1.0))


@st.composite
def bars_lists(draw, most=4):
    n, length = draw(st.integers(1, most)), draw(st.integers(1, 40))
    bars = draw(arrays(np.float64, (n, length), elements=BAR))
    assume((bars.sum(axis=1) > 0).all())
    return bars


def test_a_box_has_two_knots_whatever_its_length():
    for shape in ((1, 200), (3, 64)):
        assert len(shutters.knots(np.ones(shape)).z) == 2


@pytest.mark.parametrize(
    ("bars", "sentence"),
    [
        ([], "1 to 256"),
        ([1.0] * 257, "1 to 256"),
        ([[1.0]], "1 to 256"),
        ([0.0, 0.0], "never opens"),
        ([1.0, -0.1], "negative"),
        ([1.0, float("nan")], "finite"),
        ([1.0, float("inf")], "finite"),
        ([1.0, 1e6 + 0.1], "above a million"),
        ([1e308] * 256, "above a million"),
        ([1e-46], "less than a millionth"),
        ([1e-40] * 256, "less than a millionth"),
    ],
)
def test_no_shutter(bars, sentence):
    with pytest.raises(shutters.ShutterError, match=sentence):
        shutters.check_bars(bars)


def test_a_shutter_is_one_as_float32_too():
    """What a recipe may hold, Blender's properties can: of the smallest numbers they keep none."""
    for bars in ([1e-6], [1e-7] * 10, [1e6] * 256, [1e-46, 1.0], [0.1, 1e-40]):
        shutters.check_bars(bars)
        shutters.check_bars(np.float32(bars))


@given(bars_lists(most=1), st.integers(1, 80))
def test_another_window_keeps_light_and_shape(bars, window):
    """At every boundary of the new bars, as large a share of the light has been gathered."""
    found = shutters.resample(bars[0], window)
    assert found.shape == (window,)
    assert (found >= -1e-12).all()
    assert found.mean() == pytest.approx(bars[0].mean())
    new, old = (shutters.accumulation(each) for each in (found, bars[0]))
    at = np.linspace(0, 1, window + 1)
    assert new == pytest.approx(np.interp(at, np.linspace(0, 1, len(old)), old), abs=1e-9)


@given(st.integers(1, 256), st.floats(0.01, 360), st.floats(0.01, 100))
def test_a_disc_has_its_angle_however_bright_it_is(window, degrees, gain):
    bars = gain * np.clip(window * degrees / 360 - np.arange(window), 0, 1)
    # A slit narrower than one bar is a dimmer bar: its angle is that bar's.
    assert shutters.open_angle(bars) == pytest.approx(max(degrees, 360 / window))
    assert shutters.open_angle(0 * bars) == 0


STEPS, POSITION = st.sampled_from([1, 2, 4, 8, 16]), st.sampled_from(["start", "center", "end"])


def test_in_one_step_bars_are_what_they_are():
    bars = [0.0, 0.5, 1.0, 0.0, 0.25]
    assert shutters.filmed(np.array(bars), 1, "end", np.array).bars.tolist() == bars
    for found in (shutters.smoothed(bars, 1), shutters.smoothed(bars, 1, backward=True), shutters.held(bars, 1)):
        assert found.tolist() == bars


@given(bars_lists(most=1), STEPS, st.booleans())
def test_a_level_streak_has_the_same_light(bars, steps, backward):
    """Open where the other is; and filmed frames stand to one another as their bars."""
    found = shutters.smoothed(bars[0], steps, backward=backward, level=True)
    assert found.sum() == pytest.approx(bars[0].sum())
    assert ((found > 0) == (shutters.smoothed(bars[0], steps, backward=backward) > 0)).all()
    frames = found[steps - 1 :: steps] if backward else found[::steps]
    assert frames / frames.max() == pytest.approx(bars[0] / bars[0].max())


def test_what_rounding_leaves_opens_no_bar():
    for level in (False, True):
        moments = shutters.smoothed([1e-12, 1.0, 0.0, 1e-13], 8, level=level)
        assert moments == pytest.approx(np.eye(32)[8], abs=1e-9)


@given(bars_lists(most=1), STEPS, POSITION, st.sampled_from([1, -1]))
def test_bars_of_moments_become_those_of_filmed_frames(bars, steps, position, direction):
    """Each filmed frame keeps its light, wherever a window of moments began and ended around the shown one."""

    def of_frames(weights, step):
        positions = windows.positions(Options(len(weights), position, step=step), 100 * step, direction)
        frames = np.zeros(200)
        np.add.at(frames, positions // step, weights)
        return frames

    found = shutters.filmed(bars[0], steps, position, partial(shutters.held, steps=steps)).bars
    assert len(found) == -(-len(bars[0]) // steps)
    assert of_frames(found, 1) * steps == pytest.approx(of_frames(bars[0], steps))


@pytest.mark.parametrize("name", shutters.PRESETS)
def test_every_preset_is_a_shutter(name):
    """All but the still frame count the frames of the window, wherever the shown one is."""
    for window in (1, 2, 3, 8, 64, 256):
        bars = shutters.check_bars(shutters.preset_bars(name, window))
        assert len(bars) == window
        assert bars.max() <= 1
        assert name == "STILL" or shutters.preset_bars(name, window, "end").tolist() == bars.tolist()


def test_shapes():
    assert shutters.still(4, 9).tolist() == [0, 0, 0, 1]
    assert shutters.angle(8, 180).tolist() == [1, 1, 1, 1, 0, 0, 0, 0]
    assert shutters.angle(8, 45).tolist() == [1, 0, 0, 0, 0, 0, 0, 0]
    assert shutters.angle(6, 45).tolist() == [0.75, 0, 0, 0, 0, 0]
    assert shutters.angle(8, 360).tolist() == [1] * 8
    assert shutters.cuts(8, 2).tolist() == [1, 0, 0, 0, 1, 0, 0, 0]
    assert shutters.cuts(9, 3, 2).tolist() == [1, 1, 0, 1, 1, 0, 1, 1, 0]
    assert shutters.ramp_up(4).tolist() == [0.25, 0.5, 0.75, 1]
    assert shutters.ramp_down(4).tolist() == [1, 0.75, 0.5, 0.25]
    assert shutters.triangle(5) == pytest.approx([0.2, 0.6, 1, 0.6, 0.2])
    assert shutters.stutter(8, 3).tolist() == [1, 0, 0, 1, 0, 0, 1, 0]

    g = shutters.gaussian(101, 0.1)
    assert g.argmax() == 50
    assert g[60] / g[50] == pytest.approx(np.exp(-0.5 * (10 / 10.1) ** 2))
    t = shutters.trail(100, 0.25)
    assert t[0] == 1
    assert t[25] == pytest.approx(np.exp(-1))
    # Presets have parameters of their own.
    assert shutters.preset_bars("STUTTER", 8).tolist() == [1, 0, 0, 0, 1, 0, 0, 0]
    assert shutters.preset_bars("CUTS", 8).tolist() == [1, 0, 1, 0, 1, 0, 1, 0]
    assert shutters.preset_bars("ANGLE_90", 8).tolist() == [1, 1, 0, 0, 0, 0, 0, 0]
