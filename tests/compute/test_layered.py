"""Layers on all devices, against their formula in float64."""

import dataclasses
import itertools
from unittest import mock

import numpy as np
import pytest
from test_composition import LEVEL, SHAPES, Footage, footage, state

from shutter_addon.compute import layer_frames
from shutter_addon.compute.devices.device import Budget
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.renderer import Renderer, open_compositor, open_gl
from shutter_addon.compute.request import Request
from shutter_addon.core.frames import light
from shutter_addon.core.frames.frame_source import Moment, as_rgba
from shutter_addon.core.model import windows
from shutter_addon.core.model.frame_state import Following, FrameState, Layers, Options
from shutter_addon.core.model.mattes import FileFrame, Matte
from shutter_addon.core.pixels import compositor, layering
from shutter_addon.core.pixels.layering import separated
from shutter_addon.features.smooth.smooth import SmoothSource
from shutter_addon.media.flow import Between
from shutter_addon.media.matte_values import MatteValues

SIZE, COUNT, SHOWN = (37, 23), 20, 9


class Values:
    """A matte file in memory, which counts what is read."""

    def __init__(self, values):
        self.values, self.reads = values, []
        self.count, self.height, self.width = values.shape
        self.fps = None

    def open(self):
        return self

    def close(self):
        pass

    def read(self, index):
        self.reads.append(index)
        return self.values[index].astype(np.float32)


