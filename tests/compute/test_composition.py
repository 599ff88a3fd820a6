"""Both devices against the float64 reference: random footage, random shutters, every option."""

import dataclasses

import numpy as np
import pytest

from shutter_addon.compute import cpu, window
from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.devices import llvmpipe
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.renderer import Renderer, open_compositor
from shutter_addon.compute.request import Request
from shutter_addon.core.frames import light
from shutter_addon.core.frames.frame_source import FrameSource
from shutter_addon.core.model import shutters, windows
from shutter_addon.core.model.frame_state import Combine, Following, FrameState, Options
from shutter_addon.core.model.scribbles import Shape
from shutter_addon.core.pixels import compositor

LEVEL = 1 / 255


class Footage(FrameSource):
    """Frames in memory, as a source of shutter_addon.media."""

    fps, options = None, {}

    def __init__(self, frames, transfer="srgb", alpha="opaque"):
        self.frames, self.transfer, self.alpha = frames, transfer, alpha
        self.count, self.height, self.width = frames.shape[:3]
        self.dtype = frames.dtype
        self.reads = []

    def read(self, index):
        self.reads.append(index)
        return self.frames[index].copy()

    def linear(self):
        """All frames in float64, scene-linear, premultiplied."""
        values = self.frames.astype(np.float64)
        if self.dtype.kind == "u":
            values /= np.iinfo(self.dtype).max
        if self.alpha == "premultiplied":
            return light.linearised(values) if self.transfer == "srgb" else values
        return light.premultiplied(values, light.to_linear if self.transfer == "srgb" else None)


def footage(rng, count=20, size=(37, 23), dtype=np.uint8, **kind):
    shape = (count, size[1], size[0], 4)
    if np.dtype(dtype).kind == "u":
        frames = rng.integers(0, np.iinfo(dtype).max + 1, shape).astype(dtype)
    else:
        frames = (rng.random(shape) ** 3 * 4).astype(dtype)
    if kind.get("alpha", "opaque") == "opaque":
        frames[..., 3] = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    elif np.dtype(dtype).kind == "f":
        frames[..., 3] = rng.random(shape[:3])
    return Footage(frames, **kind)


SHAPES = (
    Shape(1, "line", 0.1, (np.array([[0.1, 0.2], [0.7, 0.3]]),)),
    Shape(2, "lasso", 0.0, (np.array([[0.6, 0.6], [0.9, 0.6], [0.8, 0.9]]),)),
    Shape(0, "line", 0.05, (np.array([[0.1, 0.9], [0.3, 0.5]]),)),
)


def state(rng, window=16, shapes=SHAPES, count=3, **options):
    bars = rng.random((count, window)) * (rng.random((count, window)) > 0.3)
    bars[:, 0] += 0.01
    return FrameState(Options(window, **options), bars, shapes)


def composed(device, source, moment, index, direction=1, shot=None, mattes=None):
    renderer = Renderer(device, source, mattes)
    picture = renderer.picture(Request(index, moment, direction))
    c = renderer.coefficients(Request(index, moment, direction))
    block = moment.options.aggregate
    c = c.repeat(block, 1).repeat(block, 2)[:, : source.height, : source.width].astype(np.float64)
    c /= c.sum(axis=0)
    moment = windows.slid(moment, index, direction, shot or range(source.count))
    indices = windows.indices(moment.options, index, shot or range(source.count), direction)
    moves = moment.following and moment.following.at(indices)
    expected = compositor.compose(moment, source.linear()[np.maximum(indices, 0)], indices >= 0, c, moves)
    assert picture.shape == expected.shape
    renderer.release()
    return picture, expected


def check(device, source, moment, index, direction=1, shot=None, mattes=None):
    picture, expected = composed(device, source, moment, index, direction, shot, mattes)
    # Light above white differs in proportion: compare it relatively.
    difference = np.abs(light.to_encoded(picture.astype(np.float64)) - light.to_encoded(expected))
    assert (difference / np.maximum(1, np.abs(expected))).max() <= LEVEL
    return picture, expected


def few_pieces(rng, window=16, **options):
    """Boxes, deltas and cuts, which are composed from running sums, or piece by piece."""
    moment = state(rng, window, **options)
    moment.bars[:] = np.stack([shutters.preset_bars(name, window) for name in ("ANGLE_360", "STILL", "CUTS")])
    return moment


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16])
@pytest.mark.parametrize("window", [1, 5, 64, 256])
def test_few_pieces_of_any_length(device, window, dtype):
    """The longer the window, the fewer bits are left for a frame's light in the running sums."""
    rng = np.random.default_rng(23)
    source = footage(rng, count=window + 3, size=(9, 7), dtype=dtype)
    if dtype == np.uint8:
        source.frames[..., :3] >>= 3  # dark, where a level is the smallest
    check(device, source, few_pieces(rng, window), 2)


