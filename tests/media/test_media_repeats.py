"""Frames that repeat the one before: which ones are found, and that moments go evenly across them."""

from unittest import mock

import footage
import numpy as np
import pytest
from test_media_flow import blocks, frame
from test_media_steps import Film as Texture
from test_media_steps import shift

from shutter_addon.features.smooth.smooth import MOST, Repeats, SmoothSource, steps_for
from shutter_addon.media import MediaError, PrefetchSource, open_source
from shutter_addon.media.cuts import ShotSource

WIDTH, HEIGHT, SPEED, STEP = 256, 144, 4, 4
PULLDOWN = [k * 4 // 5 for k in range(15)]  # 24 in 30: pictures 0 0 1 2 3 4 4 5 …
TWOS, THREES = ([k // times for k in range(13)] for times in (2, 3))


def disc(x, ground=60):
    down, right = np.mgrid[:HEIGHT, :WIDTH]
    share = np.clip(20.5 - np.hypot(right - x, down - HEIGHT / 2), 0, 1)[..., None]
    return frame((ground * (1 - share) + 230 * share).repeat(3, 2) / 255)


def place(picture, ground=60):
    """Where a disc lies: its center of mass, in pixels."""
    seen = picture[..., 0].astype(float) - ground
    seen[seen < 40] = 0  # grain
    return (seen * np.arange(WIDTH)).sum() / seen.sum()


class Film(footage.Film):
    """A film of a disc that moves from picture to picture; frame k shows picture shown[k]."""

    def __init__(self, shown, picture=lambda number: disc(40 + SPEED * number), noise=0.0):
        self.shown, self.picture, self.noise = shown, picture, noise
        super().__init__(self.frame, len(shown))

    def frame(self, index):
        made = self.picture(self.shown[index])
        if self.noise:
            grain = np.random.default_rng(index).normal(0, self.noise, (HEIGHT, WIDTH, 1))
            made[..., :3] = np.rint(np.clip(made[..., :3] + grain, 0, 255))
        return made


def pan(number, size=1):
    """Blocks of four times as many pixels that move to the left."""
    picture = np.kron(blocks(3, (HEIGHT // size, WIDTH // size)), np.ones((size, size, 1)))
    return frame(np.roll(picture, -SPEED * number, axis=1))


def skipping(film, step=STEP):
    return SmoothSource(film, step, skip_repeats=True)


def even(shown, step=STEP):
    """Which picture each moment shows, by the pictures that are the first of their kind and the time between them."""
    firsts = [k for k in range(len(shown)) if k == 0 or shown[k] != shown[k - 1]]
    times = np.arange((len(shown) - 1) * step + 1) / step
    return np.interp(times, firsts, [shown[k] for k in firsts])


@pytest.mark.parametrize(
    ("shown", "noise"), [(PULLDOWN, 0), (PULLDOWN, 1), (TWOS, 1), (THREES, 1), ([0, 1, 2, 2, 2, 2, 3, 4], 1)]
)
def test_moments_go_evenly_across_repeats(shown, noise):
    """Each frame is decoded once for that."""
    film = Film(shown, noise=noise)
    source, plain = skipping(film, 2), SmoothSource(film, 2)
    found = [(place(source.read(k)) - 40) / SPEED for k in range(source.count)]
    assert film.asked == list(range(film.count))
    stands = [(place(plain.read(k)) - 40) / SPEED for k in range(source.count)]
    np.testing.assert_allclose(found, even(shown, 2), atol=0.25 / SPEED)
    assert np.abs(stands - even(shown, 2)).max() >= 0.5
    assert (source.repeats, plain.repeats) == (True, False)


def lines(x):
    rows = 120 + 60 * np.sin((np.arange(WIDTH) + x) / 5)
    return frame(np.broadcast_to(rows[None, :, None], (HEIGHT, WIDTH, 3)) / 255)


# Of footage without repeats: its pictures by their numbers, and the noise.
MOVING = {
    "a pan with noise": (pan, 12),
    "a still disc": (lambda _number: disc(100), 0),
    "a still disc with grain": (lambda _number: disc(100), 1),
    "a still disc with noise": (lambda _number: disc(100), 12),
    "a pan by a fifth of a pixel": (lambda number: lines(0.2 * number), 0),
    "the same with noise": (lambda number: lines(0.2 * number), 4),
    "a pan by less and by more": (lambda number: lines(0.25 * number + 0.05 * (number % 2)), 0),
    "a pan by half a pixel and by three": (lambda number: lines(1.75 * number - 1.25 * (number % 2)), 0),
    "a disc that stands still for longer than repeats do": (
        lambda number: disc(40 + SPEED * (number - min(max(number - 3, 0), MOST))),
        1,
    ),
}


@pytest.mark.parametrize("name", MOVING)
def test_footage_without_repeats_keeps_its_bits(name):
    film = Film(range(12), *MOVING[name])
    repeats = Repeats(film)
    assert [repeats.gap(k) for k in range(12)] == [(k, k + 1) for k in range(12)]
    source, plain = skipping(film), SmoothSource(film, STEP)
    for k in (4 * STEP, 5 * STEP + 1):
        np.testing.assert_array_equal(source.read(k), plain.read(k))
    assert not source.repeats


def test_at_the_ends_of_a_clip():
    """The first frame has no other before it; those at the end, none behind them that they could go to."""
    film = Film([0, 0, 0, 1, 2, 3, 3, 3])
    source = skipping(film)
    found = [(place(source.read(k)) - 40) / SPEED for k in range(source.count)]
    np.testing.assert_allclose(found, even(film.shown), atol=0.5 / SPEED)
    np.testing.assert_array_equal(source.read(0), film.read(0))
    for k in range(5, 8):
        np.testing.assert_array_equal(source.read(k * STEP), film.read(k))
    for shown in ([0, 0, 0], [0]):
        source = skipping(Film(shown))
        for k in range(source.count):
            np.testing.assert_array_equal(source.read(k), film.read(0))


@pytest.mark.parametrize("shown", [PULLDOWN, [0] * 9 + [1, 1, 2, 3, 3, 3]])
def test_the_order_of_reading_changes_no_bit(shown):
    film = Film(shown, noise=1)
    first = skipping(film, 2)
    wanted = [first.read(moment) for moment in range(first.count)]
    assert film.asked == list(range(film.count))
    for order in (range(first.count)[::-1], [9], [11], [15]):  # a machine of a farm begins anywhere
        source = skipping(Film(shown, noise=1), 2)
        for moment in order:
            np.testing.assert_array_equal(source.read(moment), wanted[moment])


@pytest.mark.parametrize("sky", [False, True])
def test_across_a_cut_nothing_is_bridged(sky):
    """All is as filmed; what repeats behind the cut is bridged to what comes then.

    sky: most of both shots is the same, so that there seem to be moments between the two."""
    shots = [np.kron(blocks(seed, (HEIGHT // 8, WIDTH // 8)), np.ones((8, 8, 1))) for seed in (1, 2)]
    shots[1] = 1 - 0.4 * shots[1]
    if sky:
        for shot in shots:
            shot[: HEIGHT * 2 // 3] = 0.5

    def picture(number):
        return frame(np.roll(shots[number >= 3], SPEED * number, axis=1))

    film = Film([0, 1, 2, 2, 3, 3, 4, 5], picture)
    source = skipping(film)
    plain = SmoothSource(film, STEP)
    for k in range(2 * STEP, 4 * STEP + 1):
        np.testing.assert_array_equal(source.read(k), plain.read(k))
    assert not np.array_equal(source.read(5 * STEP), film.read(5))
    if not sky:
        with ShotSource(PrefetchSource(skipping(film), planes=True), STEP) as found:
            assert found.around(0, 0, found.count - 1) == range(4 * STEP - (STEP - 1) // 2)


def test_a_lost_frame_beside_is_no_fault():
    film = Film([0, 0, 1, 1, 2, 2, 3])
    film.lost = {4}
    source = skipping(film)
    np.testing.assert_array_equal(source.read(3 * STEP), film.read(3))  # it cannot be told how it goes on
    assert not np.array_equal(source.read(STEP), film.read(1))
    with pytest.raises(MediaError, match="frame 4 is lost"):
        source.read(3 * STEP + 1)
    film.lost = set()
    assert not np.array_equal(source.read(3 * STEP), film.read(3))


def test_frames_of_a_real_film_that_repeat(bunny):
    """Made at 24 frames per second, it has one more in each second. The pedestrians have none."""
    for name, wanted in (("bigbuckbunny.mp4", [7, 32, 57, 82, 107]), ("pedestrians.avi", [])):
        with open_source(bunny.with_name(name)) as movie:
            repeats = Repeats(movie)
            found = [repeats.gap(k) for k in range(movie.count)]
        assert [k for k, (first, _stop) in enumerate(found) if first < k] == wanted
        assert found == [(k - (k in wanted), k + 1 + (k + 1 in wanted)) for k in range(movie.count)]


@pytest.mark.parametrize("crf", [18, 28])
@pytest.mark.parametrize(("shown", "grain"), [(PULLDOWN, 0), (TWOS, 0), (PULLDOWN, 5), (range(15), 5)])
def test_what_a_codec_makes_of_repeats(tmp_path, shown, grain, crf):
    pictures = []
    for number in shown:
        noise = np.random.default_rng(number).normal(0, grain, (HEIGHT, WIDTH, 1))
        pictures.append(np.clip(pan(number, 8)[..., :3] + noise, 0, 255).astype(np.uint8))
    options = {"size": (WIDTH, HEIGHT), "rate": 30, "options": {"crf": str(crf)}}
    path = footage.make_movie(tmp_path / "film.mp4", "libx264", pictures=pictures, **options)
    with open_source(path) as movie:
        repeats = Repeats(movie)
        found = {k for k in range(movie.count) if repeats.gap(k)[0] < k}
    wanted = {k for k in range(1, len(shown)) if shown[k] == shown[k - 1] and shown[k] != shown[-1]}
    assert found == wanted


def test_automatic_counts_the_time_between_pictures():
    """7 pixels in two frames are 3.5 in each."""
    film, plain = (Texture(lambda k, times=times: shift(7)(k // times), (480, 270)) for times in (2, 1))
    film.read = mock.Mock(side_effect=film.read)
    for each, count in ((film, 20), (plain, 4)):
        each.count, each.width, each.height = count, 480, 270
        assert steps_for(each, "auto", 8) == 4
    film.read.reset_mock()
    assert steps_for(film, "auto", 8, skip_repeats=True) == 2
    assert film.read.call_count <= 8 * 4
    assert steps_for(plain, "auto", 8, skip_repeats=True) == 4
