"""The devices."""

import pytest


@pytest.fixture(scope="session")
def blender_device():
    """Blender's own GPU, without a window."""
    pytest.importorskip("bpy")
    import gpu

    gpu.init()
    from shutter_addon.blender.devices.blender_gpu import BlenderDevice

    device = BlenderDevice()
    yield device
    device.release()


@pytest.fixture(params=["moderngl", "blender"])
def gpu_device(request):
    """Either device on a GPU."""
    if request.param == "blender":
        yield request.getfixturevalue("blender_device")
        return
    from shutter_addon.devices.gl import GLDevice

    device = GLDevice()
    yield device
    device.release()
