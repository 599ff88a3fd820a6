"""Frames between two frames: where things are at their times, how samples are encoded, what one frame alone shows."""

import hashlib
import subprocess
import sys
import tracemalloc
import types
from pathlib import Path

import numpy as np
import pytest

from shutter_addon.core.frames import light
from shutter_addon.media import MediaError, flow, open_source, opencv

HEIGHT, WIDTH = 96, 160
METHODS = tuple(flow.METHODS)


def noise(seed, height=HEIGHT, width=WIDTH):
    """A smooth random picture (H, W, 3) in 0.1 … 0.9."""
    coarse = np.random.default_rng(seed).random((height // 8 + 2, width // 8 + 2, 3))
    fine = np.kron(coarse, np.ones((8, 8, 1)))
    for axis in (0, 1):
        fine = sum(np.roll(fine, step, axis) for step in range(-3, 4)) / 7
    return 0.1 + 0.8 * fine[:height, :width]


def frame(rgb, dtype=np.uint8, alpha=1.0):
    rgba = np.dstack([rgb, np.broadcast_to(alpha, rgb.shape[:2])])
    top = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    return (np.rint(rgba * top) if top > 1 else rgba).astype(dtype)


def pan(x, dtype=np.uint8):
    """A view of a wide picture that moved by x pixels to the left."""
    return frame(noise(1, HEIGHT, WIDTH + 64)[:, x : x + WIDTH], dtype)


def off(picture, other):
    """The mean difference inside the picture, in levels of 255."""
    top = np.iinfo(picture.dtype).max if picture.dtype.kind == "u" else 1
    inside = np.s_[12:-12, 20:-20]
    return np.abs(picture[inside].astype(float) - other[inside].astype(float)).mean() * 255 / top


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
def test_what_moves_is_where_it_is_at_each_time(method, dtype):
    made = list(flow.between(pan(0, dtype), pan(8, dtype), 4, method))
    assert [picture.dtype for picture in made] == [dtype] * 3
    for k, picture in enumerate(made, start=1):
        assert picture.shape == (HEIGHT, WIDTH, 4)
        assert off(picture, pan(2 * k, dtype)) < 1
        assert off(picture, pan(2 * k - 2, dtype)) > 4  # the time before


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("size", [(96, 160), (61, 47), (17, 200), (9, 9), (1, 1)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_between_equal_frames_nothing_changes(method, size, dtype):
    samples = np.random.default_rng(3).integers(0, np.iinfo(dtype).max, (*size, 4), dtype, endpoint=True)
    samples[..., 3] = np.iinfo(dtype).max
    for picture in flow.between(samples, samples, 2, method):
        np.testing.assert_array_equal(picture, samples)


def test_frames_are_mixed_in_linear_light():
    black, white = (np.full((32, 32, 4), (v, v, v, 255), np.uint8) for v in (0, 255))
    (grey,) = flow.between(black, white, 2)
    assert abs(int(grey[16, 16, 0]) - 188) <= 1
    for k, picture in enumerate(flow.between(black, white, 4), start=1):
        assert abs(light.to_linear(picture[16, 16, 0] / 255) - k / 4) < 0.005


@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_alpha_and_transfer_stay_as_they_are(alpha, transfer):
    """A red disc on clear ground moves; its colour has no dark seam, and clear ground stays clear."""

    def disc(x):
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        cover = np.clip(24 - np.hypot(rows - 48, columns - x), 0, 1)[..., None]
        red = noise(5) * (0.9, 0.1, 0.1) + (0.1, 0, 0)
        rgb = np.roll(red, x, axis=1) * (cover if alpha == "premultiplied" else 1)
        return np.dstack([rgb, cover]).astype(np.float32)

    (made,) = flow.between(disc(70), disc(78), 2, transfer=transfer, alpha=alpha)
    expected = disc(74)
    assert np.abs(made[..., 3] - expected[..., 3]).mean() < 0.01
    shown, wanted = (p[..., :3] * (p[..., 3:] if alpha == "straight" else 1) for p in (made, expected))
    assert np.abs(shown - wanted).mean() < 0.01
    assert made[:20, :, 3].max() < 1e-3


@pytest.mark.parametrize("method", METHODS)
def test_what_moves_over_ground_leaves_no_ghosts(method):
    ground, thing = (np.kron(noise(seed, 96, 160), np.ones((2, 2, 1))) for seed in (7, 8))

    def at(x):
        rgb = ground.copy()
        rgb[48:144, x : x + 96] = thing[:96, :96] * 0.5 + 0.5
        return frame(rgb)

    first, second = at(80), at(96)
    made = list(flow.between(first, second, 4, method))
    for k, picture in enumerate(made, start=1):
        assert off(picture, at(80 + 4 * k)) < 0.7
    mixed = (light.to_linear(first / 255) + light.to_linear(second / 255)) / 2
    mixed = np.rint(255 * light.to_encoded(mixed)).astype(np.uint8)
    assert off(made[1], at(88)) < off(mixed, at(88)) / 3


@pytest.mark.parametrize("method", METHODS)
def test_what_leaves_or_enters_the_picture_comes_from_the_frame_that_shows_it(method):
    wide = np.kron(noise(1), np.ones((2, 2, 1)))
    first, middle, second = (frame(wide[:, x : x + 256]) for x in (0, 8, 16))
    (made,) = flow.between(first, second, 2, method)
    for side in (np.s_[12:-12, :8], np.s_[12:-12, -8:]):
        assert np.abs(made[side].astype(float) - middle[side]).mean() < 5  # 7 where both are mixed


def test_dropped_frames_of_a_film_come_closer_than_a_blend(bunny):
    def psnr(picture, dropped):
        return 10 * np.log10(255**2 / np.mean((picture[..., :3].astype(float) - dropped[..., :3]) ** 2))

    with open_source(bunny) as film:
        for index in (30, 60):
            first, dropped, second = (film.read(index + step) for step in (-1, 0, 1))
            (made,) = flow.between(first, second, 2)
            mixed = (light.to_linear(first / 255) + light.to_linear(second / 255)) / 2
            mixed = np.rint(255 * light.to_encoded(mixed))
            assert psnr(made, dropped) > psnr(mixed, dropped) + 1


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 1e4])
def test_odd_values_stay_local(value):
    samples = pan(0, np.float32)
    samples[10, 10, :3] = value
    (made,) = flow.between(samples, samples, 2, transfer="linear")
    np.testing.assert_allclose(made[24:, 24:], samples[24:, 24:], atol=1e-4)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
@pytest.mark.parametrize("alpha", ["opaque", "straight", "premultiplied"])
def test_what_is_not_finite_becomes_finite(method, dtype, transfer, alpha):
    first, second = pan(0, dtype), pan(8, dtype)
    first[40, 60, 0], first[50, 70] = np.inf, np.nan
    second[40, 60, 1], second[50, 70, 2] = np.inf, -np.inf
    for made in flow.between(first, second, 3, method, transfer, alpha):
        assert np.isfinite(made).all()


def test_frames_are_made_one_by_one(monkeypatch):
    looked, remap = [], flow.cv2.remap
    monkeypatch.setattr(flow.cv2, "remap", lambda *given, **options: looked.append(1) or remap(*given, **options))
    frames = flow.between(pan(0), pan(8), 4)
    assert looked == []
    first, second, third = (len(looked) for _ in frames)
    assert third - second == second - first > 0


def digest(threads, method):
    code = f"""
import sys, hashlib
sys.path.insert(0, "tests/media")
import cv2
cv2.setNumThreads({threads})
from test_media_flow import pan, flow
made = flow.between(pan(0), pan(8), 4, {method!r})
print(hashlib.sha256(b"".join(p.tobytes() for p in made)).hexdigest())
"""
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.mark.parametrize("method", METHODS)
def test_the_same_bits_whatever_the_number_of_threads(method):
    made = flow.between(pan(0), pan(8), 4, method)
    here = hashlib.sha256(b"".join(picture.tobytes() for picture in made)).hexdigest()
    assert digest(1, method) == digest(7, method) == here


def test_one_frame_after_the_other_has_none_between():
    assert list(flow.between(pan(0), pan(8), 1)) == []


def test_without_opencv_it_is_one_sentence(monkeypatch):
    for found in (None, types.ModuleType("cv2")):  # none, and one without the contributed modules
        monkeypatch.setattr(opencv, "cv2", found)
        with pytest.raises(MediaError, match="need the Python package opencv-contrib-python-headless"):
            next(flow.between(pan(0), pan(8), 2))


def test_what_is_kept_of_pictures_of_other_sizes_is_let_go():
    def make(width):
        list(flow.between(*(frame(noise(seed, 32, width), np.uint8) for seed in (1, 2)), 2))

    make(31)  # and what is kept of all pictures
    tracemalloc.start()
    try:
        for width in range(32, 40):
            make(width)
        arrays = tracemalloc.take_snapshot().filter_traces([tracemalloc.DomainFilter(True, np.lib.tracemalloc_domain)])
    finally:
        tracemalloc.stop()
    assert sum(trace.size for trace in arrays.traces) <= 32 * 39 * 2 * 4  # one place for each pixel
