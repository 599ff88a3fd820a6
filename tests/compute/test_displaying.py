"""Devices make the levels of a picture that its display makes, to the bit, and ask it where they cannot tell."""

import numpy as np
import pytest

from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.core.pixels.shown_levels import Display, rounded
from shutter_addon.media import color

TRANSFERS = {"shown": color.shown, "blended": color.blended}


def pictures():
    """Light (H, W, 4): of all magnitudes, of 8-bit footage, beyond what is shown, and close to where levels end."""
    rng, shape = np.random.default_rng(0), (96, 130, 3)
    codes = rng.integers(0, 256, shape).astype(np.float32) / 255
    ends = (rng.integers(0, 256, shape) + 0.5) / 255 + rng.normal(0, 1e-6, shape)
    linear = ((ends + 0.055) / 1.055) ** 2.4
    for light in (np.exp2(rng.uniform(-14, 2, shape)), codes**2.2, rng.uniform(-0.5, 9, shape), linear, 0 * linear):
        yield np.concatenate([light, np.ones((*shape[:2], 1))], axis=-1).astype(np.float32)


@pytest.mark.parametrize("transfer", TRANSFERS)
@pytest.mark.parametrize("dither", [0.0, 1.0, 2.0])
def test_levels_are_the_displays(gpu_device, transfer, dither):
    display = Display(dither, TRANSFERS[transfer])
    compositor = GPUCompositor(gpu_device)
    with gpu_device.current():
        for light in pictures():
            height, width, _ = light.shape
            picture = gpu_device.texture(width, height, 1, "rgba32f")
            gpu_device.write(picture, light)
            found = compositor.shown(picture, display)
            expected = rounded(display.transfer(light[..., :3]) + display.noise(width, height)[..., None])
            assert np.array_equal(found[::-1, :, :3], expected)
            assert (found[..., 3] == 255).all()
            assert np.array_equal(CPUCompositor().shown(light[::-1], display), found)
            picture.release()


def test_the_display_is_asked_about_few_pixels(gpu_device):
    asked, light = [], next(pictures())
    for transfer in TRANSFERS.values():

        def counting(values, transfer=transfer):
            asked.append(values.size)
            return transfer(values)

        display = Display(1.0, counting)
        with gpu_device.current():
            compositor = GPUCompositor(gpu_device)
            picture = gpu_device.texture(light.shape[1], light.shape[0], 1, "rgba32f")
            gpu_device.write(picture, light)
            compositor.shown(picture, display)
            asked.clear()
            compositor.shown(picture, display)
            picture.release()
        assert 0 < sum(asked) < light.size / 50


def test_noise_is_a_triangle_about_nothing():
    noise = Display(1.0, color.shown).noise(640, 480)
    assert abs(noise.mean()) < 1e-5
    assert 0.0032 < noise.max() <= 0.0033
    assert noise.std() == pytest.approx(0.0033 * 6**-0.5, rel=0.02)
    assert not Display(0.0, color.shown).noise(8, 8).any()
