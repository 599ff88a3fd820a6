"""Which device renders without a window, moderngl's OpenGL or Blender's own GPU: the same pictures, in chunks the same
bits."""

import numpy as np
import pytest
from support import picture_of, read_picture, recipe, write_frames

from shutter_addon.blender.data import preferences
from shutter_addon.blender.devices import available
from shutter_addon.blender.rendering import job_snapshots, render_settings, sessions
from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.devices.device import NoDeviceError

BORROWED = "composing on Blender's own GPU, "  # and its name


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    """Frames of noise, a recipe with moving regions, and moderngl's pictures of them."""
    folder = tmp_path_factory.mktemp("devices")
    first = write_frames(folder, np.random.default_rng(5).integers(0, 256, (8, 48, 64, 3), dtype=np.uint8))
    keys = [{"frame": 1}, {"frame": 8, "location": [0.3, 0.1]}]
    line = {"shutter": "S1", "strokes": [[[0.2, 0.2], [0.6, 0.9]]], "width": 0.1, "keys": keys}
    return first, recipe(4, [1] * 4, [0, 0, 1, 0], regions=[line], border=True)


def pictures(folder):
    return np.stack([read_picture(path)[..., :3] for path in sorted(folder.iterdir())])


def test_without_moderngl_blenders_own_gpu_renders(command, given, tmp_path, same_pixels):
    first, data = given
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['moderngl'] = None\n")
    hidden = {"PYTHONPATH": str(tmp_path)}
    command(first, "--output", tmp_path / "opengl", "--device", "opengl", recipe=data)
    done = command(first, "--output", tmp_path / "auto", recipe=data, env=hidden)
    assert done.stderr.count(BORROWED) == 1
    assert "NumPy" not in done.stderr
    for frames, device in (("1:3", "gpu"), ("4:8", "blender")):
        options = ("--frames", frames, "--device", device)
        done = command(first, "--output", tmp_path / "chunks", *options, recipe=data, env=hidden)
        assert "composing" not in done.stderr
    opengl, auto, chunks = (pictures(tmp_path / name) for name in ("opengl", "auto", "chunks"))
    same_pixels(auto.reshape(-1, *auto.shape[2:]), opengl.reshape(-1, *opengl.shape[2:]), 1)
    assert np.array_equal(auto, chunks)
    refused = command(first, "--output", tmp_path / "no", "--device", "opengl", recipe=data, env=hidden, check=False)
    assert refused.returncode == 2
    assert "moderngl cannot be loaded" in refused.stderr
    assert not (tmp_path / "no").exists()


def test_a_blender_on_vulkan_without_opengl(blender, command, given, tmp_path, same_pixels, monkeypatch):
    """OpenGL here is too old for moderngl, and for Blender."""
    first, data = given
    command(first, "--output", tmp_path / "opengl", "--device", "opengl", recipe=data)
    monkeypatch.setenv("MESA_GL_VERSION_OVERRIDE", "3.3")
    options = ("--gpu-backend", "vulkan", "--command", "shutter", "render", first, "--recipe", tmp_path / "recipe.json")
    done = blender(*options, "--output", tmp_path / "vulkan")
    assert done.returncode == 0, done.stderr
    assert "no OpenGL 4.3" in done.stderr
    assert BORROWED in done.stderr
    opengl, vulkan = (pictures(tmp_path / name) for name in ("opengl", "vulkan"))
    same_pixels(vulkan.reshape(-1, *vulkan.shape[2:]), opengl.reshape(-1, *opengl.shape[2:]), 1)
    done = blender(*options, "--output", tmp_path / "chunk", "--frames", "5:8")
    assert done.returncode == 0, done.stderr
    assert np.array_equal(pictures(tmp_path / "chunk"), vulkan[4:])


@pytest.fixture
def preferred(bpy):
    """The extension's preferences, as of an enabled one."""
    addon = bpy.context.preferences.addons.new()
    addon.module = preferences.ADDON
    yield addon.preferences
    bpy.context.preferences.addons.remove(addon)


def test_the_preference_chooses(effect, preferred):
    """From the next render on, if the command asks for nothing else."""

    def composed_by():
        sessions.settle()
        picture_of(effect.scene, 1)
        context = sessions.of_render()
        return type(context.renderer(context.request(*job_snapshots.of(effect.scene, 1))).compositor)

    for wanted, found in (("CPU", CPUCompositor), ("AUTO", GPUCompositor), ("OPENGL", GPUCompositor)):
        preferred.device = wanted
        assert composed_by() is found, wanted
        with render_settings.using(device="cpu"):
            assert composed_by() is CPUCompositor, wanted
    assert {item[0].lower() for item in preferences.DEVICES} == set(available.CHOICES)
    sessions.forget()


def test_what_is_lacking_is_said_of_all(bpy, monkeypatch):
    monkeypatch.setattr(available, "opengl", lambda: available.OpenGL(lacking="no OpenGL 4.3: none"))
    monkeypatch.setattr(available, "opens_in_background", lambda: False)
    both = "no OpenGL 4.3: none, and Blender's own GPU cannot be used without a window here"
    assert available.choose("auto") == ("cpu", f"{both}; composing with NumPy, which is slow")
    for wanted, lacking in (("gpu", both), ("opengl", both.split(",")[0]), ("blender", both.split("and ")[1])):
        with pytest.raises(NoDeviceError, match=f"^{lacking}$"):
            available.choose(wanted)
