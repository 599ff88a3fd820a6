"""What previews show of mattes: the shutters' colors with their patterns, the same by Blender's GPU and NumPy."""

import numpy as np
import pytest

from shutter_addon.core.pixels import patterns

WIDTH, HEIGHT, BLOCK, SHUTTERS, OPACITY = 48, 36, 4, 9, 0.75
LEVEL = 1 / 255
PLACES = [(0, 0), (WIDTH, 0), (0, HEIGHT), (WIDTH, HEIGHT)]
CORNERS = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
TO_CLIP = np.array([[2 / WIDTH, 0, 0, -1], [0, 2 / HEIGHT, 0, -1], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=np.float32)


@pytest.fixture(scope="module")
def given():
    """Colors (S, 3), the first two dark, and coefficients (H / BLOCK, W / BLOCK, S), top row first; some texels are of
    one shutter alone, as most are."""
    random = np.random.default_rng(1)
    colors = random.uniform(0.5, 1, (SHUTTERS, 3))
    colors[1:3] = (0.1, 0.2, 0.3), (0.3, 0.1, 0)
    shares = random.uniform(0, 1, (HEIGHT // BLOCK, WIDTH // BLOCK, SHUTTERS))
    shares[:SHUTTERS, :9] = np.eye(SHUTTERS)[:, None]
    return colors.astype(np.float32), (shares / shares.sum(axis=2, keepdims=True)).astype(np.float32)


def drawn(colors, shares, unit, step="COEFFICIENTS") -> np.ndarray:
    import gpu
    from gpu_extras.batch import batch_for_shader
    from mathutils import Matrix

    from shutter_addon.blender.interface import drawing

    padded = np.pad(shares, ((0, 0), (0, 0), (0, -SHUTTERS % 4)))  # layers of four shutters each
    data = np.ascontiguousarray(np.moveaxis(padded.reshape(*shares.shape[:2], -1, 4), 2, 0))
    palette = np.ones((1, 1, SHUTTERS, 4), dtype=np.float32)
    palette[..., :3] = colors
    kept = {}  # what is drawn with is not freed before
    target = gpu.types.GPUOffScreen(WIDTH, HEIGHT, format="RGBA32F")
    with target.bind(), gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        gpu.state.active_framebuffer_get().clear(color=(0.0, 0.0, 0.0, 0.0))
        gpu.matrix.load_identity()
        gpu.matrix.load_projection_matrix(Matrix(TO_CLIP.tolist()))
        shader = drawing.shader_of(step)
        shader.bind()
        for name, values in (("coefficients", data), ("palette", palette)):
            buffer = gpu.types.Buffer("FLOAT", values.size, values.reshape(-1))
            size = values.shape[2], values.shape[1]
            texture = kept[name] = gpu.types.GPUTexture(size, layers=values.shape[0], format="RGBA32F", data=buffer)
            shader.uniform_sampler(name, texture)
        shader.uniform_int("size", (WIDTH, HEIGHT))
        shader.uniform_int("block", BLOCK)
        shader.uniform_int("count", SHUTTERS)
        shader.uniform_float("unit", unit)
        shader.uniform_float("opacity", OPACITY)
        gpu.state.blend_set("NONE")
        batch_for_shader(shader, "TRI_STRIP", {"corner": PLACES, "place": CORNERS}).draw(shader)
        read = gpu.state.active_framebuffer_get().read_color(0, 0, WIDTH, HEIGHT, 4, 0, "FLOAT")
    picture = np.array(read.to_list()).reshape(HEIGHT, WIDTH, 4)
    gpu.shader.unbind()  # Blender takes a new shader at the address of one that it has freed for the bound one
    target.free()
    drawing.free()
    return picture


@pytest.mark.usefixtures("blender_device")
@pytest.mark.parametrize("unit", [1.0, 1.5, 2.0])
def test_the_reference_is_drawn(given, unit):
    colors, shares = given
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    full = shares[::-1].repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)  # the bottom row first, as in pictures of a GPU
    expected = sum(full[..., [i]] * patterns.painted(colors[i], i, x / unit, y / unit) for i in range(SHUTTERS))
    picture = drawn(colors, shares, unit)
    assert np.abs(picture[..., :3] - OPACITY * expected).max() <= LEVEL
    assert np.abs(picture[..., 3] - OPACITY).max() <= LEVEL


@pytest.mark.usefixtures("blender_device")
@pytest.mark.parametrize("unit", [1.0, 2.0])
def test_a_line_stands_around_what_a_shutter_gets(given, unit):
    """As wide as a unit of the interface is, in its color; none around the first one."""
    colors, shares = given[0], np.zeros_like(given[1])
    shares[:, :6, 0] = shares[:, 6:, 5] = 1
    picture = drawn(colors, shares, unit, "EDGES")
    seen = picture[..., 3] > 0
    assert (seen == seen[0]).all()
    columns = np.flatnonzero(seen[0])
    assert columns.tolist() == list(range(columns[0], columns[0] + len(columns)))
    assert len(columns) == pytest.approx(unit, abs=1)
    assert abs(columns.mean() + 0.5 - 6 * BLOCK) <= 1
    assert np.abs(picture[:, columns, :3] - OPACITY * colors[5]).max() <= LEVEL
    shares[..., 1:] = 0
    assert not drawn(colors, shares, unit, "EDGES").any()


def test_patterns_differ_and_leave_most_of_the_colour():
    y, x = np.mgrid[:48, :48] + 0.5
    drawn = [patterns.marks(i, x, y) for i in range(patterns.COUNT)]
    assert not drawn[0].any()
    assert all(0.1 < marks.mean() < 0.45 for marks in drawn[1:])
    for i, marks in enumerate(drawn):
        assert all((marks != other).mean() > 0.1 for other in drawn[:i])
    assert (patterns.marks(patterns.COUNT + 1, x, y) == drawn[1]).all()


@pytest.mark.parametrize("unit", [1.0, 2.0])
def test_patterns_grow_with_the_interface(unit):
    """A line is as wide at any scale of the interface, in its units."""
    x = np.arange(96) + 0.5
    starts = np.diff(patterns.marks(5, x / unit, np.zeros(96)).astype(int)) == 1
    assert np.diff(np.flatnonzero(starts)).tolist() == [8 * unit] * (len(np.flatnonzero(starts)) - 1)
