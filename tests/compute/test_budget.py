"""Memory of a GPU within a budget: every smaller way gives the same picture, and what was taken is given back."""

from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from test_composition import SHAPES, footage, state
from test_matting import Values, mattes
from test_moved import following

from shutter_addon.compute import running_sums, window
from shutter_addon.compute.devices import device as devices
from shutter_addon.compute.devices.device import Budget, NoDeviceError
from shutter_addon.compute.devices.gl import GLDevice
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.compute.renderer import Renderer
from shutter_addon.compute.request import Request
from shutter_addon.core.frames.frame_source import FrameSource

SIZE = 128, 72
PIXELS = SIZE[0] * SIZE[1]
ROOMY = 1 << 30
# Bytes per pixel of windows of 16 frames: their sums, the frames; and what fits neither, nor all grids of diffusion.
SUMS, FRAMES, HOST = 17 * 8, 16 * 4, 64
BESIDE = 16 * 6 + 4


@pytest.fixture(params=["moderngl", "blender"], scope="module")
def kind(request):
    return GLDevice if request.param == "moderngl" else type(request.getfixturevalue("blender_device"))


@pytest.fixture(scope="module")
def two_devices(kind):
    """Kept for all tests: each compiles its passes anew."""
    devices = kind(Budget(ROOMY)), kind(Budget(ROOMY))
    yield devices
    for device in devices:
        device.release()


@pytest.fixture
def limited(two_devices):
    """Gives a device the budget that it has from then on; everything has to be given back."""
    budgets = []

    def limit(given: Budget | int, which: int = 0):
        device = two_devices[which]
        device.budget = given if isinstance(given, Budget) else Budget(given)
        budgets.append(device.budget)
        return device

    yield limit
    assert [each.used for each in budgets] == [0] * len(budgets)
    for device in two_devices:
        device.ask_others = None
        assert (device._held, device._windows) == ({}, {})  # what stays here takes the host's memory, which none counts


def film(seed=3, **kind):
    return footage(np.random.default_rng(seed), size=SIZE, **kind)


def free(compositor):
    """What it has itself; its device stays."""
    with mock.patch.object(compositor.device, "release"):
        compositor.release()


def moment(**given):
    return state(np.random.default_rng(4), **given)


class NotedCompositor(GPUCompositor):
    """windows: all that it has made."""

    def __init__(self, device):
        super().__init__(device)
        self.windows = []

    def window(self, *given):
        self.windows.append(super().window(*given))
        return self.windows[-1]


def rendered(device, source: FrameSource, states, mattes=None):
    """The pictures of these moments at frames 2, 3, …, the kind of their window, and whether the last one was slow."""
    compositor = NotedCompositor(device)
    renderer = Renderer(compositor, source, mattes)
    pictures = [renderer.picture(Request(2 + i, shown)) for i, shown in enumerate(states)]
    is_short, kind = renderer.is_short, type(compositor.windows[-1]).__name__
    renderer.close()
    free(compositor)
    return np.array(pictures), kind, is_short


def test_textures_wait_on_the_host_and_come_back(limited):
    rng, device = np.random.default_rng(1), limited(2 * PIXELS * 16)
    layers = rng.normal(size=(5, SIZE[1], SIZE[0], 4)).astype(np.float32)
    with device.current():
        textures = [device.texture(*SIZE, 1, "rgba32f") for _ in layers]
        for texture, values in zip(textures, layers, strict=True):
            device.write(texture, values)
            assert device.budget.used <= device.budget.limit
        for texture, values in zip(textures, layers, strict=True):
            assert np.array_equal(device.read(texture)[0], values)
        for texture in textures:
            texture.release()
        with pytest.raises(ValueError, match="was released"):
            device.read(textures[0])


def test_what_can_never_fit_is_refused_at_once(limited):
    device = limited((3 << 20) - 1)
    with device.current():
        kept = device.texture(64, 64, 1, "rgba32f")
        with pytest.raises(NoDeviceError, match="has no room for 4 layers of 512×512 in the 2 MB that it may take"):
            device.texture(512, 512, 4, "rgba8")
        assert kept.own is not None
        frames = [device.texture(512, 512, 1, "rgba8") for _ in range(2)]
        with pytest.raises(NoDeviceError, match="has no room"):  # frames do not move
            device.texture(512, 512, 1, "rgba8")
        assert kept.waiting is not None
        for texture in (kept, *frames):
            texture.release()


@pytest.mark.parametrize("options", [{}, {"edge_aware": 1.0}, {"count": 8}])
def test_smaller_ways_show_the_same(limited, options):
    source, shown = film(), [moment(**options), moment(shapes=SHAPES[:2], **options)]
    beside = window.beside(source, options.get("count", 3))
    roomy, kind, is_short = rendered(limited(beside + SUMS * PIXELS), source, shown)
    assert (kind, is_short) == ("Sums", False)
    resident, kind, is_short = rendered(limited(beside + FRAMES * PIXELS), source, shown)
    assert (kind, is_short) == ("Frames", False)
    assert 0 < np.abs(resident - roomy).max() <= 2**-14
    least = 2 * HOST if "count" in options else HOST  # what a pass of diffusion binds
    sent, kind, is_short = rendered(limited(least * PIXELS), source, shown)
    assert (kind, is_short) == ("Frames", True)
    assert np.array_equal(sent, resident)