def discs(speed=1.5, radius=5.0, soft=3.0, top=0.5):
    """Mattes (COUNT, H, W) of a disc that moves to the right, its edge `soft` pixels wide."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    away = [np.hypot(x - 4 - speed * k, y - top * SIZE[1]) for k in range(COUNT)]
    values = np.clip((radius - np.stack(away)) / soft + 0.5, 0, 1)
    return np.rint(values * 65535) / 65535


def drawn_state(rng, **options):
    """Without decontamination, which is an estimate: what is left is a formula."""
    return state(rng, **{"decontaminate": False} | options)


def with_layers(moment, *mattes, opacities=None, camera=None):
    """A state with a layer of shutters 2, 0 … for each of the mattes, and their files."""
    files = [Values(each) for each in mattes]
    of_frame = tuple(Matte(shutter=0, content=FileFrame(file=file)) for file in files)
    layers = Layers(
        shutters=(2, 0, 1)[: len(mattes)],
        opacities=opacities or (1.0,) * len(mattes),
        first=0,
        scribbles=(None,) * COUNT,
        mattes=(of_frame,) * COUNT,
        camera=camera,
    )
    return dataclasses.replace(moment, layers=layers), files


def drawn(device, source, moment, index=SHOWN, direction=1, **asked):
    renderer = Renderer(device, source, MatteValues(source.width, source.height))
    picture = renderer.picture(Request(index, moment, direction, **asked))
    return renderer, picture


def plain(moment):
    return dataclasses.replace(moment, layers=None)


def formula(device, sources, moment, mattes):
    """The picture by the formula, frame after frame, and where what lies behind is seen enough, and at all covered.

    sources: one for what lies behind, and one for each layer"""
    c = Renderer(device, sources[0]).coefficients(Request(SHOWN, plain(moment))).astype(np.float64)
    indices = windows.indices(moment.options, SHOWN, range(COUNT))
    parts, m = [each.linear()[indices] for each in sources], np.stack([matte[indices] for matte in mattes])
    normalised = moment.bars / moment.bars.sum(axis=1, keepdims=True)
    mix = np.moveaxis(c / c.sum(axis=0), 0, -1)
    q = compositor.mixed_shutter(dataclasses.replace(moment, bars=normalised), mix)
    seen = np.moveaxis(q / q.sum(axis=-1, keepdims=True), -1, 0) * (1 - m).prod(axis=0)

    def mean(weights, of):
        return np.einsum("khw,khwc->hwc", weights / np.maximum(weights.sum(axis=0), 1e-9), of)

    picture = mean(seen, parts[0])
    for shutter, matte, frames in zip(moment.layers.shutters, m, parts[1:], strict=True):
        weights = normalised[shutter][:, None, None] * matte
        cover = weights.sum(axis=0)[..., None]
        picture = cover * mean(weights, frames) + (1 - cover) * picture
    return picture, seen.sum(axis=0) >= layering.CLEAR, (m > 0).any(axis=(0, 1))


def assert_near(picture, expected, where=...):
    difference = np.abs(light.to_encoded(picture.astype(np.float64)) - light.to_encoded(expected))
    assert (difference / np.maximum(1, np.abs(expected)))[where].max() <= LEVEL


@pytest.mark.parametrize("aggregate", [1, 2])
def test_mattes_are_shown_with_those_of_layers(device, aggregate):
    rng, mattes = np.random.default_rng(18), [discs(), discs(-1.0, top=0.3)]
    source = footage(rng, COUNT, SIZE)
    moment, _ = with_layers(drawn_state(rng, window=6, aggregate=aggregate), *mattes, opacities=(1.0, 0.7))
    renderer = Renderer(device, source, MatteValues(*SIZE))
    shown = renderer.drawn_with_layers(Request(SHOWN, moment))
    with device.current():
        found = device.coefficients(shown.handle, 3)
    expected = renderer.coefficients(Request(SHOWN, plain(moment))).repeat(aggregate, 1).repeat(aggregate, 2)
    expected = expected[:, : SIZE[1], : SIZE[0]].astype(np.float64)
    expected /= expected.sum(axis=0)
    for shutter, matte in ((2, mattes[0][SHOWN]), (0, 0.7 * mattes[1][SHOWN])):
        expected *= 1 - matte
        expected[shutter] += matte
    assert shown.block == 1
    assert np.abs(found - expected).max() < 1e-5
    without, block = renderer.drawn_with_layers(Request(SHOWN, plain(moment)))
    with device.current():
        assert device.coefficients(without, 3).shape[1] == -(-SIZE[1] // block)


def test_a_picture_does_not_depend_on_those_before(device):
    rng = np.random.default_rng(5)
    source, base = footage(rng, COUNT, SIZE), drawn_state(rng, window=6)
    first, other = (with_layers(base, discs(top=top))[0] for top in (0.5, 0.8))
    shown = [(index, first) for index in (3, 4, 5, 9, 8)] + [(8, other), (8, plain(first)), (8, first)]
    renderer = Renderer(device, source, MatteValues(*SIZE))
    passed = [renderer.picture(Request(*asked)) for asked in shown]
    for (index, moment), picture in zip(shown, passed, strict=True):
        assert np.array_equal(picture, drawn(device, source, moment, index)[1])


def test_a_played_frame_costs_one_new_matte_and_a_scrub_back_none(device):
    rng = np.random.default_rng(6)
    source = footage(rng, COUNT, SIZE)
    moment, (file,) = with_layers(drawn_state(rng, window=6, plate_reach=0), discs())
    renderer = Renderer(device, source, MatteValues(*SIZE))
    renderer.picture(Request(4, moment))
    assert sorted(file.reads) == [4, 5, 6, 7, 8, 9]
    file.reads.clear(), source.reads.clear()
    renderer.picture(Request(5, moment))
    assert (file.reads, source.reads) == ([10], [10])
    file.reads.clear()
    renderer.picture(Request(4, moment))
    assert file.reads == []


def test_what_was_not_exposed_comes_from_the_nearest_clear_frame(device):
    """A camera that stands still, before it a subject that moves on: its place shows what is behind it later."""
    rng = np.random.default_rng(9)
    frames = footage(rng, 1, SIZE).frames.repeat(COUNT, 0)
    source, matte = footage(rng, COUNT, SIZE), np.zeros((COUNT, *SIZE[::-1]))
    matte[: SHOWN + 6, 5:15, 5:20] = 1
    source.frames[:] = frames
    source.frames[matte > 0] = [255, 0, 0, 255]
    bars = np.eye(3, 4)[[0, 0, 0]]
    moment, _ = with_layers(FrameState(Options(4), bars), matte, opacities=(1.0,))
    moment = dataclasses.replace(moment, layers=dataclasses.replace(moment.layers, shutters=(2,)))
    renderer, picture = drawn(device, source, moment)
    inside = matte[SHOWN] > 0
    assert_near(picture, source.linear()[SHOWN])
    # Of what is not quite covered, the plate makes up what lacks.
    half = dataclasses.replace(moment, layers=dataclasses.replace(moment.layers, opacities=(0.99,)))
    picture = renderer.picture(Request(SHOWN, half))
    behind = (0.01 * source.linear()[SHOWN] + (layering.CLEAR - 0.01) * source.linear()[-1]) / layering.CLEAR
    expected = 0.99 * source.linear()[SHOWN] + 0.01 * behind
    assert_near(picture, np.where(inside[..., None], expected, source.linear()[SHOWN]))


def of_two_colours(matte):
    """Footage of one color, and of another where a layer has some of a matte (COUNT, h, w)."""
    source = footage(np.random.default_rng(10), COUNT, SIZE)
    source.frames[:] = [200, 100, 50, 255]
    source.frames[matte > 0] = [0, 0, 255, 255]
    return source


def test_nothing_clear_within_reach_is_filled_smoothly(device):
    matte = np.zeros((COUNT, *SIZE[::-1]))
    matte[:, 5:15, 5:20] = 1
    source = of_two_colours(matte)
    options = Options(4, plate_reach=3, exposure="weighted", aggregate=2)
    moment, _ = with_layers(FrameState(options, np.ones((3, 4)), SHAPES, 8.0), matte, opacities=(0.95,))
    _, picture = drawn(device, source, moment)
    around = source.linear()[0, 0, 0]
    behind = (0.05 * source.linear()[SHOWN] + (layering.CLEAR - 0.05) * around) / layering.CLEAR
    expected = np.where(matte[SHOWN][..., None] > 0, 0.95 * source.linear()[SHOWN] + 0.05 * behind, around)
    expected[..., :3] /= 2  # half of the reference exposure
    assert_near(picture, expected)


def test_what_is_hidden_altogether_is_nothing_to_fill_from(device):
    matte = np.zeros((COUNT, *SIZE[::-1]))
    matte[:, 5:15, 5:20] = 0.95
    matte[:, 7:13, 7:18] = 1
    source = of_two_colours(matte)
    options = Options(4, plate_reach=3, decontaminate=False)
    moment, _ = with_layers(FrameState(options, np.ones((3, 4))), matte)
    _, picture = drawn(device, source, moment)
    around, own, share = source.linear()[0, 0, 0], source.linear()[SHOWN], matte[SHOWN][..., None]
    behind = (0.05 * own + (layering.CLEAR - 0.05) * around) / layering.CLEAR
    assert_near(picture, np.where(share > 0, share * own + (1 - share) * behind, around))
    covered, _ = with_layers(FrameState(options, np.ones((3, 4))), np.full_like(matte, 0.97))
    _, picture = drawn(device, source, covered)
    np.testing.assert_allclose(picture[..., 3], 1, atol=1e-6)  # of opaque footage, even if nothing is known
    wide = np.arange(8)[None] < 3
    assert (layer_frames.filled(wide[..., None].astype(np.float32), wide) == 1).all()


def test_frames_are_uncovered_anew_where_others_change_that_they_are_taken_from(device):
    rng = np.random.default_rng(16)
    source, apart = footage(rng, COUNT, SIZE), np.arange(COUNT) - SHOWN
    matte = np.zeros((COUNT, *SIZE[::-1]))
    matte[SHOWN - 5 : SHOWN + 6, 8:15, 6:14] = 0.5
    further = matte.copy()
    further[SHOWN + 6 : SHOWN + 8, 8:15, 6:14] = 0.5  # not exposed
    still, pans = (Following(0, np.ones((COUNT, 1), complex), v * apart[:, None] + 0j) for v in (1e-3, -0.7))
    moment, other = (with_layers(drawn_state(rng, window=4), each)[0] for each in (matte, further))
    near = moment.layers.mattes
    far = (*near[: SHOWN + 6], *other.layers.mattes[SHOWN + 6 :])
    kinds = (near, still), (far, still), (far, pans), (near, None), (near, still)
    layers = [dataclasses.replace(moment.layers, mattes=mattes, camera=camera) for mattes, camera in kinds]
    moments = [dataclasses.replace(moment, layers=each) for each in layers]
    renderer, pictures = Renderer(device, source, MatteValues(*SIZE)), []
    for moment in moments:
        pictures.append(renderer.picture(Request(SHOWN, moment)))
        assert np.array_equal(pictures[-1], drawn(device, source, moment)[1])
    assert [np.array_equal(*pair) for pair in itertools.pairwise(pictures)] == [False] * 4


def test_a_played_frame_uncovers_one(monkeypatch):
    """Of those whose covered places are taken from others, while the camera's keys and mattes stay."""
    uncovered = mock.Mock(side_effect=layer_frames.uncovered)
    monkeypatch.setattr(layer_frames, "uncovered", uncovered)
    rng = np.random.default_rng(17)
    source, matte = footage(rng, 60, SIZE), np.zeros((60, *SIZE[::-1]))
    matte[:, 8:15, 6:14] = 0.5
    moment, _ = with_layers(drawn_state(rng, window=6, plate_reach=3), matte)
    renderer, counts = Renderer(open_compositor(), source, MatteValues(*SIZE)), []
    for shown in (20, 21, 22, 21):
        frames = range(shown - 3, shown + 9)
        layers = dataclasses.replace(
            moment.layers,
            first=frames.start,
            scribbles=(None,) * len(frames),
            mattes=moment.layers.mattes[:1] * len(frames),
            camera=Following(frames.start, np.ones((12, 1), complex), -0.7 * (np.array(frames)[:, None] - shown) + 0j),
        )
        uncovered.reset_mock()
        renderer.picture(Request(shown, dataclasses.replace(moment, layers=layers)))
        counts.append(uncovered.call_count)
    assert counts == [6, 1, 1, 1]


