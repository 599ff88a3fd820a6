"""Diffusion against the exact solution: a sparse direct solve of the 5-point Laplacian with Neumann edges."""

import numpy as np
import pytest
from exact_diffusion import solve as exact
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shutter_addon.compute.diffusion import diffuse
from shutter_addon.core.model.scribbles import Shape, rasterise

LEVEL = 1 / 255


def line(shutter, *points, width=0.0):
    return Shape(shutter, "line", width, (np.array(points, float),))


def circle(shutter, x, y, radius, width=0.0):
    turn = np.linspace(0, 2 * np.pi, 65)
    return line(shutter, *zip(x + radius * np.cos(turn) * 9 / 16, y + radius * np.sin(turn), strict=True), width=width)


def blank(width, height):
    return np.zeros((height, width), np.uint16)


def four_lines_and_a_ring(width=480, height=270):
    shapes = [
        line(0, (0.1, 0.1), (0.3, 0.8), width=0.02),
        line(1, (0.5, 0.2), (0.6, 0.9), width=0.02),
        line(2, (0.8, 0.1), (0.9, 0.5), width=0.01),
        line(3, (0.35, 0.5), (0.45, 0.3), width=0.03),
        circle(1, 0.7, 0.6, 0.12, width=0.02),
    ]
    return rasterise(shapes, width, height), 4


def edge_lines():
    labels = blank(300, 200)
    labels[0], labels[-1] = 1, 2
    return labels, 2


def touching_lines():
    labels = blank(320, 180)
    labels[20:160, 100], labels[20:160, 101] = 1, 2
    labels[90, 102:300], labels[91, 102:300] = 3, 1
    return labels, 3


def wall(width=640, height=90, x=255):
    """Two lines side by side across the picture: the slowest of all known scenes, the more so the larger it is."""
    labels = blank(width, height)
    labels[:, x : x + 2] = 1, 2
    return labels, 2


def dots(count=12, shutters=5, width=320, height=180):
    labels, rng = blank(width, height), np.random.default_rng(0)
    labels[rng.integers(0, height, count), rng.integers(0, width, count)] = 1 + np.arange(count) % shutters
    return labels, shutters


def hole_in_a_wall():
    labels = blank(320, 180)
    labels[:, 160], labels[:, 0], labels[:, -1], labels[40:140, 80] = 1, 2, 3, 1
    labels[90, 160] = labels[60, 80] = 0
    return labels, 3


def spiral(gap, side=256):
    labels = blank(side, side)
    a, b = 0, side - 1
    while b - a > 2 * gap:
        labels[a, a : b + 1], labels[a : b + 1, b] = 1, 2
        labels[b, a + gap : b + 1], labels[a + gap : b + 1, a + gap] = 1, 2
        a, b = a + gap, b - gap
    return labels, 2


def maze(gap, side=256):
    """Long corridors between walls of two shutters, and a pixel of a third where they start."""
    labels = blank(side, side)
    for k, y in enumerate(range(gap, side, gap)):
        labels[y, slice(0, -gap) if k % 2 else slice(gap, None)] = 1 + (k % 3 == 0)
    labels[0, 0] = 3
    return labels, 3


def random_shapes(seed, shutters=6, width=333, height=187, count=14):
    rng = np.random.default_rng(seed)
    shapes = []
    for i in range(count):
        points = rng.random((rng.integers(2, 6), 2)) * rng.choice([0.3, 1.0])
        shapes.append(Shape(i % shutters, rng.choice(["line", "lasso"]), rng.choice([0.0, 0.01, 0.05]), (points,)))
    return rasterise(shapes, width, height), shutters


