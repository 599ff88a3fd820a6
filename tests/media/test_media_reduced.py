"""Smaller frames for previews, beside the means of the full ones."""

import numpy as np
import pytest
from footage import save_image

from shutter_addon.core.frames import light
from shutter_addon.media import open_source
from shutter_addon.media.reduced import reduced


def means(frame, divisor):
    """Of squares of an opaque frame, in float64; the last pixels go on."""
    height, width, channels = frame.shape
    down, right = -height % divisor, -width % divisor
    frame = np.pad(frame.astype(np.float64), ((0, down), (0, right), (0, 0)), mode="edge")
    return frame.reshape(frame.shape[0] // divisor, divisor, -1, divisor, channels).mean(axis=(1, 3))


@pytest.mark.parametrize("divisor", [2, 4])
def test_a_movie_becomes_smaller_as_it_is_converted(bunny, divisor):
    """What is averaged is what is shown, as where Blender makes pictures smaller: in linear light it would differ."""
    with open_source(bunny) as full, open_source(bunny, divisor=divisor) as small:
        assert (small.width, small.height, small.count) == (1280 // divisor, 720 // divisor, full.count)
        frame, shown = full.read(60), small.read(60).astype(np.float64)
    apart = np.abs(shown - means(frame, divisor))
    assert apart.mean() < 0.5
    assert apart.max() < 12
    linear = light.to_encoded(means(light.to_linear(frame[..., :3] / np.float32(255)), divisor)) * 255
    assert apart.mean() < np.abs(shown[..., :3] - linear).mean() / (2 if divisor == 4 else 1)


def test_ugly_movies_become_smaller(movies):
    """Turned, interlaced, with alpha, of odd sizes and with frames of other sizes."""
    for name, (path, _numbers) in movies.items():
        with open_source(path, deinterlace=True) as full, open_source(path, deinterlace=True, divisor=2) as small:
            assert (small.width, small.height) == (-(-full.width // 2), -(-full.height // 2)), name
            assert (small.count, small.alpha, small.dtype) == (full.count, full.alpha, full.dtype), name
            index = min(1, full.count - 1)
            frame = small.read(index)
            assert frame.shape == (small.height, small.width, 4), name
            assert frame.dtype == small.dtype, name
            scale = 255 / (np.iinfo(small.dtype).max)
            apart = np.abs(frame.astype(np.float64) - reduced(full.read(index), 2, full.alpha)) * scale
            assert apart.mean() < 4, name


@pytest.mark.parametrize(("suffix", "kind"), [("png", "uint8"), ("tif", "uint16"), ("exr", "half"), ("exr", "float")])
def test_images_of_an_odd_size(tmp_path, suffix, kind):
    values = np.random.default_rng(3).random((31, 45, 3), dtype=np.float32)
    path = save_image(tmp_path / f"picture_1.{suffix}", values, kind)
    with open_source(path) as full, open_source(path, divisor=4) as small:
        assert (small.width, small.height) == (12, 8)
        expected, step = means(full.read(0), 4), 0.5 if kind.startswith("u") else 1e-3
        assert np.abs(small.read(0) - expected).max() <= step


def test_straight_colours_count_by_their_cover():
    frame = np.zeros((2, 2, 4), np.uint8)
    frame[0, 0] = 200, 100, 50, 255
    frame[0, 1] = 9, 9, 9, 0
    assert reduced(frame, 2, "straight").tolist() == [[[200, 100, 50, 64]]]
    assert reduced(frame, 2, "premultiplied").tolist() == [[[52, 27, 15, 64]]]
