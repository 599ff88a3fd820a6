"""Lightest, darkest and median: both devices against the float64 reference, and that against what it has to be."""

import dataclasses

import numpy as np
import pytest
from test_composition import SHAPES, check, composed, footage, state

from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.renderer import open_compositor
from shutter_addon.core.model.frame_state import AVERAGE, Combine, Following, FrameState, Options
from shutter_addon.core.pixels import combined, compositor

LIGHTEST, DARKEST, MEDIAN = (Combine.of(mode) for mode in ("lightest", "darkest", "median"))
MODES = {
    "lightest": LIGHTEST,
    "darkest": DARKEST,
    "median": MEDIAN,
    "by luminance": Combine.of("lightest", by_luminance=True),
    "dark by luminance": Combine.of("darkest", by_luminance=True),
    "threshold": Combine.of("lightest", threshold=0.4, softness=0.3),
    "dark threshold": Combine.of("darkest", True, threshold=0.2, softness=0.1),
}
FEW = "threshold", "dark by luminance", "median"


@pytest.fixture(params=["gpu", "cpu", "blender"], scope="module")
def device(request):
    if request.param == "blender":
        return GPUCompositor(request.getfixturevalue("blender_device"))
    return open_compositor(request.param)


def combining(rng, *combines, window=9, **options):
    options.setdefault("shapes", tuple(shape for shape in SHAPES if shape.shutter < len(combines)))
    moment = state(rng, window, count=len(combines), **options)
    return dataclasses.replace(moment, combines=combines)


@pytest.mark.parametrize("mode", ["lightest", "darkest", "median"])
@pytest.mark.parametrize("window", [2, 3, 16, 64, 256])
def test_windows_of_any_length(device, mode, window):
    rng = np.random.default_rng(window)
    moment = combining(rng, *[MODES[mode]] * 2, window=window, shapes=())
    check(device, footage(rng, count=window + 3, size=(9, 7)), moment, 1)


@pytest.mark.parametrize("interpolation", ["displacement", "value"])
@pytest.mark.parametrize("direction", [1, -1])
def test_ways_are_mixed(device, interpolation, direction):
    rng = np.random.default_rng(3)
    combines = LIGHTEST, AVERAGE, MODES["threshold"], DARKEST, MEDIAN, LIGHTEST
    moment = combining(rng, *combines, interpolation=interpolation, position="center", aggregate=4)
    check(device, footage(rng), moment, 9, direction)


@pytest.mark.parametrize("edges", ["hold", "shorten"])
@pytest.mark.parametrize("index", [9, 19])
@pytest.mark.parametrize("kind", [{}, {"dtype": np.uint16}, {"alpha": "straight"}], ids=["8 bits", "16 bits", "alpha"])
def test_ways_of_which_one_follows(device, edges, index, kind):
    """The others are seen in the same window of whole frames."""
    rng = np.random.default_rng(4)
    moment = combining(rng, AVERAGE, DARKEST, MEDIAN, MODES["threshold"], edges=edges)
    turns, shifts = np.ones((20, 4), complex), np.zeros((20, 4), complex)
    shifts[:, 1] = np.arange(20) * (0.7 - 0.3j)
    check(device, footage(rng, **kind), dataclasses.replace(moment, following=Following(0, turns, shifts)), index)


@pytest.mark.parametrize("mode", FEW)
@pytest.mark.parametrize("kind", [{}, {"alpha": "straight"}], ids=["opaque", "straight"])
@pytest.mark.parametrize(("index", "position"), [(19, "start"), (0, "end")])
def test_all_that_is_exposed_is_left_out(device, mode, kind, index, position):
    """Open ahead of the shown frame alone, at the clip's last one, or behind it, at the first: the nearest is seen."""
    rng = np.random.default_rng(6)
    moment = combining(rng, MODES[mode], shapes=(), edges="shorten", position=position)
    moment.bars[:, slice(0, 3) if index else slice(-3, None)] = 0
    moment.bars[:, 4] += 0.1
    check(device, footage(rng, **kind), moment, index)


@pytest.mark.parametrize("follows", [False, True])
@pytest.mark.parametrize("combines", [(LIGHTEST,), (DARKEST, DARKEST), (MEDIAN, MEDIAN)])
def test_the_middle_of_what_is_left_out_is_that_of_an_average(device, combines, follows):
    """Of several bars that all count 1, which of two frames is the nearest."""
    rng = np.random.default_rng(11)
    moment = combining(rng, *combines, interpolation="value", edges="shorten", position="end")
    moment.bars[:] = [[0, 0.7, 0.7, 0.7, 0.7, 0, 0, 0, 0], [0, 0, 0, 0.2, 0.2, 0, 0, 0, 0]][: len(combines)]
    if follows:
        shifts = np.arange(20)[:, None] * np.linspace(0.7, 0.3 - 0.3j, len(combines))
        moment = dataclasses.replace(moment, following=Following(0, np.ones_like(shifts), shifts))
    check(device, footage(rng), moment, 18, -1)


@pytest.mark.parametrize("follows", [False, True])
def test_the_shown_frame_may_be_left_out(device, follows):
    """Played in reverse, a filmed frame begins with its last moment, which the clip's end does not have."""
    rng = np.random.default_rng(6)
    moment = combining(rng, MODES["threshold"], shapes=(), edges="shorten", step=4)
    if follows:
        shifts = np.arange(20)[:, None] * (0.7 - 0.3j)
        moment = dataclasses.replace(moment, following=Following(0, np.ones((20, 1), complex), shifts))
    source = footage(rng)
    source.frames[..., :3] //= 2
    check(device, source, moment, 19, -1)


