"""Moments between the frames of footage: those that were filmed stay what they are, and all others lie between."""

import gc
import weakref
from itertools import product
from types import SimpleNamespace
from unittest import mock

import footage
import numpy as np
import pytest
from test_media_flow import blocks, frame, off, pan
from test_media_steps import Film, shift

from shutter_addon.core.frames.frame_source import FrameSource, as_rgba
from shutter_addon.core.model.shutters import MAX_WINDOW
from shutter_addon.features.smooth import smooth
from shutter_addon.features.smooth.smooth import SmoothSource, steps_for
from shutter_addon.media import MediaError, PrefetchSource, open_source, opencv
from shutter_addon.media.cuts import ShotSource

SPEED = 8  # pixels from a frame to the next


class Panned(footage.Film):
    """Pictures that move to the left, from a cut on other ones; it notes which of them live."""

    options = {"colour": "sRGB"}

    def __init__(self, count=8, cut=None, dtype=np.uint8):
        self.cut, self._given, self.most = cut, [], 0
        self.picture = lambda index: self.panned(index, dtype)
        super().__init__(lambda index: self.picture(index), count)

    def read(self, index):
        made = super().read(index)
        self._given.append(weakref.ref(made))
        self.most = max(self.most, self.living)
        return made

    @property
    def living(self):
        return sum(each() is not None for each in self._given)

    def panned(self, index, dtype):
        if self.cut is not None and index >= self.cut:
            return frame(np.roll(blocks(5), -SPEED * index, axis=1), dtype)
        return pan(SPEED * index, dtype)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16])
@pytest.mark.parametrize("step", [2, 16])
def test_what_was_filmed_has_the_footage_s_bits(step, dtype):
    film = Panned(dtype=dtype)
    source = SmoothSource(film, step)
    assert (source.count, source.step, source.fps) == (7 * step + 1, step, 25 * step)
    assert source.options == {"colour": "sRGB", "inbetween": step}
    assert (source.width, source.transfer, film.step) == (film.width, "srgb", 1)
    for index in (3, 0, 7, 1):
        for read in (source.read, source.decoded, SmoothSource(film, step).decoded):
            np.testing.assert_array_equal(as_rgba(read(index * step)), film.picture(index))


@pytest.mark.parametrize("kind", [{}, {"cut": 4}, {"dtype": np.float16}])
def test_the_order_of_reading_changes_no_bit(kind):
    first = SmoothSource(Panned(**kind), 2)
    wanted = [first.read(moment) for moment in range(first.count)]
    source = SmoothSource(Panned(**kind), 2)
    for moment in np.random.default_rng(2).permutation(first.count).tolist() * 2:
        np.testing.assert_array_equal(source.read(moment), wanted[moment])
    with PrefetchSource(SmoothSource(Panned(**kind), 2)) as ahead:
        for moment in (5, 1, 10):
            ahead.want(range(moment, moment + 4))
            for each in range(moment, moment + 4):
                np.testing.assert_array_equal(ahead.read(each), wanted[each])


def test_memory_has_a_bound_and_film_is_decoded_once():
    film = Panned(16)
    film.picture = lambda index: pan(2 * index)
    source = SmoothSource(film, 4)
    for moment in range(1, source.count - 1, 2):
        source.read(moment)
    assert film.asked == list(range(16))
    for moment in np.random.default_rng(0).permutation(source.count)[:30]:
        source.read(int(moment))
    assert film.most <= smooth._FRAMES + 2 * 2 + 1  # those of two pairs, and the one that is being read
    source.close()
    gc.collect()
    assert film.living == 0
    assert off(source.read(2), pan(1)) < 1  # a later read begins anew


def test_a_lost_frame_is_one_sentence_until_it_is_back():
    film = Panned()
    film.lost = {3}
    source = SmoothSource(film, 4)
    for moment in (9, 12, 14):
        with pytest.raises(MediaError, match="frame 3 is lost"):
            source.read(moment)
    assert off(source.read(6), pan(12)) < 1
    film.lost = set()
    assert off(source.read(14), pan(28)) < 1


def test_its_ends():
    for index in (-1, 29):
        with pytest.raises(IndexError, match=r"film\.mov: it has frames 0 to 28"):
            SmoothSource(Panned(), 4).read(index)
    source = SmoothSource(Panned(1), 16)
    assert source.count == 1
    np.testing.assert_array_equal(source.read(0), pan(0))


