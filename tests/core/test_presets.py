import numpy as np
import pytest

from shutter_addon.core.model import shutters


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


def test_presets_have_parameters_of_their_own():
    assert shutters.preset_bars("STUTTER", 8).tolist() == [1, 0, 0, 0, 1, 0, 0, 0]
    assert shutters.preset_bars("CUTS", 8).tolist() == [1, 0, 1, 0, 1, 0, 1, 0]
    assert shutters.preset_bars("ANGLE_90", 8).tolist() == [1, 1, 0, 0, 0, 0, 0, 0]