@pytest.mark.parametrize("bars", [[1, 0, 0, 1], [0.3, 0, 0, 0.3], [1, 0.7, 0, 0, 0.7, 1], [0.1, 0.7, 0, 0, 0.7, 0.1]])
@pytest.mark.parametrize("shapes", [(), SHAPES])
@pytest.mark.parametrize("direction", [1, -1])
def test_of_two_frames_that_are_as_near_the_windows_earlier_is_shown(device, bars, shapes, direction):
    """On every device: where all that there is of a clip lies midway between two cuts."""
    source = footage(np.random.default_rng(4), count=2)
    moment = FrameState(Options(len(bars), edges="shorten", position="center"), np.array([bars] * 3, float), shapes)
    index = {1: 0, -1: 1}[direction]
    picture, _ = check(device, source, moment, index, direction)
    assert np.abs(picture - source.linear()[index]).max() < 2e-5


@pytest.mark.parametrize("tile", [4, 12])
@pytest.mark.parametrize("made", [state, few_pieces])
@pytest.mark.parametrize("block", [1, 2, 4])
def test_tiles(monkeypatch, tile, made, block):
    rng = np.random.default_rng(29)
    monkeypatch.setattr(cpu, "TILE", tile)
    for options in ({}, {"edges": "shorten"}, {"interpolation": "value"}):
        check(CPUCompositor(), footage(rng), made(rng, aggregate=block, exposure="weighted", **options), 12)


@pytest.mark.parametrize("count", [3, 6])
def test_long_windows_of_shutters_far_apart(count):
    """More turns of loops than a software renderer goes through, were pieces looked at for blocks of pixels."""
    rng = np.random.default_rng(18)
    source = footage(rng, count=40)
    shapes = [Shape(i, "line", 0.0, (np.array([[x, 0.05], [x, 0.95]]),)) for i, x in enumerate(rng.random(count))]
    moment = state(rng, 256, tuple(shapes), count)
    ramps = [np.linspace(i % 2, 1 - i % 2, 256) ** 4 + 0.01 for i in range(count)]  # from one end or the other
    moment.bars[:] = (rng.random((count, 256)) + 0.01) * ramps
    check(open_compositor("gpu"), source, moment, 0)


def test_still_frame_is_exact_to_the_bit_at_8_bits(device):
    source = footage(np.random.default_rng(10))
    bars = np.zeros((1, 8))
    bars[0, 2] = 0.3
    for index in (5, 0, 19):
        picture = Renderer(device, source).picture(Request(index, FrameState(Options(8), bars)))
        codes = np.rint(light.to_encoded(picture[..., :3].astype(np.float64)) * 255)
        assert np.array_equal(codes, source.frames[min(index + 2, 19), ..., :3])


def test_a_window_that_slides_reads_one_frame(device):
    rng = np.random.default_rng(11)
    source = footage(rng)
    renderer = Renderer(device, source)
    moment = state(rng)
    moment.bars[:, -1] = 1
    renderer.picture(Request(0, moment))
    assert source.reads == list(range(16))
    renderer.picture(Request(1, moment))
    renderer.picture(Request(1, moment))
    assert source.reads == list(range(17))
    renderer.picture(Request(0, moment))
    assert source.reads == [*range(17), 0]
    bars = np.eye(16)[[5, 6]].sum(axis=0)[None]  # frames that no shutter exposes are not read
    for edges in ("hold", "shorten"):
        source.reads.clear()
        Renderer(device, source).picture(Request(2, FrameState(Options(16, "center", edges=edges), bars)))
        assert source.reads == [0, 1]


@pytest.mark.parametrize("alpha", ["straight", "premultiplied"])
@pytest.mark.parametrize("options", [{}, {"light": "encoded"}, {"light": "encoded", "interpolation": "value"}], ids=str)
def test_no_light_becomes_infinite(options, alpha):
    """With NumPy: not by an alpha beyond 1 or next to none, nor as it is encoded."""
    rng = np.random.default_rng(21)
    source = footage(rng, dtype=np.float32, transfer="linear", alpha=alpha)
    source.frames[..., 3] = rng.choice([1e-3, 0.5, 2], source.frames.shape[:3])
    source.frames[3:12, 4:9, :9, :3] = 1e38
    source.frames[5:15, 6:12, 5:20, :3] = -3e38
    with np.errstate(over="ignore"):
        picture = Renderer(open_compositor("cpu"), source).picture(Request(9, state(rng, **options)))
    assert np.isfinite(picture).all()
    assert np.abs(picture).max() > 1e30