def test_moments_come_with_the_frames_around_them():
    """Which are sent once for all of a pair, and of which a device makes the moment."""
    source = SmoothSource(Panned(), 4)
    moments = [source.decoded(index) for index in (9, 10, 11)]
    assert [(each.pair, each.number, each.steps) for each in moments] == [((2, 3), k, 4) for k in (1, 2, 3)]
    for each, index in zip(moments, (9, 10, 11), strict=True):
        np.testing.assert_array_equal(each.rgba(), source.read(index))
        for end, frame_ in zip(each.ends, moments[0].ends, strict=True):
            assert end is frame_


# How many moments there are


def speeding(x, count=3, size=(480, 270)):
    film = Film(shift(x), size)
    film.count, (film.width, film.height) = count, size
    return film


def test_as_many_as_are_asked_for_if_a_window_has_room():
    for asked, window in product((1, 2, 4, 8, 16), (1, 16, 17, 128, 129, 256)):
        found = steps_for(SimpleNamespace(count=9), asked, window)
        assert found <= asked
        assert found * window <= MAX_WINDOW
        assert found == asked or 2 * found * window > MAX_WINDOW


@pytest.mark.parametrize(("x", "wanted"), [(0, 1), (1.5, 1), (3, 2), (7, 4), (11, 8), (25, 16), (40, 16)])
def test_as_many_as_the_fastest_motion_needs(x, wanted):
    """In a picture of 270 rows, copies may be two pixels apart."""
    assert steps_for(speeding(x), "auto", 8) == wanted


@pytest.mark.parametrize(("window", "wanted"), [(16, 16), (20, 8), (60, 4), (128, 2), (200, 1)])
def test_a_window_bounds_what_is_needed(window, wanted):
    assert steps_for(speeding(40), "auto", window) == wanted


@pytest.mark.parametrize("fast", [0, 999])
def test_few_pairs_tell_the_first_and_the_last_among_them(fast):
    film = speeding(0, count=1001)
    film.matrix = lambda k: [[1, 0, -160 + 7 * (k > fast)], [0, 1, -160]]  # a single step
    film.read = mock.Mock(side_effect=film.read)
    assert steps_for(film, "auto", 8) == 4
    asked = [call.args[0] for call in film.read.call_args_list]
    assert len(asked) <= 2 * smooth._PAIRS  # the number is nobody else's
    assert (min(asked), max(asked)) == (0, 1000)


def test_what_cannot_be_read_or_told_does_not_count():
    film = speeding(7, count=3)
    own = film.read

    def lost(index):
        if index == 0:
            raise MediaError("frame 0 is lost")
        return own(index)

    film.read = lost
    assert steps_for(film, "auto", 8) == 4
    film.read = lambda index: frame(blocks(index, (270, 480)))  # cuts alone
    assert steps_for(film, "auto", 8) == 1


def test_without_opencv(monkeypatch):
    """Automatic is none then; what was asked for is refused in one sentence."""
    monkeypatch.setattr(opencv, "cv2", None)
    assert steps_for(speeding(7), "auto", 8) == 1
    assert steps_for(speeding(7), 4, 8) == 4
    with pytest.raises(MediaError, match=r"^moments between frames need the Python package opencv"):
        SmoothSource(Panned(), 4)


def test_wrappers_hand_on_all_that_a_source_has(bunny):
    movie = open_source(bunny)
    source = ShotSource(PrefetchSource(SmoothSource(movie, 2)), 2)
    with source:
        assert (source.count, source.fps) == (2 * movie.count - 1, 2 * movie.fps)
        assert source.options == {**movie.options, "inbetween": 2}
        for name in FrameSource.__annotations__.keys() - {"count", "fps", "options", "shots", "step"}:
            assert getattr(source, name) == getattr(movie, name), name
        assert source.files == [bunny]
        assert source.has_audio
        assert (source.step, movie.step) == (2, 1)
        assert source.shots is source
        assert movie.shots is None
        source.want([6, 7])
        with open_source(bunny) as other:  # the thread that decodes ahead has the first one
            assert np.array_equal(source.read(6), other.read(3))
            assert np.array_equal(source.read(7), SmoothSource(other, 2).read(7))
