"""Diffusion with conductances, on NumPy and both GPU devices, against the sparse direct solve of the same ones."""

from functools import cache
from pathlib import Path

import cv2
import exact_diffusion
import numpy as np
import pytest
import test_diffusion
from test_diffusion import LEVEL, assert_coefficients, scattered

from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.core.model.scribbles import Shape, rasterise
from shutter_addon.media import open_source

ASSETS = Path(__file__).parents[2] / "assets"
WIDTH, HEIGHT = 96, 64


def grey(values):
    """A guide (h, w, 3) float32 of values (h, w)."""
    return np.repeat(np.asarray(values, np.float32)[..., None], 3, axis=2)


def shapes(seed, shutters=4, width=WIDTH, height=HEIGHT, count=6):
    rng = np.random.default_rng(seed)
    drawn = [
        Shape(i % shutters, rng.choice(["line", "lasso"]), 0.02, (rng.random((3, 2)) * 0.5 + rng.random(2) * 0.5,))
        for i in range(count)
    ]
    return rasterise(drawn, width, height)


def dots(shutters=5, count=12, width=WIDTH, height=HEIGHT):
    return test_diffusion.dots(count, shutters, width, height)[0]


def film(name, index, width=WIDTH, height=HEIGHT, blur=0.5):
    with open_source(ASSETS / name) as source:
        picture = cv2.resize(source.read(index)[..., :3], (width, height), interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(picture.astype(np.float32) / 255, (0, 0), blur)


def noise(level, width=WIDTH, height=HEIGHT, seed=0):
    return (0.5 + level * np.random.default_rng(seed).standard_normal((height, width, 3))).astype(np.float32)


def specks(share, blur, width=WIDTH, height=HEIGHT, seed=0):
    """Single pixels of the full contrast, which only many cycles solve."""
    picture = (np.random.default_rng(seed).random((height, width)) < share).astype(np.float32)
    return grey(cv2.GaussianBlur(picture, (0, 0), blur))


def walls(gap, width=WIDTH, height=HEIGHT, thick=1):
    y, x = np.mgrid[:height, :width]
    return grey((y % gap < thick) | (x % gap < thick))


def spiral(gap, side=64):
    return grey(test_diffusion.spiral(gap, side)[0] > 0)


def maze(gap, side=64):
    """Corridors of a floor's conductance along their walls, each open at one end."""
    return grey(np.isin(test_diffusion.maze(gap, side)[0], (1, 2)))


def three_corners(side=64):
    labels = np.zeros((side, side), np.uint16)
    labels[side // 2, side // 2], labels[3, 3], labels[3, -4] = 1, 2, 3
    return labels


def one_stroke():
    labels = np.zeros((HEIGHT, WIDTH), np.uint16)
    labels[[0, -1]] = labels[:, [0, -1]] = 1
    labels[25:40, 48] = 2
    return labels


def ring_of_a_shutter():
    """A closed ring of shutter 1; inside it is nothing else."""
    labels = np.zeros((HEIGHT, WIDTH), np.uint16)
    labels[20:45, 30:60] = 2
    labels[21:44, 31:59] = 0
    labels[5, 5] = 1
    return labels


def pockets(side, width=160, height=120, seed=5):
    y, x = np.mgrid[:height, :width]
    labels = np.random.default_rng(seed).integers(1, 4, (height, width)).astype(np.uint16)
    labels[(y % (side + 1) > 0) & (x % (side + 1) > 0)] = 0
    return labels


def halves(gap, width=160, height=120):
    """Every pocket of `gap` pixels is cut in two by an edge; every second one in unequal parts."""
    x = np.arange(width) + np.zeros((height, 1))
    return grey(0.5 * (x % (gap + 1) > np.where(x // (gap + 1) % 2, gap // 2, 1)))


BUNNY, PEOPLE, WALKERS = ("bigbuckbunny.mp4", 60), ("pedestrians.avi", 30), ("walkers.mp4", 30)
X = np.arange(WIDTH) / WIDTH + np.zeros((HEIGHT, 1))
# name: labels, shutters, guide
SCENES = {
    "bunny": (shapes(1), 4, film(*BUNNY)),
    "bunny, one stroke": (one_stroke(), 2, film(*BUNNY)),
    "people, 8 shutters": (shapes(5, 8, count=16), 8, film(*PEOPLE)),
    "walkers, 9 shutters": (dots(9, 30), 9, film(*WALKERS)),
    "flat": (shapes(7), 4, grey(X * 0)),
    "noise": (shapes(7), 4, noise(0.3)),
    "some noise": (dots(), 5, noise(0.02)),
    "specks": (dots(4, 5, 169, 50), 4, specks(0.2, 0.1, 169, 50)),
    "walls, 3": (dots(), 5, walls(3)),
    "walls, 8": (dots(), 5, walls(8)),
    "spiral": (three_corners(), 3, spiral(7)),
    "narrow maze": (three_corners(), 3, maze(2)),
    "enclosed": (ring_of_a_shutter(), 2, film(*BUNNY)),
    "half of it fixed": (*scattered(WIDTH, HEIGHT, 0.5, seed=7), noise(0.3)),
    "single free pixels": (pockets(1), 3, noise(0.3, 160, 120)),
    "pockets in halves": (pockets(7), 3, halves(7)),
    "pockets with noise": (pockets(12), 3, noise(0.03, 160, 120)),
    "odd": (shapes(11, 4, 97, 61), 4, film(*WALKERS, 97, 61)),
    "1×97": (*scattered(1, 97, 0.03, seed=7), noise(0.3, 1, 97)),
}
STRENGTHS = [*((scene, 1.0) for scene in SCENES), ("bunny", 0.1), ("walls, 8", 0.6), ("some noise", 0.1)]


@cache
def exact(scene, strength):
    """The exact solution of a scene at a strength; each is solved once."""
    return exact_diffusion.solve(*SCENES[scene], strength)


@pytest.fixture(scope="module", params=["numpy", "moderngl"])
def solve(request):
    return CPUCompositor().solve if request.param == "numpy" else request.getfixturevalue(f"on_{request.param}")


@pytest.mark.parametrize("scene", ["people, 8 shutters", "narrow maze", "odd"])
def test_blenders_gpu_solves_the_same(scene, on_moderngl, on_blender):
    scene = (*SCENES[scene], 1.0)
    np.testing.assert_allclose(on_blender(*scene), on_moderngl(*scene), rtol=0, atol=LEVEL / 10)


@pytest.mark.parametrize(("scene", "strength"), STRENGTHS)
def test_is_the_exact_solution(scene, strength, solve):
    labels, count, guide = SCENES[scene]
    got = solve(labels, count, guide, strength)
    assert_coefficients(got, count, labels.shape, error=1e-5)
    np.testing.assert_array_equal(got[:, labels > 0].T, np.eye(count)[labels[labels > 0] - 1])
    np.testing.assert_allclose(got, exact(scene, strength), rtol=0, atol=LEVEL)


def coarse(name, side, width, height):
    return film(*name, -(-width // side), -(-height // side))


@pytest.mark.parametrize(("film", "side"), [(BUNNY, 2), (PEOPLE, 4), (WALKERS, 8)])
def test_cells_may_be_larger_than_pixels(film, side, solve):
    """As those of large frames: strokes and dots of a pixel on smooth conductances, a size that cells do not divide."""
    width, height = 201, 135
    labels = np.maximum(shapes(12, 4, width, height), dots(4, 12, width, height))
    guide = coarse(film, side, width, height)
    wanted = exact_diffusion.solve(labels, 4, guide, 1.0)
    assert np.abs(wanted - exact_diffusion.solve(labels, 4)).max() > 20 * LEVEL
    np.testing.assert_allclose(solve(labels, 4, guide, 1.0), wanted, rtol=0, atol=LEVEL)


def test_what_was_solved_before_does_not_change_a_bit(solve):
    """Without a guide, nothing is left of one; and where nothing is free any more, nothing of what was."""
    labels, count, guide = SCENES["people, 8 shutters"]
    plain = solve(labels, count).copy()
    solve(labels, count, guide, 1.0)
    np.testing.assert_array_equal(solve(labels, count, warm=True), plain)
    labels, count, fine = SCENES["bunny"]
    for guide in (fine, coarse(BUNNY, 4, WIDTH, HEIGHT)):
        first = solve(labels, count, guide, 1.0).copy()
        solve(np.full_like(labels, 2) * (labels[::-1] == 0), count, guide[::-1], 0.5)
        np.testing.assert_array_equal(solve(labels, count, guide, 1.0, warm=True), first)
    # Half of the picture becomes a scribble, which the sums of conjugate gradients must not notice.
    labels, count, guide = shapes(13, 4, 256, 192), 4, film(*PEOPLE, 256, 192)
    wide = labels.copy()
    wide[:, 100:] = 3
    first = solve(wide, count, guide, 1.0).copy()
    solve(labels, count, guide, 1.0)
    np.testing.assert_array_equal(solve(wide, count, guide, 1.0), first)


def test_what_a_shutter_encloses_has_that_one_alone(solve):
    labels, count, guide = SCENES["enclosed"]
    got = solve(labels, count, guide, 1.0)
    np.testing.assert_array_equal(got[1, 21:44, 31:59], 1)
    np.testing.assert_array_equal(got[0, 21:44, 31:59], 0)
