"""What is written to a device is what it holds, to the bit."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from shutter_addon.compute.devices.device import NoDeviceError

KINDS = {"rgba8": np.uint8, "rgba16": np.uint16, "rgba16f": np.float16, "rgba32f": np.float32, "r32f": np.float32}
KINDS |= {"r32ui": np.uint32}


def samples(kind, *shape):
    """Every value of 8 and 16 bits, where there is room for them; read-only, as frames decoded ahead."""
    dtype, rng = np.dtype(KINDS[kind]), np.random.default_rng(1)
    shape = (*shape, 4) if kind.startswith("rgba") else shape
    if dtype.kind == "u":
        array = (np.arange(np.prod(shape)) % (np.iinfo(dtype).max + 1)).astype(dtype)
        rng.shuffle(array)
        array = array.reshape(shape)
    else:
        array = (rng.normal(size=shape) * 100).astype(dtype)
    array.flags.writeable = False
    return array


@pytest.mark.parametrize("kind", KINDS)
def test_layers_hold_what_was_written(gpu_device, kind):
    layers = samples(kind, 3, 130, 257)
    with gpu_device.current():
        texture = gpu_device.texture(257, 130, 3, kind)
        assert texture.size == (257, 130, 3)
        for layer in (2, 0, 1):
            gpu_device.write(texture, layers[layer], layer)
        got = gpu_device.read(texture)
        assert got.dtype == layers.dtype
        assert np.array_equal(got.reshape(layers.shape), layers)
        gpu_device.write(texture, layers[2][:5], 1)
        assert np.array_equal(gpu_device.read(texture)[1].reshape(layers[1].shape), [*layers[2][:5], *layers[1][5:]])
        texture.release()


@pytest.mark.parametrize("kind", ["rgba8", "rgba16"])
def test_opaque_pixels_hold_what_was_written(gpu_device, kind):
    frame = samples(kind, 130, 257).copy()
    frame[..., 3] = np.iinfo(frame.dtype).max
    with gpu_device.current():
        texture = gpu_device.texture(257, 130, 2, kind)
        gpu_device.write(texture, frame, 1, opaque=True)
        assert np.array_equal(gpu_device.read(texture)[1], frame)
        texture.release()


def test_fours_of_whole_numbers_are_exact_or_refused(gpu_device):
    """Blender would leave them uninitialised."""
    fours = np.random.default_rng(2).integers(0, 1 << 16, (2, 5, 3, 4), dtype=np.uint16)
    with gpu_device.current():
        texture = gpu_device.texture(3, 5, 2, "rgba16ui")
        if type(gpu_device).__name__ == "BlenderDevice":
            for refused in (lambda: gpu_device.write(texture, fours[0]), lambda: gpu_device.read(texture)):
                with pytest.raises(KeyError):
                    refused()
        else:
            for layer, values in enumerate(fours):
                gpu_device.write(texture, values, layer)
            assert np.array_equal(gpu_device.read(texture), fours)
        texture.release()


def test_there_are_limits(gpu_device):
    assert gpu_device.name
    assert gpu_device.max_layers >= 256
    assert gpu_device.max_size >= 4096
    with gpu_device.current():
        for size in ((gpu_device.max_size + 1, 4, 1), (4, 4, gpu_device.max_layers + 1)):
            with pytest.raises(NoDeviceError, match="has no room"):
                gpu_device.texture(*size, "rgba8")


def test_moderngl_leaves_blenders_context_current(blender_device):
    from shutter_addon.compute.devices.gl import GLDevice

    other = GLDevice()
    frame = samples("rgba8", 4, 4)
    with other.current():
        with other.current():
            pass
        texture = other.texture(4, 4, 1, "rgba8")
        other.write(texture, frame)
        assert np.array_equal(other.read(texture)[0], frame)
    texture = blender_device.texture(4, 4, 1, "rgba8")
    blender_device.write(texture, frame)
    assert np.array_equal(blender_device.read(texture)[0], frame)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere none is called by its address")
def test_a_lack_of_functions_is_met_before_pictures(monkeypatch):
    """As where a driver's EGL finds none: to call nothing would end Blender."""
    from shutter_addon.compute.devices import gl

    egl = gl._egl()  # the library, in whose place another comes
    names = "eglGetCurrentSurface", "eglGetCurrentDisplay", "eglGetCurrentContext", "eglMakeCurrent"
    other = SimpleNamespace(eglGetProcAddress=lambda _name: None, **{name: getattr(egl, name) for name in names})
    monkeypatch.setattr(gl, "_egl", lambda: other)  # the one way to a library without functions
    gl._gl.cache_clear()  # as when Blender starts
    with pytest.raises(NoDeviceError, match="no glUseProgram"):
        gl.GLDevice()