def test_a_picture_stays_on_the_device(gpu_device):
    rng = np.random.default_rng(18)
    source, moment = footage(rng), state(rng)
    one, other = (Renderer(GPUCompositor(gpu_device), source) for _ in range(2))
    drawn = one.draw(Request(3, moment))
    with gpu_device.current():
        other.draw(Request(4, moment))
        assert drawn.size == (source.width, source.height, 1)
        pixels = gpu_device.read(drawn)[0, ::-1]
    assert np.array_equal(pixels, other.picture(Request(3, moment)))


def test_no_new_solve_when_nothing_moved(device, monkeypatch):
    rng, solves, solver = np.random.default_rng(13), [], type(device.stages())
    solve = solver.solve
    monkeypatch.setattr(solver, "solve", lambda self, *a, **k: solves.append(1) or solve(self, *a, **k))
    renderer, moment = Renderer(device, footage(rng)), state(rng)
    first = renderer.picture(Request(0, moment))
    assert np.array_equal(first, renderer.picture(Request(0, moment)))
    renderer.picture(Request(1, moment))
    assert len(solves) == 1
    renderer.picture(Request(0, state(rng, shapes=SHAPES[1:])))
    assert len(solves) == 2


@pytest.mark.parametrize("rows", [True, False])
@pytest.mark.parametrize("size", [(37, 23), (1, 1), (70, 33)])
def test_sums_lie_in_tiles_only_where_textures_are_rows(monkeypatch, rows, size):
    """And pictures are right both ways, in bands as well: software renderers have the tiles, GPUs have not."""
    monkeypatch.setattr(llvmpipe, "is_llvmpipe", lambda name: rows)
    monkeypatch.setattr(window, "BAND_BYTES", size[0] * 8 * 17 * 32)
    rng = np.random.default_rng(20)
    device, source = open_compositor("gpu"), footage(rng, size=size)
    with device.current():
        assert device.window(source, 16).tiled == rows
    pairs = (("hold", "encoded"), ("shorten", "linear"), ("shorten", "encoded"), ("slide", "linear"))
    moments = [state(rng, edges=edges, light=light_) for edges, light_ in pairs]
    moments += [few_pieces(rng, edges="mirror"), state(rng, interpolation="value"), state(rng, count=5)]
    late = np.array([[0, 0, 1, 1], [0, 0, 0, 1.0]])  # which nothing of the shot is left for at its end
    moments += [FrameState(Options(4, edges="shorten"), late, SHAPES[:1])]
    for moment in moments:
        for index, direction in ((3, 1), (19, 1), (2, -1)):
            check(device, source, moment, index, direction)