def test_a_long_median_of_any_light(device):
    """More iterations than a software renderer has."""
    rng = np.random.default_rng(8)
    source = footage(rng, count=230, size=(9, 7), dtype=np.float32, transfer="linear")
    check(device, source, combining(rng, *[MEDIAN] * 3, window=220), 1)


@pytest.mark.parametrize(
    ("mode", "first"), [("lightest", 0), ("darkest", 0), ("by luminance", 0), ("threshold", 2), ("dark threshold", 2)]
)
def test_light_below_black(device, mode, first):
    """With a threshold, blue alone: what is shown may be below what leaves a trail."""
    rng = np.random.default_rng(10)
    source = footage(rng, dtype=np.float32, transfer="linear")
    source.frames[..., first:3] -= 5
    picture, expected = composed(device, source, combining(rng, MODES[mode], shapes=()), 2)
    assert expected.min() < -0.03
    np.testing.assert_allclose(picture, expected, atol=1e-4)


@pytest.mark.parametrize("mode", FEW)
@pytest.mark.parametrize("interpolation", ["displacement", "value"])
@pytest.mark.parametrize("kind", [{}, {"alpha": "straight"}], ids=["opaque", "straight"])
def test_what_follows(device, mode, interpolation, kind):
    rng = np.random.default_rng(9)
    moment = combining(rng, MODES[mode], AVERAGE, MODES[mode], interpolation=interpolation)
    turns = np.exp(1j * np.linspace(0, 0.2, 12))[:, None] * np.ones((1, 3))
    shifts = np.linspace(0, 4 + 2j, 12)[:, None] * np.array([0, 1, -1])
    turns[:, 0] = 1
    moment = dataclasses.replace(moment, following=Following(3, turns, shifts))
    check(device, footage(rng, **kind), moment, 3)


# What the reference has to be


def whole(mode, bars, frames):
    """The reference's picture of one shutter everywhere."""
    bars = np.atleast_2d(np.asarray(bars, float))
    moment = FrameState(Options(bars.shape[1]), bars, combines=(mode,) * len(bars))
    c = np.full((len(bars), *frames.shape[1:3]), 1 / len(bars))
    return compositor.compose(moment, frames, np.ones(len(frames), bool), c)[..., :3]


def opaque(rng, count, size=(5, 4)):
    frames = rng.random((count, *size, 4))
    frames[..., 3] = 1
    return frames


@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_equal_bars_are_numpys(count):
    rng = np.random.default_rng(11)
    frames = opaque(rng, count)
    for mode, function in ((LIGHTEST, np.max), (DARKEST, np.min), (MEDIAN, np.median)):
        np.testing.assert_allclose(whole(mode, np.ones(count), frames), function(frames[..., :3], axis=0), atol=1e-12)


def test_weights_of_a_median_count():
    frames = opaque(np.random.default_rng(12), 3)
    expected = np.median(frames[[0, 0, 0, 1, 2, 2], ..., :3], axis=0)
    np.testing.assert_allclose(whole(MEDIAN, [3, 1, 2], frames), expected, atol=1e-12)


def test_a_trail_fades():
    """Into black, or into white; the highest bar counts whole, whatever it is."""
    frames = opaque(np.random.default_rng(13), 3)
    colors = frames[..., :3] * np.array([1, 0.5, 0.25])[:, None, None, None]
    np.testing.assert_allclose(whole(LIGHTEST, [8, 4, 2], frames), colors.max(axis=0), atol=1e-12)
    dark = 1 - (1 - frames[..., :3]) * np.array([1, 0.5, 0.25])[:, None, None, None]
    np.testing.assert_allclose(whole(DARKEST, [8, 4, 2], frames), dark.min(axis=0), atol=1e-12)


@pytest.mark.parametrize("length", [8, 32, 128])
def test_brightness_does_not_depend_on_the_length(length):
    """Nor does it between two boxes, which are displaced."""
    frames = opaque(np.random.default_rng(14), 1).repeat(length, 0)
    boxes = np.zeros((2, length))
    boxes[0], boxes[1, : length // 4] = 1, 1
    np.testing.assert_allclose(whole(LIGHTEST, boxes, frames), frames[0, ..., :3], atol=1e-9)


def test_a_threshold_keeps_dark_light_out():
    """What is bright leaves a trail; where nothing is, the shown frame stays, whatever its bar is."""
    frames = np.zeros((3, 1, 2, 4))
    frames[..., 3] = 1
    frames[0, 0, :, :3], frames[1, 0, 0, :3], frames[1, 0, 1, :3] = 0.1, 0.9, 0.4
    picture = whole(Combine.of("lightest", threshold=0.5), [0, 1, 0], frames)
    np.testing.assert_allclose(picture[0], [[0.9] * 3, [0.1] * 3], atol=1e-12)


def test_by_luminance_colours_stay_together():
    frames = np.zeros((2, 1, 1, 4))
    frames[..., 3] = 1
    frames[:, 0, 0, :3] = (0.9, 0, 0.2), (0, 0.5, 0.1)
    by = whole(Combine.of("lightest", by_luminance=True), [1, 1], frames)
    np.testing.assert_allclose(by[0, 0], (0, 0.5, 0.1))
    np.testing.assert_allclose(whole(LIGHTEST, [1, 1], frames)[0, 0], (0.9, 0.5, 0.2))


def test_a_median_is_continuous():
    """Between the samples beside the middle, as their weights change by a little."""
    values = np.array([0.0, 1.0])
    shares = np.linspace(0.49, 0.51, 4001)
    found = combined.weighted_median(np.broadcast_to(values[:, None], (2, 4001)), np.stack([shares, 1 - shares]))
    assert found[0] == 1
    assert found[-1] == 0
    assert found[2000] == pytest.approx(0.5, abs=1e-6)
    assert np.abs(np.diff(found)).max() < 0.03
