"""The devices. With SHUTTER_NO_GPU in the environment, tests that need one which is not there are skipped."""

import os

import numpy as np
import pytest

from shutter_addon.compute.devices.device import NoDeviceError


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup():
    return (yield from _skipped_without())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call():
    return (yield from _skipped_without())


def _skipped_without():
    try:
        return (yield)
    except NoDeviceError as error:
        if not os.environ.get("SHUTTER_NO_GPU"):
            raise
        pytest.skip(f"NO GPU: {error}")


@pytest.fixture(params=["gpu", "cpu"], scope="module")
def device(request):
    """moderngl's compositor and NumPy's. Blender's own GPU runs the same passes: tests/differential compares its
    pictures."""
    from shutter_addon.compute.renderer import open_compositor

    return open_compositor(request.param)


@pytest.fixture(scope="session")
def blender_device():
    """Blender's own GPU, without a window."""
    pytest.importorskip("bpy")
    from shutter_addon.blender.devices.blender_gpu import BlenderDevice, opens_in_background

    if not opens_in_background():
        raise NoDeviceError("Blender's own does not open")
    device = BlenderDevice()
    yield device
    device.release()


@pytest.fixture(params=["moderngl", "blender"])
def gpu_device(request):
    if request.param == "blender":
        yield request.getfixturevalue("blender_device")
        return
    from shutter_addon.compute.devices.gl import GLDevice

    device = GLDevice()
    yield device
    device.release()


@pytest.fixture(scope="module")
def on_moderngl():
    """Solves for coefficients on moderngl's device: labels, count, and what follows edges."""
    from shutter_addon.compute.devices.gl import GLDevice

    device = GLDevice()
    yield from _solving(device)
    device.release()


@pytest.fixture(scope="module")
def on_blender(blender_device):
    yield from _solving(blender_device)


def _solving(device):
    from shutter_addon.compute.stages import GPUStages

    solver = GPUStages(device)

    def solve(labels, count, *guided, warm=False):
        with device.current():
            layers = device.read(solver.solve(labels, count, *guided, warm=warm))
        return np.moveaxis(layers, 3, 1).reshape(-1, *labels.shape)[:count]

    yield solve
    with device.current():
        solver.release()
