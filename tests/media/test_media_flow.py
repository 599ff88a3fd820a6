"""Frames between two frames: where things are at their times, how samples are encoded, what one frame alone shows."""

import tracemalloc

import cv2
import numpy as np
import pytest

from shutter_addon.core.frames import light
from shutter_addon.core.frames.frame_source import as_rgba
from shutter_addon.media import flow, open_source

HEIGHT, WIDTH = 96, 160


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
    return frame(noise(1, HEIGHT, WIDTH + 64)[:, x : x + WIDTH], dtype)


def at(pair, number, steps):
    return as_rgba(pair.moment(0, number, steps))


def between(first, second, steps, transfer="srgb", alpha="opaque"):
    """The frames at the times 1/steps … (steps-1)/steps."""
    found = flow.Between(first, second, transfer, alpha)
    return [at(found, k, steps) for k in range(1, steps)]


def off(picture, other):
    """The mean difference inside the picture, in levels of 255."""
    top = np.iinfo(picture.dtype).max if picture.dtype.kind == "u" else 1
    inside = np.s_[12:-12, 20:-20]
    return np.abs(picture[inside].astype(float) - other[inside].astype(float)).mean() * 255 / top


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
def test_what_moves_is_where_it_is_at_each_time(dtype):
    made = between(pan(0, dtype), pan(8, dtype), 4)
    assert [picture.dtype for picture in made] == [dtype] * 3
    for k, picture in enumerate(made, start=1):
        assert picture.shape == (HEIGHT, WIDTH, 4)
        assert off(picture, pan(2 * k, dtype)) < 1
        assert off(picture, pan(2 * k - 2, dtype)) > 4  # the time before


