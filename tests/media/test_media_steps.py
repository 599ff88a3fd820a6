"""How far footage moves from frame to frame: against motions that are known."""

import cv2
import numpy as np
import pytest

from shutter_addon.core.model.motions import Similarity
from shutter_addon.features.smooth import smooth

STILL = Similarity()


class Film:
    """A texture that is laid into each frame by a function of the frame's number: a matrix (2, 3)."""

    transfer, alpha, dtype = "srgb", "opaque", np.dtype(np.uint8)

    def __init__(self, matrix, size=(960, 540), subject=None):
        rng = np.random.default_rng(5)
        self.matrix, self.size, self.subject = matrix, size, subject
        noise = rng.integers(0, 256, (size[1] // 4 + 80, size[0] // 4 + 80, 3), dtype=np.uint8)
        self.texture = cv2.resize(noise, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC)

    def read(self, index):
        frame = cv2.warpAffine(self.texture, np.float32(self.matrix(index)), self.size)
        if self.subject:
            left, side = self.subject(index)
            frame[100 : 100 + side, left : left + side] = self.texture[:side, -side:]
        return np.dstack([frame, np.full(frame.shape[:2], 255, np.uint8)])


def shift(x, y=0.0):
    return lambda k: [[1, 0, -160 + k * x], [0, 1, -160 + k * y]]


@pytest.mark.parametrize(("x", "y"), [(0, 0), (0.5, 0), (1, 1), (3, 0), (0, -8), (20, 10), (40, 0)])
def test_a_shift_is_found(x, y):
    found = smooth.step(smooth.moved(Film(shift(x, y)), 1), STILL, STILL) * 540
    assert found == pytest.approx(np.hypot(x, y), abs=0.1 + 0.03 * np.hypot(x, y))


@pytest.mark.parametrize("size", [(1920, 1080), (480, 270), (320, 180)])
def test_the_pictures_size_does_not_matter(size):
    share = 0.01
    found = smooth.step(smooth.moved(Film(shift(share * size[1]), size), 1), STILL, STILL)
    assert found == pytest.approx(share, rel=0.1)


@pytest.mark.parametrize(("side", "is_seen"), [(30, False), (120, True)])
def test_a_subject_counts_if_it_is_large_enough(side, is_seen):
    film = Film(shift(0), subject=lambda k: (300 + 10 * k, side))
    found = smooth.step(smooth.moved(film, 1), STILL, STILL) * 540
    assert found == pytest.approx(10 if is_seen else 0, abs=0.5)


def test_what_is_followed_stands_still_and_the_rest_moves():
    """A panning shot: of a subject that moves by 10 pixels before what stands still."""
    film = Film(shift(0), subject=lambda k: (300 + 10 * k, 150))
    ways = Similarity(1, 10 / 540), Similarity(1, 20 / 540)
    assert smooth.step(smooth.moved(film, 1), *ways) * 540 == pytest.approx(10, abs=0.5)
    assert smooth.step(smooth.moved(Film(shift(10)), 1), *ways) * 540 == pytest.approx(0, abs=0.2)


def test_a_turn_is_followed():
    angle = 0.01

    def turned(k):
        c, s = np.cos(k * angle), np.sin(k * angle)
        return [[c, -s, -160 * c + 160 * s], [s, c, -160 * s - 160 * c]]

    found = smooth.moved(Film(turned), 1)
    assert smooth.step(found, STILL, STILL) * 540 > 7
    ways = (Similarity(complex(np.exp(1j * k * angle)), 0) for k in (1, 2))
    assert smooth.step(found, *ways) * 540 < 0.5


def test_nothing_is_told_across_a_cut_nor_by_few_pixels():
    film = Film(shift(0))
    first, second = film.read(0), np.flip(film.read(0), (0, 1)).copy()
    second[..., :3] = np.random.default_rng(1).integers(0, 256, second[..., :3].shape, dtype=np.uint8)
    film.read = lambda index: (first, second)[index]
    assert smooth.moved(film, 0) is None
    assert smooth.moved(Film(shift(1), size=(20, 8)), 0) is None


@pytest.mark.parametrize(("height", "most"), [(90, 2), (720, 2), (1080, 3), (2160, 6)])
def test_a_streak_is_smooth_whose_copies_are_near(height, most):
    """Three pixels of 1080, but two of any picture: edges are as wide."""
    assert smooth.smooth_step(height) == pytest.approx(most)
