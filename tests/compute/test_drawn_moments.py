"""Moments between filmed frames, which devices make of the two frames and their vectors, beside the reference."""

import dataclasses

import numpy as np
import pytest
from test_composition import LEVEL, SHAPES, Footage, composed, few_pieces
from test_layered import with_layers

from shutter_addon.compute import running_sums
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.frames import light
from shutter_addon.core.model import shutters
from shutter_addon.core.model.frame_state import FrameState, Options
from shutter_addon.features.smooth.smooth import SmoothSource
from shutter_addon.media.cuts import ShotSource
from shutter_addon.media.matte_values import MatteValues

STEPS = 4
ALONE = FrameState(Options(1), np.ones((3, 1)))
ROUNDED = 0.6  # levels: half of one, and what a GPU's pow adds to its argument (0.062 on an NVIDIA H100)


def film(rng, count=6, size=(53, 38), dtype=np.uint8):
    """Soft blocks that move faster and faster, each picture with some that stand still, and a cut before the last."""
    blocks = rng.integers(0, 256, (2, size[1] // 6 + 4, size[0] // 6 + 8, 3)).repeat(6, 1).repeat(6, 2)
    for axis in (1, 2):
        blocks = sum(np.roll(blocks, k, axis) for k in range(-2, 3)) / 5
    frames = np.empty((count, size[1], size[0], 4))
    for k, frame in enumerate(frames):
        wide = blocks[int(k == count - 1)]
        frame[..., :3] = wide[2 : 2 + size[1], k * k : k * k + size[0]]
        frame[2:8, 4:14, :3] = wide[:6, :10]
    frames[..., 3] = 255
    most = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    return Footage((frames / 255 * most).round(0 if most > 1 else 6).astype(dtype))


class Moments(SmoothSource):
    """With all its frames for the reference, as Footage has them."""

    def linear(self):
        return Footage(np.stack([self.read(k) for k in range(self.count)])).linear()


def smooth(moment, steps=STEPS, direction=1):
    bars = np.stack([shutters.smoothed(row, steps, backward=direction < 0) for row in moment.bars])
    return dataclasses.replace(
        moment, bars=bars, options=dataclasses.replace(moment.options, window=len(bars[0]), step=steps)
    )


@pytest.mark.parametrize("steps", [2, 16])
@pytest.mark.parametrize("size", [(53, 38), (64, 40), (17, 9)])  # which vectors divide or do not; too few for any
def test_a_moment_alone(device, size, steps):
    """Of each moment, the picture is what `read` gives."""
    source = SmoothSource(film(np.random.default_rng(1), size=size), steps)
    for index in (1, steps // 2, steps + 1, 3 * steps - 1, 4 * steps - 1, 5 * steps - 1, source.count - 1):
        alone = FrameState(Options(1, step=steps), np.ones((1, 1)))
        picture = Renderer(device, source).picture(Request(index, alone))
        wanted = Footage(source.read(index)[None]).linear()[0]
        apart = np.abs(light.to_encoded(picture.astype(np.float64)) - light.to_encoded(wanted))
        assert apart.max() <= 1.1 * LEVEL
        assert (apart > ROUNDED * LEVEL).mean() < 0.1  # OpenCV rounds what lies halfway by weights of its own


def test_a_layers_matte_moves_with_its_subject(device):
    """At moments. One that stands still stays, and filmed frames need no footage."""
    height, width = 96, 160
    far, near = np.random.default_rng(4).random((2, 16, 40, 1)).repeat(6, 1).repeat(6, 2)
    x, y = np.meshgrid(np.arange(width), np.arange(height))

    def matte(time):
        return np.clip(25 - np.hypot(x - 40 - 8 * time, y - height / 2), 0, 1)

    discs = np.stack([matte(k) for k in range(3)])
    moved = np.stack([np.roll(near, 8 * k, axis=1) for k in range(3)])[:, :, :width]
    mixed = far[:, :width] + discs[..., None] * (moved - far[:, :width])
    frames = np.concatenate([mixed, mixed, mixed, np.ones_like(mixed)], axis=3) * 255
    filmed = Footage(np.rint(frames).astype(np.uint8))
    renderer = Renderer(device, SmoothSource(filmed, 4), MatteValues(width, height, 4))
    moving, still = (with_layers(ALONE, mattes)[0] for mattes in (discs, discs[[0, 0, 0]]))
    renderer.layer_mattes(Request(4, moving))
    assert filmed.reads == []
    for index in (6, 7):
        (found,) = renderer.layer_mattes(Request(index, moving))
        assert np.abs(found - matte(index / 4)).sum() < 0.5 * np.abs(matte(1) - matte(index / 4)).sum()
        np.testing.assert_allclose(renderer.layer_mattes(Request(index, still))[0], discs[0], atol=1e-4)


def repeating(steps):
    found = film(np.random.default_rng(8))
    found.frames = found.frames[[0, 1, 1, 2, 3, 3, 3, 4, 5]]
    found.count = len(found.frames)
    return Moments(found, steps, skip_repeats=True)


@pytest.mark.parametrize("steps", [2, 8])
def test_across_repeated_frames(device, steps):
    """Of pairs of frames that are two and three apart; what is left on the device of others changes nothing."""
    source = repeating(steps)
    moment = smooth(few_pieces(np.random.default_rng(9), 3), steps)
    kept = Renderer(device, source)
    for index in (0, steps, 2 * steps, 2 * steps + 1, 4 * steps, 5 * steps, 6 * steps - 1, steps):
        own = Renderer(device, repeating(steps))
        np.testing.assert_array_equal(kept.picture(Request(index, moment)), own.picture(Request(index, moment)))
        own.release()
    alone = FrameState(Options(1, step=steps), np.ones((1, 1)))
    for shown, frames in ((moment, (1, 2, 4, 6)), (alone, (2, 5, 6))):
        for index in frames:
            picture, expected = composed(device, source, shown, index * steps)
            apart = np.abs(light.to_encoded(picture.astype(np.float64)) - light.to_encoded(expected))
            assert apart.max() <= 1.1 * LEVEL  # as one moment alone may be rounded
    assert source.repeats


def test_filmed_frames_of_a_pair_are_sent_once(gpu_device, monkeypatch):
    """With the vectors of each moment, a sixteenth of a picture."""
    sent, own = [], running_sums.Sums._filmed  # nothing else tells what is sent

    def noted(sums, moment, *given):
        before = dict(sums._sent)  # by layer
        texture = own(sums, moment, *given)
        sent.extend(number for number in sums._sent.values() if number not in before.values())  # as above
        return texture

    monkeypatch.setattr(running_sums.Sums, "_filmed", noted)  # as above
    source = SmoothSource(film(np.random.default_rng(7)), 8)
    moment = smooth(FrameState(Options(4), np.ones((1, 4))), 8)
    Renderer(GPUCompositor(gpu_device), source).picture(Request(0, moment))
    assert sent == [0, 1, 2, 3]


def test_filmed_frames_are_not_read_again_to_guide(gpu_device):
    """Those that a pass adds with the moments before them are the diffusion's, too."""
    filmed = film(np.random.default_rng(8))
    filmed.frames = np.stack([np.roll(filmed.frames[0], k, axis=1) for k in range(30)])
    filmed.count = 30
    source = ShotSource(SmoothSource(filmed, 4), 4)
    options = Options(16, position="center", edge_aware=1.0, border=True, stop_at_cuts=False)
    moment = smooth(FrameState(options, np.ones((2, 16)), SHAPES[:1]))
    renderer = Renderer(GPUCompositor(gpu_device), source)
    for index in range(10, 18):
        renderer.picture(Request(4 * index, moment))
    assert len(filmed.reads) == len(set(filmed.reads))