@pytest.mark.parametrize("size", [(96, 160), (61, 47), (17, 200), (9, 9), (1, 1)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_between_equal_frames_nothing_changes(size, dtype):
    samples = np.random.default_rng(3).integers(0, np.iinfo(dtype).max, (*size, 4), dtype, endpoint=True)
    samples[..., 3] = np.iinfo(dtype).max
    for picture in between(samples, samples, 2):
        np.testing.assert_array_equal(picture, samples)


@pytest.mark.parametrize("size", [32, 9, 1])  # of which flow is found, and which are too small for it
def test_frames_are_mixed_in_linear_light(size):
    dark, bright = (np.full((size, size, 4), (v, v, v, 1), np.float32) for v in (0.5, 0.58))
    ends = light.to_linear(np.array([0.5, 0.58]))
    for k, picture in enumerate(between(dark, bright, 4), start=1):
        wanted = light.to_encoded(np.interp(k / 4, [0, 1], ends))
        assert np.abs(picture[..., :3] - wanted).max() < 1e-4
        assert abs(wanted - 0.5 - k / 4 * 0.08) > 1e-3  # what a mean of encoded values is


def blocks(seed, size=(HEIGHT, WIDTH)):
    """A picture (H, W, 3) of blocks in any colors, 0 to 1."""
    coarse = np.random.default_rng(seed).random((size[0] // 4 + 1, size[1] // 4 + 1, 3))
    return np.kron(coarse, np.ones((4, 4, 1)))[: size[0], : size[1]]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
@pytest.mark.parametrize(("size", "alpha"), [((96, 160), "opaque"), ((96, 160), "premultiplied"), ((9, 9), "opaque")])
def test_of_frames_that_have_nothing_in_common_it_is_the_nearer(size, alpha, dtype):
    """As at a cut: the frame's own bits. In the middle it is the first, as shots have it."""
    first, second = (frame(blocks(seed, size), dtype) for seed in (1, 2))
    found = flow.Between(first, second, alpha=alpha)
    for number in (1, 4, 8):
        np.testing.assert_array_equal(at(found, number, 16), first)
    for number in (9, 12, 15):
        np.testing.assert_array_equal(at(found, number, 16), second)


@pytest.mark.parametrize("brightness", [1, 0.3, 0.15])
def test_a_cut_is_none_the_less_in_the_dark(bunny, brightness):
    """From one film to another; and what moves in each of them lies between its frames."""
    films = []
    for path in (bunny, bunny.with_name("pedestrians.avi")):
        with open_source(path) as film:
            shown = [cv2.resize(film.read(i), (320, 180), interpolation=cv2.INTER_AREA) for i in (40, 41)]
        films.append([(each * [brightness, brightness, brightness, 1]).astype(np.uint8) for each in shown])
    found = flow.Between(films[0][0], films[1][0])
    np.testing.assert_array_equal(at(found, 1, 4), films[0][0])
    np.testing.assert_array_equal(at(found, 3, 4), films[1][0])
    for first, second in films:
        made = at(flow.Between(first, second), 1, 2)
        assert not np.array_equal(made, first)
        assert not np.array_equal(made, second)


def test_what_fills_less_than_half_of_the_picture_may_be_new():
    """Someone who steps in is no cut: all else is where it is at that time."""
    first, second = pan(0), pan(8)
    second[30:, 90:, :3] = frame(noise(9, HEIGHT - 30, WIDTH - 90))[..., :3]
    made = at(flow.Between(first, second), 3, 4)
    assert np.abs(made[:, :80].astype(float) - pan(6)[:, :80]).mean() < 1.5


@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
def test_alpha_and_transfer_stay_as_they_are(alpha, transfer):
    """A red disc on clear ground moves; its color has no dark seam, and clear ground stays clear."""

    def disc(x):
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        cover = np.clip(24 - np.hypot(rows - 48, columns - x), 0, 1)[..., None]
        red = noise(5) * (0.9, 0.1, 0.1) + (0.1, 0, 0)
        rgb = np.roll(red, x, axis=1) * (cover if alpha == "premultiplied" else 1)
        return np.dstack([rgb, cover]).astype(np.float32)

    (made,) = between(disc(70), disc(78), 2, transfer=transfer, alpha=alpha)
    expected = disc(74)
    assert np.abs(made[..., 3] - expected[..., 3]).mean() < 0.01
    shown, wanted = (p[..., :3] * (p[..., 3:] if alpha == "straight" else 1) for p in (made, expected))
    assert np.abs(shown - wanted).mean() < 0.01
    assert made[:20, :, 3].max() < 1e-3


def test_what_moves_over_ground_leaves_no_ghosts():
    ground, thing = (np.kron(noise(seed, 96, 160), np.ones((2, 2, 1))) for seed in (7, 8))

    def at(x):
        rgb = ground.copy()
        rgb[48:144, x : x + 96] = thing[:96, :96] * 0.5 + 0.5
        return frame(rgb)

    first, second = at(80), at(96)
    made = between(first, second, 4)
    for k, picture in enumerate(made, start=1):
        assert off(picture, at(80 + 4 * k)) < 0.7
    mixed = np.rint(255 * light.to_encoded((light.to_linear(first / 255) + light.to_linear(second / 255)) / 2))
    assert off(made[1], at(88)) < off(mixed.astype(np.uint8), at(88)) / 3


def test_what_leaves_or_enters_the_picture_comes_from_the_frame_that_shows_it():
    wide = np.kron(noise(1), np.ones((2, 2, 1)))
    first, middle, second = (frame(wide[:, x : x + 256]) for x in (0, 8, 16))
    (made,) = between(first, second, 2)
    for side in (np.s_[12:-12, :8], np.s_[12:-12, -8:]):
        assert np.abs(made[side].astype(float) - middle[side]).mean() < 5  # 7 where both are mixed


def test_dropped_frames_of_a_film_come_closer_than_a_blend(bunny):
    def psnr(picture, dropped):
        return 10 * np.log10(255**2 / np.mean((picture[..., :3].astype(float) - dropped[..., :3]) ** 2))

    with open_source(bunny, divisor=2) as film:
        first, dropped, second = (film.read(index) for index in (29, 30, 31))
    (made,) = between(first, second, 2)
    mixed = np.rint(255 * light.to_encoded((light.to_linear(first / 255) + light.to_linear(second / 255)) / 2))
    assert psnr(made, dropped) > psnr(mixed, dropped) + 1


def test_odd_values_stay_local():
    for value in (np.inf, -np.inf, np.nan, 1e4):
        samples = pan(0, np.float32)
        samples[10, 10, :3] = value
        (made,) = between(samples, samples, 2, transfer="linear")
        np.testing.assert_allclose(made[24:, 24:], samples[24:, 24:], atol=1e-4)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("transfer", ["srgb", "linear"])
@pytest.mark.parametrize("alpha", ["opaque", "straight", "premultiplied"])
def test_what_is_not_finite_becomes_finite(dtype, transfer, alpha):
    first, second = pan(0, dtype), pan(8, dtype)
    first[40, 60, 0], first[50, 70] = np.inf, np.nan
    second[40, 60, 1], second[50, 70, 2] = np.inf, -np.inf
    for made in between(first, second, 4, transfer, alpha):
        assert np.isfinite(made).all()


def test_flow_is_found_once_for_all_times(monkeypatch):
    found, own = [], flow._dis  # which OpenCV calls
    # How often flow is sought shows nowhere else.
    monkeypatch.setattr(flow, "_dis", lambda *given, **more: found.append(1) or own(*given, **more))
    pair = flow.Between(pan(0), pan(8))
    assert len(found) == 2  # there, and back
    pictures = [at(pair, k, 8) for k in range(1, 8)]
    assert len(found) == 2
    at(flow.Between(pan(0), pan(0)), 1, 2)
    assert len(found) == 2
    again = flow.Between(pan(0), pan(8))
    for k in (5, 1, 7):  # a time depends on no other
        np.testing.assert_array_equal(at(again, k, 8), pictures[k - 1])


def test_the_same_bits_whatever_the_number_of_threads():
    here, threads = between(pan(0), pan(8), 4), cv2.getNumThreads()
    try:
        for count in (1, 7):
            cv2.setNumThreads(count)
            np.testing.assert_array_equal(between(pan(0), pan(8), 4), here)
    finally:
        cv2.setNumThreads(threads)


def test_what_is_kept_of_pictures_of_other_sizes_is_let_go():
    try:
        for width in range(31, 40):
            first = frame(noise(1, 32, width))
            assert not np.array_equal(at(flow.Between(first, first + np.uint8(8)), 1, 4), first)
            tracemalloc.start()  # not before the first one, which makes what is kept of all pictures
        arrays = tracemalloc.take_snapshot().filter_traces([tracemalloc.DomainFilter(True, np.lib.tracemalloc_domain)])
    finally:
        tracemalloc.stop()
    assert sum(trace.size for trace in arrays.traces) <= 32 * 39 * 2 * 4  # one place for each pixel


@pytest.mark.parametrize(("contrast", "move", "level"), [(1, 4, 2), (0.1, 4, 1), (0.1, 12, 3)])
def test_smooth_pictures_need_fewer_key_moments(contrast, move, level):
    """A mix shows the same where the picture bends little, unless something comes from too far away to be known."""
    pair = flow.Between(*(frame(0.5 + contrast * (noise(1)[:, 16 - x :][:, :128] - 0.5)) for x in (0, move)))
    assert np.median(pair.moment(0, 1, 8).levels) == level


@pytest.mark.parametrize(("move", "dtype"), [((8, 0), np.uint8), ((-6, 3), np.uint16), ((5, -4), np.float32)])
def test_vectors_say_where_all_goes(move, dtype):
    """For every fourth pixel, in 1/32 of one; and both frames surely show what stays in the picture."""
    wide = noise(3, HEIGHT + 32, WIDTH + 32)
    first, second = (frame(wide[16 - y :, 16 - x :][:HEIGHT, :WIDTH], dtype) for x, y in ((0, 0), move))
    moment = flow.Between(first, second).moment(7, 1, 2)
    assert moment.vectors.shape == (1, HEIGHT // 4, WIDTH // 4, 4)
    assert moment.vectors.dtype == np.uint16
    assert (moment.pair, moment.number, moment.steps) == (7, 1, 2)
    assert all(map(np.array_equal, moment.ends, (first, second)))
    inside = moment.vectors[0, 6:-6, 6:-6].astype(float)
    np.testing.assert_allclose(np.median((inside[..., :2] - 32768) / 32, axis=(0, 1)), move, atol=0.15)
    assert np.median(inside[..., 2:], axis=(0, 1)).tolist() == [255, 255]
