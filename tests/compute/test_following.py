"""Exposures that follow something, on all devices, against the float64 reference and a subject that moves by keys."""

from dataclasses import replace

import numpy as np
import pytest
from test_composition import Footage, check, device, footage, state  # noqa: F401

from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.core.frame_state import Following


def motions(rng, count, shutters, followers, size=(37, 23)):
    """Random motions of `count` source frames: turned, scaled and shifted by some pixels, some far."""
    turns, shifts = np.ones((count, shutters), complex), np.zeros((count, shutters), complex)
    for follower in followers:
        angle, scale = rng.uniform(-0.3, 0.3, count), rng.uniform(0.7, 1.4, count)
        turns[:, follower] = scale * np.exp(1j * angle)
        centre = complex(*size) / 2
        away = rng.normal(0, 4, (2, count)) * np.where(rng.random(count) < 0.1, 20, 1)
        shifts[:, follower] = centre - turns[:, follower] * centre + away[0] + 1j * away[1]
    return Following(0, turns, shifts)


def following(rng, source, moment, followers=(1,)):
    size = source.width, source.height
    return replace(moment, following=motions(rng, source.count, len(moment.bars), followers, size))


@pytest.mark.parametrize("interpolation", ["displacement", "value"])
@pytest.mark.parametrize("light", ["linear", "encoded"])
@pytest.mark.parametrize("followers", [(0,), (1, 2), (0, 1, 2)])
def test_random_motions(device, interpolation, light, followers):  # noqa: F811
    rng = np.random.default_rng(31)
    source = footage(rng)
    moment = state(rng, interpolation=interpolation, light=light, exposure="weighted")
    check(device, source, following(rng, source, moment, followers), 2)