def test_a_window_too_long_or_a_picture_too_high_for_tiles_has_none(monkeypatch):
    monkeypatch.setattr(llvmpipe, "is_llvmpipe", lambda name: True)
    device, source = open_compositor("gpu"), footage(np.random.default_rng(21), count=3, size=(37, 65))
    rows_of_tiles = -(-source.height // 16)
    with device.current():
        limits = (384, rows_of_tiles, True), (383, rows_of_tiles, False), (384, rows_of_tiles - 1, False)
        for most, layers, tiled in limits:
            monkeypatch.setattr(device.device, "max_size", most)
            monkeypatch.setattr(device.device, "max_layers", layers)
            assert device.window(source, 2).tiled == tiled


@pytest.mark.parametrize("window", [16, 64, 256])
def test_running_sums_wrap_around(window):
    """White stays white: of all light the most that sums hold."""
    source = Footage(np.full((5, 2, 3, 4), 255, np.uint8))
    source.count = 1000
    source.read = lambda index: source.frames[0]
    renderer, moment = Renderer(open_compositor("gpu"), source), few_pieces(np.random.default_rng(25), window)
    renderer.draw(Request(0, moment))
    for index in range(700):
        if index % 50 == 0 or index > 690:
            assert np.abs(renderer.picture(Request(index, moment)) - 1).max() < 1e-6
        else:
            renderer.draw(Request(index, moment))


@pytest.mark.parametrize(("edges", "last"), [("hold", 20), ("mirror", 12)])
def test_frames_that_are_seen_again_are_not_read_again(device, edges, last):
    rng = np.random.default_rng(26)
    source = footage(rng)
    renderer, moment = Renderer(device, source), few_pieces(rng, edges=edges)
    for index in range(4, last):
        renderer.picture(Request(index, moment))
    assert source.reads == list(range(4, 20))


def test_a_frame_that_cannot_be_read_spoils_no_other(device):
    rng = np.random.default_rng(28)
    source, moment = footage(rng, count=40), few_pieces(rng)
    renderer, read = Renderer(device, source), source.read
    expected = [renderer.picture(Request(index, moment)) for index in range(8)]
    renderer = Renderer(device, source)

    def fail(index):
        if index == 20:
            raise ValueError("broken")
        return read(index)

    source.read = fail
    for index in (4, 5, 6, 3):
        if index + 15 < 20:
            assert np.array_equal(renderer.picture(Request(index, moment)), expected[index])
        else:
            with pytest.raises(ValueError, match="broken"):
                renderer.picture(Request(index, moment))
    source.read = read
    assert np.array_equal(renderer.picture(Request(7, moment)), expected[7])


def test_quick_pictures_leave_no_trace_in_others(device):
    rng = np.random.default_rng(17)
    source, moment, moved = footage(rng), state(rng), state(rng, shapes=SHAPES[1:])
    renderer = Renderer(device, source)
    expected = Renderer(device, source).picture(Request(0, moment))
    for other in (moved, moment, moved):
        renderer.draw(Request(0, other, quick=True))
    with device.current():
        quick = device.read(renderer.draw(Request(0, moment, quick=True)))
    np.testing.assert_allclose(quick, expected, atol=0.1)
    assert np.array_equal(renderer.picture(Request(0, moment)), expected)


POINTS = [(0.001, 0.001), (0.999, 0.001), (0.31, 0.74), (0.65, 0.22), (0.5, 0.5)]


@pytest.fixture
def renderer(blender_device):
    return Renderer(GPUCompositor(blender_device), footage(np.random.default_rng(3)))


@pytest.mark.parametrize("interpolation", ["displacement", "value"])
@pytest.mark.parametrize("aggregate", [1, 2, 4])
@pytest.mark.parametrize("count", [2, 6])
def test_a_point_shows_its_pixels_coefficients_and_shutter(renderer, interpolation, aggregate, count):
    from shutter_addon.blender.interface.probe_gizmo import probed_at

    options = {"shapes": SHAPES if count > 2 else SHAPES[::2], "interpolation": interpolation, "aggregate": aggregate}
    request, source = Request(4, state(np.random.default_rng(count), count=count, **options)), renderer.source
    values = renderer.coefficients(request)
    for x, y in POINTS:
        row, column = int((1 - y) * source.height) // aggregate, int(x * source.width) // aggregate
        coefficients, bars = probed_at(renderer, request, (x, y))
        assert np.abs(coefficients - values[:, row, column]).max() < 1e-3
        assert coefficients.sum() == pytest.approx(1)
        between = shutters.INTERPOLATIONS[interpolation]
        assert bars == pytest.approx(between(request.state.bars, coefficients))

    for point in ((-1, -1), (1.0, 0.5), (0.5, 0.0), (0.5, 1.01)):  # beside the picture
        assert probed_at(renderer, request, point) is None


def combining(rng, *combines, window=9, **options):
    return dataclasses.replace(state(rng, window, (), len(combines), **options), combines=combines)


@pytest.mark.parametrize("mode", ["lightest", "darkest", "median"])
@pytest.mark.parametrize("window", [2, 64, 256])
def test_windows_of_any_length(device, mode, window):
    """A long median of any light takes more iterations than a software renderer has."""
    rng = np.random.default_rng(window)
    moment = combining(rng, *[Combine(mode)] * 2, window=window)
    kind = {"dtype": np.float32, "transfer": "linear"} if (mode, window) == ("median", 256) else {}
    check(device, footage(rng, count=window + 3, size=(9, 7), **kind), moment, 1)


@pytest.mark.parametrize("follows", [False, True])
def test_the_shown_frame_may_be_left_out(device, follows):
    """Played in reverse, a filmed frame begins with its last moment, which the clip's end does not have."""
    rng = np.random.default_rng(6)
    moment = combining(rng, Combine("lightest", threshold=0.4, softness=0.3), edges="shorten", step=4)
    if follows:
        shifts = np.arange(20)[:, None] * (0.7 - 0.3j)
        moment = dataclasses.replace(moment, following=Following(0, np.ones((20, 1), complex), shifts))
    source = footage(rng)
    source.frames[..., :3] //= 2
    check(device, source, moment, 19, -1)


# What the reference has to be


def test_a_median_is_continuous():
    """Between the samples beside the middle, as their weights change by a little."""
    values = np.array([0.0, 1.0])
    shares = np.linspace(0.49, 0.51, 4001)
    found = compositor.weighted_median(np.broadcast_to(values[:, None], (2, 4001)), np.stack([shares, 1 - shares]))
    assert found[0] == 1
    assert found[-1] == 0
    assert found[2000] == pytest.approx(0.5, abs=1e-6)
    assert np.abs(np.diff(found)).max() < 0.03
