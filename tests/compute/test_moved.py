"""Exposures that follow something, on all devices, against the float64 reference and a subject that moves by keys."""

from dataclasses import replace

import numpy as np
import pytest
from test_composition import ROUNDED, SHAPES, check, device, few_pieces, footage, state  # noqa: F401
from test_shots import SHOTS, shots_of

from shutter_addon.compute import window
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.frames import light
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


@pytest.mark.parametrize("interpolation", ["displacement", "value"])
@pytest.mark.parametrize("edges", ["hold", "mirror", "shorten", "slide"])
@pytest.mark.parametrize(("index", "direction"), [(1, 1), (18, 1), (2, -1)])
def test_ends_of_the_clip(device, interpolation, edges, index, direction):  # noqa: F811
    rng = np.random.default_rng(32)
    source = footage(rng)
    moment = state(rng, interpolation=interpolation, edges=edges, position="center", aggregate=2)
    moment.bars[1, : 8 if index > 9 else 14] = 0  # of which nothing is left beyond the end
    moment.bars[1, -1] = 0.5
    check(device, source, following(rng, source, moment, (0, 1)), index, direction)


@pytest.mark.parametrize("edges", ["hold", "mirror", "shorten", "slide"])
@pytest.mark.parametrize(("index", "direction"), [(5, 1), (12, -1), (13, 1)])
def test_windows_end_at_cuts(device, edges, index, direction):  # noqa: F811
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
def test_frames_in_several_textures(device, monkeypatch, resident):  # noqa: F811
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


def test_levels(device, monkeypatch):  # noqa: F811
    """By one pass, and by several of which the last one alone makes levels."""
    rng = np.random.default_rng(41)
    source = footage(rng)
    moment = following(rng, source, state(rng), (0, 2))
    for most in (window.BAND_BYTES, 7 * (source.width + window.RIM) * (source.height + window.RIM) * 8):
        monkeypatch.setattr(window, "BAND_BYTES", most)
        renderer = Renderer(device, source)
        picture, levels = renderer.picture(Request(5, moment)), renderer.picture(Request(5, moment, levels=True))
        renderer.release_window()
        assert np.abs(levels - 255 * light.to_encoded(picture.astype(np.float64))).max() <= ROUNDED


def test_following_nothing_changes_no_bit(device):  # noqa: F811
    """Nor does what is followed by a shutter that holds nowhere, or what stands still."""
    rng = np.random.default_rng(37)
    source, moment = footage(rng), state(rng, shapes=())
    plain = Renderer(device, source).picture(Request(3, moment))
    assert np.array_equal(Renderer(device, source).picture(Request(3, following(rng, source, moment, (1, 2)))), plain)
    still = Following(0, np.ones((20, 3), complex), np.zeros((20, 3), complex))
    assert still.of(slice(None)) is None


def test_chunks_have_the_same_bits(device):  # noqa: F811
    rng = np.random.default_rng(38)
    source = footage(rng)
    moments = [following(rng, source, state(rng)) for _ in range(4)]
    renderer = Renderer(device, source)
    in_order = [renderer.picture(Request(index, moment)) for index, moment in enumerate(moments)]
    for index in (3, 1, 0, 2):
        assert np.array_equal(Renderer(device, source).picture(Request(index, moments[index])), in_order[index])


def test_frames_that_are_left_out_are_not_read(device):  # noqa: F811
    """Whatever lies in their place: of what is no number not even none must be taken."""
    rng = np.random.default_rng(39)
    source = footage(rng, dtype=np.float16)
    source.frames[16] = np.nan
    renderer = Renderer(device, source)
    for index in (14, 18):
        moment = following(rng, source, state(rng, edges="shorten"))
        picture = renderer.picture(Request(index, moment))
    assert np.isfinite(picture).all()