@pytest.mark.parametrize("kilobytes", [150, 260, 400])
@pytest.mark.parametrize("follows", [False, True])
def test_windows_have_room_beside_one_another_or_frames_are_sent(kilobytes, follows):
    """Each of them alone would fit."""
    compositor = GPUCompositor(open_gl(Budget(kilobytes << 10)))
    rng, matte = np.random.default_rng(14), discs()
    source, moment = footage(rng, COUNT, SIZE), drawn_state(rng, window=6)
    if follows:
        shifts = (np.arange(COUNT) - SHOWN + 0j)[:, None] * [1, 0, 0]
        moment = dataclasses.replace(moment, following=Following(0, np.ones((COUNT, 3), complex), shifts))
    moment, _ = with_layers(moment, matte)
    renderer = Renderer(compositor, source, MatteValues(*SIZE))
    roomy = Renderer(open_compositor(), source, MatteValues(*SIZE))
    for index in (SHOWN, SHOWN + 1, SHOWN):
        picture, expected = (each.picture(Request(index, moment)) for each in (renderer, roomy))
        assert_near(picture, expected.astype(float))
    renderer.close()
    roomy.close()
    compositor.release()


@pytest.mark.parametrize("kind", [{}, {"dtype": np.float16, "transfer": "linear"}], ids=str)
@pytest.mark.parametrize("count", [1, 2])
def test_mixed_pixels_have_the_colours_of_their_own(device, kind, count):
    """The frames that are weighted are separated ones; elsewhere nothing changes, to the bit."""
    rng, mattes = np.random.default_rng(13), [discs(), discs(-1.0, top=0.3)][:count]
    source = footage(rng, COUNT, SIZE, **kind)
    moment, _ = with_layers(state(rng, window=6), *mattes)
    _, picture = drawn(device, source, moment)
    weighted, behind = source.linear()[..., :3].astype(np.float32), 1 - (1 - np.stack(mattes)).prod(axis=0)
    frames = [np.stack([separated(*each)[0] for each in zip(weighted, m, strict=True)]) for m in mattes]
    frames.insert(0, np.stack([separated(*each)[1] for each in zip(weighted, behind, strict=True)]))
    plain_moment = dataclasses.replace(moment, options=dataclasses.replace(moment.options, decontaminate=False))
    # As the formula has it, with frames of its own for each part.
    parts = [Footage(_encoded(each, source), source.transfer) for each in frames]
    expected, enough, covered = formula(device, parts, plain_moment, mattes)
    assert_near(picture, expected, enough)
    without = Renderer(device, source).picture(Request(SHOWN, plain(moment)))
    assert np.array_equal(picture[~covered], without[~covered])