@pytest.mark.parametrize("what", ["follows", "follows in floats", "mattes"])
def test_what_follows_and_mattes_fit_too(limited, what):
    source, reader = film(**({"dtype": np.float16, "transfer": "linear"} if "floats" in what else {})), None
    rng, room = np.random.default_rng(5), 96
    shown = [following(rng, source, moment(), (0, 1)) for _ in range(2)]
    if what == "mattes":
        shown, reader, room = [replace(moment(), mattes=mattes(rng, 3))] * 2, Values(source), HOST
    roomy, _, _ = rendered(limited(ROOMY), source, shown, reader)
    small, _, is_short = rendered(limited(PIXELS * room), source, shown, reader)
    assert is_short
    assert np.abs(small - roomy).max() <= 2**-14  # sums of other parts


def test_several_effects_take_turns_and_show_the_same(limited):
    """The window that was used longest ago is freed, and read again; none takes a smaller way."""
    sources, limit = [film(seed) for seed in range(3)], PIXELS * (SUMS + BESIDE + 40)
    alone = [rendered(limited(limit), source, [moment()] * 2)[0] for source in sources]
    compositor = NotedCompositor(limited(limit))
    renderers = [Renderer(compositor, source) for source in sources]
    for index in range(2):
        for renderer, wanted in zip(renderers, alone, strict=True):
            assert np.array_equal(renderer.picture(Request(2 + index, moment())), wanted[index])
            assert type(compositor.windows[-1]) is running_sums.Sums
            assert compositor.windows[-1].is_open
    assert len(compositor.windows) == 6
    assert sum(each.is_open for each in compositor.windows) == 1
    last = renderers[0].picture(Request(3, moment()))  # whose texture was freed
    assert np.array_equal(last, alone[0][1])
    for renderer in renderers:
        renderer.close()
    free(compositor)


def test_pictures_do_not_depend_on_those_before(limited):
    source, rng = film(), np.random.default_rng(7)
    shown = [moment(), following(rng, source, moment(), (0, 1)), moment(shapes=()), moment(edge_aware=0.5)]
    limit = PIXELS * (FRAMES + BESIDE)
    alone = [rendered(limited(limit), source, [one])[0][0] for one in shown]
    device = limited(limit)
    compositor = GPUCompositor(device)
    renderer = Renderer(compositor, source)
    for i in (0, 1, 2, 3, 1, 0, 3, 2, 0):
        assert np.array_equal(renderer.picture(Request(2, shown[i])), alone[i])
    renderer.release()
    assert np.array_equal(renderer.picture(Request(2, shown[0])), alone[0])
    renderer.close()
    free(compositor)


def test_devices_share_a_budget(limited):
    """What one has taken the other lacks, until it is asked to free it."""
    wanted, _, _ = rendered(limited(ROOMY), film(), [moment()] * 2)
    shared = Budget(PIXELS * (SUMS + BESIDE))
    source, compositors = film(), [NotedCompositor(limited(shared, which)) for which in range(2)]
    first, second = (Renderer(compositor, source) for compositor in compositors)
    assert np.array_equal(first.picture(Request(2, moment())), wanted[0])
    assert shared.used > PIXELS * SUMS
    with pytest.raises(NoDeviceError, match="has no room"), compositors[1].current():
        compositors[1].device.texture(*SIZE, SUMS // 8, "rgba16ui")
    compositors[1].device.ask_others = first.release
    assert np.array_equal(second.picture(Request(2, moment())), wanted[0])
    assert not any(each.is_open for each in compositors[0].windows)
    compositors[0].device.ask_others = second.release
    assert np.array_equal(first.picture(Request(3, moment())), wanted[1])
    for renderer, compositor in zip((first, second), compositors, strict=True):
        renderer.close()
        free(compositor)


def test_a_driver_that_has_less_than_it_says_gets_less(kind, limited, monkeypatch):
    most, held = PIXELS * 64, []

    class Small(kind):
        def _make(self, *given):
            if self.budget.used > most:
                raise NoDeviceError("out of memory")
            held.append(self.budget.used)
            return super()._make(*given)

    shown = [moment(), moment(shapes=SHAPES[:2])]
    roomy, *_ = rendered(limited(ROOMY), film(), shown)
    monkeypatch.setattr(window, "SENT_BYTES", most // 8)
    device = Small(Budget(ROOMY))
    pictures, _, is_short = rendered(device, film(), shown)
    assert device.budget.used == 0
    device.release()
    assert is_short
    assert np.abs(pictures - roomy).max() <= 2**-14
    assert max(held) <= most


def test_what_is_allowed(monkeypatch):
    monkeypatch.setattr(devices, "machine_memory", lambda: 16 << 30)
    assert devices.allowed(8 << 30) == 6 << 30
    assert devices.allowed(48 << 30) == 8 << 30
    assert devices.allowed(None) == 6 << 30
    monkeypatch.setattr(devices, "machine_memory", lambda: None)
    assert devices.allowed(48 << 30) == 36 << 30


def test_a_device_tells_what_there_is(kind):
    """A software renderer has the machine's memory, a GPU may have less of its own."""
    wanted, device = devices.allowed(devices.machine_memory()), kind()
    assert device.budget.limit == wanted or "llvmpipe" not in device.name
    assert devices.MEGABYTE < device.budget.limit <= wanted
    device.release()