def scattered(width, height, share, shutters=3, seed=1):
    rng = np.random.default_rng(seed)
    labels = rng.integers(1, shutters + 1, (height, width)) * (rng.random((height, width)) < share)
    labels[height // 2, width // 2] = 1
    return labels.astype(np.uint16), shutters


def lattice(across, down, at, seed, width=192, height=120, size=(1, 1), kept=1.0):
    """Dots of random shutters, or blocks of `size` pixels, every so many pixels from one on; a share of them kept."""
    labels, rng = blank(width, height), np.random.default_rng(seed)
    columns, rows = -(-width // across), -(-height // down)
    ids = rng.integers(1, 5, (rows, columns)) * (rng.random((rows, columns)) < kept)
    for x, y in np.ndindex(size):
        part = labels[at[1] + y :: down, at[0] + x :: across]
        part[:] = ids[: part.shape[0], : part.shape[1]]
    return labels, 4


# Even cells are those of the coarser grids; pictures of even sizes end beyond the last of them.
EVENS = ((2, 4), (4, 2), (4, 4), (2, 8), (8, 8))
LATTICES = [(pitch, at, (1, 1), 1.0) for pitch in EVENS for at in ((0, 0), (1, 0))] + [
    ((16, 8), (10, 0), (1, 1), 1.0),
    ((20, 6), (18, 2), (1, 1), 0.7),
    ((4, 4), (0, 0), (3, 1), 1.0),
    ((4, 6), (0, 0), (1, 3), 1.0),
    ((4, 4), (0, 0), (1, 1), 0.3),
    ((12, 4), (5, 3), (3, 3), 1.0),
]


def enclosed():
    """A 1-px ring of shutter 1 right inside one of shutter 2, and shutter 0 outside both."""
    shapes = [line(0, (0.02, 0.1), (0.05, 0.9), width=0.02), circle(1, 0.5, 0.5, 0.3), circle(2, 0.5, 0.5, 0.315)]
    return rasterise(shapes, 320, 180), 3


SCENES = {
    "four lines and a ring": four_lines_and_a_ring(),
    "edge lines": edge_lines(),
    "touching": touching_lines(),
    "wall": wall(),
    "dots": dots(),
    "hole": hole_in_a_wall(),
    "spiral": spiral(3),
    "maze": maze(5),
    "random, 9": random_shapes(3, shutters=9, count=20),
    "dust": scattered(160, 120, 0.003),
    "noise": scattered(161, 120, 0.2),
    "enclosed": enclosed(),
    "1×1": scattered(1, 1, 0),
    "97×1": scattered(97, 1, 0.03),
    "2×3": scattered(2, 3, 0.2),
}


@pytest.fixture(scope="module", params=["numpy", "moderngl"])
def solve(request):
    return diffuse if request.param == "numpy" else request.getfixturevalue("on_moderngl")


def both(on_moderngl):
    """Each solver and the error that it may have: on a device, what is linear far from scribbles adds to it."""
    return (diffuse, LEVEL / 2), (on_moderngl, LEVEL)


def assert_coefficients(got, count, shape, error=1e-6):
    assert got.shape == (count, *shape)
    assert got.dtype == np.float32
    assert got.min() >= 0
    np.testing.assert_allclose(got.sum(axis=0), 1, atol=error)


@pytest.mark.parametrize("scene", SCENES)
def test_is_the_exact_solution_on_both(scene, on_moderngl):
    labels, count = SCENES[scene]
    want = exact(labels, count)
    for solve, error in both(on_moderngl):
        got = solve(labels, count)
        assert_coefficients(got, count, labels.shape)
        np.testing.assert_array_equal(got[:, labels > 0], want[:, labels > 0])
        np.testing.assert_allclose(got, want, rtol=0, atol=error)


# What two devices do alike, a few scenes tell.
FEW = "four lines and a ring", "touching", "random, 9", "noise"


@pytest.mark.parametrize("scene", FEW)
def test_blenders_gpu_solves_the_same(scene, on_moderngl, on_blender):
    labels, count = SCENES[scene]
    np.testing.assert_allclose(on_blender(labels, count), on_moderngl(labels, count), rtol=0, atol=LEVEL / 100)


def test_dots_anywhere_are_exact(on_moderngl):
    """And in a large picture: the larger, the more grids lose what lies on their coarse cells."""
    scenes = [lattice(*pitch, at, 1, size=size, kept=kept) for pitch, at, size, kept in LATTICES]
    for labels, count in (*scenes, lattice(8, 8, (0, 0), 2, 640, 360)):
        np.testing.assert_allclose(on_moderngl(labels, count), exact(labels, count), rtol=0, atol=LEVEL)


SIDES, SHARES = st.integers(1, 70), st.sampled_from([0.0, 0.002, 0.02, 0.1, 0.5, 1.0])


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(width=SIDES, height=SIDES, shutters=st.integers(1, 10), share=SHARES, seed=st.integers(0, 2**32 - 1))
def test_any_pixels_may_be_fixed(on_moderngl, width, height, shutters, share, seed):
    labels, count = scattered(width, height, share, shutters, seed)
    want = exact(labels, count)
    for solve, error in both(on_moderngl):
        np.testing.assert_allclose(solve(labels, count), want, rtol=0, atol=error)


def test_enclosed_regions_have_one_shutter_alone(solve):
    labels, count = SCENES["enclosed"]
    inside = exact(labels, count)[1] > 1 - 1e-9
    assert inside.sum() > 5000
    got = solve(labels, count)
    np.testing.assert_array_equal(got[1][inside], 1)
    np.testing.assert_array_equal(got[[0, 2]][:, inside], 0)


def test_what_is_solved_at_once_stays_so(solve):
    """In one iteration, for some of the shutters; others need more."""
    labels = np.array([[5, 5, 5, 5, 5], [1, 0, 0, 6, 5], [1, 1, 1, 1, 5]])
    assert np.abs(solve(labels, 6) - exact(labels, 6)).max() <= LEVEL


@pytest.mark.parametrize("size", [(1, 1), (64, 48), (37, 5)])
def test_without_scribbles_the_first_shutter_is_everywhere(solve, size):
    got = solve(blank(*size), 6)
    np.testing.assert_array_equal(got, np.broadcast_to(np.eye(6)[0][:, None, None], got.shape))


def test_the_device_forgets_earlier_frames(on_moderngl):
    labels, count = SCENES["random, 9"]
    want = on_moderngl(labels, count)
    full, mostly = blank(*labels.shape[::-1]) + 3, labels.copy()
    mostly[20:160, 30:300] = 2
    others = labels[::-1], blank(*labels.shape[::-1]), full, mostly, labels[:, ::-1]
    for other in (*others, *(scene for scene, _ in list(SCENES.values())[1:3])):
        on_moderngl(other, count)
        on_moderngl(other[::-1], count, warm=True)
        np.testing.assert_array_equal(on_moderngl(labels, count), want)


def test_moved_scribbles_start_from_the_last_solution(on_moderngl):
    labels, count = SCENES["four lines and a ring"]
    on_moderngl(labels, count)
    for _ in range(2):
        labels = np.roll(labels, (1, -2), axis=(0, 1))
        got = on_moderngl(labels, count, warm=True)
        assert_coefficients(got, count, labels.shape)
        np.testing.assert_allclose(got, exact(labels, count), rtol=0, atol=LEVEL)
