"""Exposures that follow something, on all devices, against the float64 reference and a subject that moves by keys."""

from dataclasses import replace

import numpy as np
import pytest
from test_composition import check, few_pieces, footage, state
from test_shots import SHOTS, shots_of

from shutter_addon.compute import window
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.model.frame_state import Following
from shutter_addon.core.model.scribbles import Shape


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


@pytest.mark.parametrize("edges", ["hold", "mirror", "shorten", "slide"])
@pytest.mark.parametrize(("index", "direction"), [(5, 1), (12, -1), (13, 1)])
def test_windows_end_at_cuts(device, edges, index, direction):
    """What is seen of a frame of the shot in place of one beyond, lies where that frame has it."""
    rng = np.random.default_rng(41)
    source, options = shots_of(np.uint8), {"edges": edges, "position": "center"}
    for moment in (state(rng, **options), few_pieces(rng, 12, **options)):
        check(device, source, following(rng, source, moment, (0, 1)), index, direction, SHOTS[index])


def test_most_shutters_and_frames(gpu_device):
    """More turns of loops than a software renderer goes through, were each pixel to pass all pieces."""
    rng = np.random.default_rng(40)
    source = footage(rng, count=256, size=(16, 4))
    shapes = tuple(Shape(i, "line", 0, (np.array([[x, 0.1], [x, 0.9]]),)) for i, x in enumerate(rng.random(32)))
    moment = replace(state(rng, 256, shapes, 32), bars=rng.random((32, 256)))
    check(GPUCompositor(gpu_device), source, following(rng, source, moment, range(32)), 0)


@pytest.mark.parametrize("resident", [True, False])
def test_frames_in_several_textures(device, monkeypatch, resident):
    """As of windows for which a device has no room in one."""
    rng = np.random.default_rng(35)
    source = footage(rng)
    monkeypatch.setattr(window, "BAND_BYTES", 7 * (source.width + window.RIM) * (source.height + window.RIM) * 8)
    if not resident:
        monkeypatch.setattr(window, "beside", lambda *_: 1 << 50)
    for options in ({"edges": "mirror"}, {"edges": "shorten"}):
        moment = following(rng, source, state(rng, **options), (0, 1))
        moment.bars[2, :6] = 0
        for index in (2, 14):
            check(device, source, moment, index)


def test_following_nothing_changes_no_bit(device):
    """Nor does what is followed by a shutter that holds nowhere, or what stands still."""
    rng = np.random.default_rng(37)
    source, moment = footage(rng), state(rng, shapes=())
    plain = Renderer(device, source).picture(Request(3, moment))
    assert np.array_equal(Renderer(device, source).picture(Request(3, following(rng, source, moment, (1, 2)))), plain)
    still = Following(0, np.ones((20, 3), complex), np.zeros((20, 3), complex))
    assert still.of(slice(None)) is None


def test_frames_that_are_left_out_are_not_read(device):
    """Whatever lies in their place: of what is no number not even none must be taken."""
    rng = np.random.default_rng(39)
    source = footage(rng, dtype=np.float16)
    source.frames[16] = np.nan
    renderer = Renderer(device, source)
    for index in (14, 18):
        moment = following(rng, source, state(rng, edges="shorten"))
        picture = renderer.picture(Request(index, moment))
    assert np.isfinite(picture).all()
