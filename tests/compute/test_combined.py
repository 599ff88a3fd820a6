"""Lightest, darkest and median: both devices against the float64 reference, and that against what it has to be."""

import dataclasses

import numpy as np
import pytest
from test_composition import check, footage, state

from shutter_addon.core.model.frame_state import Combine, Following
from shutter_addon.core.pixels import compositor


def combining(rng, *combines, window=9, **options):
    return dataclasses.replace(state(rng, window, (), len(combines), **options), combines=combines)


@pytest.mark.parametrize("mode", ["lightest", "darkest", "median"])
@pytest.mark.parametrize("window", [2, 64, 256])
def test_windows_of_any_length(device, mode, window):
    """A long median of any light takes more iterations than a software renderer has."""
    rng = np.random.default_rng(window)
    moment = combining(rng, *[Combine(mode)] * 2, window=window)
    kind = {"dtype": np.float32, "transfer": "linear"} if (mode, window) == ("median", 256) else {}
    check(device, footage(rng, count=window + 3, size=(9, 7), **kind), moment, 1)


@pytest.mark.parametrize("follows", [False, True])
def test_the_shown_frame_may_be_left_out(device, follows):
    """Played in reverse, a filmed frame begins with its last moment, which the clip's end does not have."""
    rng = np.random.default_rng(6)
    moment = combining(rng, Combine("lightest", threshold=0.4, softness=0.3), edges="shorten", step=4)
    if follows:
        shifts = np.arange(20)[:, None] * (0.7 - 0.3j)
        moment = dataclasses.replace(moment, following=Following(0, np.ones((20, 1), complex), shifts))
    source = footage(rng)
    source.frames[..., :3] //= 2
    check(device, source, moment, 19, -1)


# What the reference has to be


def test_a_median_is_continuous():
    """Between the samples beside the middle, as their weights change by a little."""
    values = np.array([0.0, 1.0])
    shares = np.linspace(0.49, 0.51, 4001)
    found = compositor.weighted_median(np.broadcast_to(values[:, None], (2, 4001)), np.stack([shares, 1 - shares]))
    assert found[0] == 1
    assert found[-1] == 0
    assert found[2000] == pytest.approx(0.5, abs=1e-6)
    assert np.abs(np.diff(found)).max() < 0.03