def test_moments_lie_between_filmed_frames_with_the_colours_of_a_layer(device, monkeypatch):
    """Only filmed frames are separated."""
    from test_drawn_moments import film

    step, rng, done = 4, np.random.default_rng(21), []
    filmed = film(rng, size=SIZE)
    filmed.frames, filmed.count = filmed.frames[:5], 5
    source = SmoothSource(filmed, step)
    matte = discs()[: source.count]
    moment, _ = with_layers(state(rng, window=8, step=step), matte)
    monkeypatch.setattr(layering, "separated", lambda *given: done.append(given) or separated(*given))
    _, picture = drawn(device, source, moment)
    assert len(done) == 3
    each = [separated(*pair) for pair in zip(filmed.linear()[..., :3].astype(np.float32), matte[::step], strict=True)]
    parts = []
    for colors in (np.stack([behind for _own, behind in each]), np.stack([own for own, _behind in each])):
        ends, frames = _encoded(colors, filmed), []
        for number in range(source.count):
            k, after = divmod(number, step)
            between = Between(*filmed.frames[k : k + 2]).with_ends(*ends[k : k + 2]) if after else None
            frames.append(as_rgba(between.moment((k, k + 1), after, step)) if after else ends[k])
            if after and isinstance(source.decoded(number), Moment):
                known = matte[number - after :: step].astype(np.float32)
                matte[number] = np.rint(between.values(source.decoded(number), *known[:2]) * 65535) / 65535
        parts.append(Footage(np.stack(frames), filmed.transfer))
    without = dataclasses.replace(moment, options=dataclasses.replace(moment.options, decontaminate=False))
    expected, enough, _covered = formula(device, parts, without, [matte])
    assert_near(picture, expected, enough)


def _encoded(colors, source):
    whole = np.concatenate([colors, np.ones_like(colors[..., :1])], axis=-1)
    if source.dtype.kind == "f":
        return whole.astype(source.dtype)
    return np.rint(light.to_encoded(whole).clip(0, 1) * 255).astype(np.uint8)


def test_a_taken_pixel_never_counts_as_if_no_layer_was_in_the_way():
    """Windows of layers keep weights in half floats, which must not round its share up to a whole one."""
    seen = np.linspace(0, 1, 2001, dtype=np.float32)[None]
    colors, plate = np.zeros((*seen.shape, 3), np.float32), np.ones((*seen.shape, 4), np.float32)
    kinds = np.full(seen.shape, layer_frames.TAKEN)
    _, share = layer_frames.uncovered(colors, seen, plate, kinds)
    assert share.astype(np.float16).max() < layering.UNCOVERED
