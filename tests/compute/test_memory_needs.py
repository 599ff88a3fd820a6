"""What a window is said to need is what it takes."""

import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from shutter_addon.compute import memory_needs
from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.layer_frames import WeightedFrames
from shutter_addon.compute.renderer import open_gl
from shutter_addon.compute.running_sums import open_window
from shutter_addon.compute.window import beside
from shutter_addon.core.model.frame_state import Options
from shutter_addon.devices.budget import Budget
from shutter_addon.devices.device import NoDeviceError

WINDOW, SHUTTERS = 6, 3


def source(dtype, alpha):
    shape = {"width": 70, "height": 50, "count": 20, "dtype": np.dtype(dtype)}
    return SimpleNamespace(**shape, windows=1, alpha=alpha, transfer="srgb", shots=None)


@pytest.fixture(scope="module")
def device():
    try:
        device = open_gl(Budget(4 << 20))
    except NoDeviceError as error:
        pytest.skip(str(error))
    yield device
    device.release()


@pytest.mark.parametrize(("moved", "summed"), [(False, True), (False, False), (True, True)])
@pytest.mark.parametrize(("dtype", "alpha"), [(np.uint8, "opaque"), (np.uint16, "straight"), (np.float32, "opaque")])
def test_on_a_gpu(device, dtype, alpha, moved, summed):
    """Of averages, and of frames that are combined otherwise."""
    with device.current():
        window = open_window(device, source(dtype, alpha), WINDOW, moved, SHUTTERS, summed)
        taken = device.budget.used
        window.release()
    kind = memory_needs.Kind(WINDOW, moved, SHUTTERS, summed=summed)
    needs = memory_needs.of_windows(device, source(dtype, alpha), kind)
    assert needs == (taken + beside(source(dtype, alpha), SHUTTERS), 0, False)


@pytest.mark.parametrize(("dtype", "alpha"), [(np.uint8, "opaque"), (np.uint16, "straight")])
def test_of_layers_on_a_gpu(dtype, alpha):
    """A window for each and for what lies behind; of colours with an alpha, their shares have some of their own, and
    without running sums the picture without layers is composed as well."""
    pictures = source(dtype, alpha)
    weighted = [WeightedFrames(pictures, None, rest=rest) for rest in (True, False, False)]
    if alpha != "opaque":
        weighted += [WeightedFrames(pictures, None, alone=True) for _ in range(3)] + [pictures]
    with open_gl(Budget(1 << 30)).current() as roomy:
        windows = [open_window(roomy, frames, WINDOW, False, SHUTTERS) for frames in weighted]
        taken = roomy.budget.used
        for window in windows:
            window.release()
    needs = memory_needs.of_windows(roomy, pictures, memory_needs.Kind(WINDOW, False, SHUTTERS, 2))
    roomy.release()
    assert needs == (taken + beside(pictures, SHUTTERS), 0, False)


def test_without_room_the_frames_stay_on_the_host(device):
    needs = memory_needs.of_windows(device, source(np.float32, "opaque"), memory_needs.Kind(250, False, SHUTTERS))
    assert needs.sends
    assert needs.host == 250 * 70 * 50 * 16
    assert needs.gpu <= device.budget.limit


@pytest.mark.parametrize(("dtype", "alpha"), [(np.uint8, "opaque"), (np.uint16, "straight")])
def test_with_numpy(dtype, alpha):
    pictures = source(dtype, alpha)
    pictures.read = lambda index: np.zeros((50, 70, 4), dtype)
    tracemalloc.start()
    try:
        window = CPUCompositor().window(pictures, WINDOW)
        window.load(np.arange(WINDOW), Options(WINDOW), range(pictures.count))
        arrays = tracemalloc.take_snapshot().filter_traces([tracemalloc.DomainFilter(True, np.lib.tracemalloc_domain)])
    finally:
        tracemalloc.stop()
    taken = sum(trace.size for trace in arrays.traces)
    assert memory_needs.with_numpy(pictures, memory_needs.Kind(WINDOW, False, SHUTTERS)) == (0, taken, False)


def test_of_layers_with_numpy():
    """The frames as they are, and what each of two layers and what lies behind them makes of these."""
    pictures = source(np.float32, "opaque")
    needs = memory_needs.with_numpy(pictures, memory_needs.Kind(WINDOW, False, SHUTTERS, layers=2))
    assert needs == (0, 4 * WINDOW * memory_needs.frame_bytes(pictures), False)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_of_layers_without_room_for_all_of_them(dtype):
    """Windows make room for one another, as they do for a film: what that renders is not refused."""
    pictures = source(dtype, "opaque")
    for limit in range(500_000, 3_000_000, 250_000):
        device = open_gl(Budget(limit))
        kind = memory_needs.Kind(WINDOW, False, SHUTTERS, layers=4)
        needs = memory_needs.of_windows(device, pictures, kind)
        with device.current():
            frames = memory_needs._read(pictures, kind)  # which those are does not matter here
            windows = [open_window(device, read, WINDOW, False, SHUTTERS) for read in frames]
            assert needs.sends == any(window.sends for window in windows)
            for window in windows:
                window.release()
        device.release()
        assert needs.gpu <= limit
