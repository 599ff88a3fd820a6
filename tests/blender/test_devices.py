"""Which device renders without a window, moderngl's OpenGL or Blender's own GPU: the same pictures, in chunks the same
bits."""

import sys

import numpy as np
import pytest
from support import noise, picture_of, read_picture, recipe, write_frames

from shutter_addon.blender.data import preferences
from shutter_addon.blender.devices import available
from shutter_addon.blender.rendering import job_snapshots, render_settings, sessions
from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.gpu import GPUCompositor
from shutter_addon.devices.device import NoDeviceError

BORROWED = "composing on Blender's own GPU, "  # and its name


@pytest.fixture
def given(command_here, tmp_path):
    """Frames of noise, a recipe with moving regions, and moderngl's pictures of them."""
    first = write_frames(tmp_path / "in", noise(8, 48, 64, 3))
    keys = [{"frame": 1}, {"frame": 8, "location": [0.3, 0.1]}]
    line = {"shutter": "S1", "strokes": [[[0.2, 0.2], [0.6, 0.9]]], "width": 0.1, "keys": keys}
    data = recipe(4, [1] * 4, [0, 0, 1, 0], regions=[line], border=True)
    command_here(first, "--output", tmp_path / "opengl", "--device", "opengl", recipe=data)
    return first, data, pictures(tmp_path / "opengl")


def pictures(folder):
    """One below the other."""
    return np.concatenate([read_picture(path)[..., :3] for path in sorted(folder.iterdir())])


def test_without_moderngl_blenders_own_gpu_renders(command, given, tmp_path, same_pixels):
    first, data, opengl = given
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['moderngl'] = None\n")
    hidden = {"PYTHONPATH": str(tmp_path)}
    done = command(first, "--output", tmp_path / "auto", recipe=data, env=hidden)
    assert done.stderr.count(BORROWED) == 1
    assert "NumPy" not in done.stderr
    auto = pictures(tmp_path / "auto")
    same_pixels(auto, opengl, 1)
    options = ("--frames", "4:8", "--device", "blender")
    done = command(first, "--output", tmp_path / "chunk", *options, recipe=data, env=hidden)
    assert "composing" not in done.stderr
    assert np.array_equal(auto[3 * 48 :], pictures(tmp_path / "chunk"))


def test_a_device_that_was_asked_for_is_not_replaced(command_here, given, tmp_path, monkeypatch):
    first, data, _ = given
    for module in ("moderngl", "shutter_addon.devices.gl"):
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr(available, "opengl", available.opengl.__wrapped__)  # which remembers what it found
    done = command_here(first, "--output", tmp_path / "no", "--device", "opengl", recipe=data, check=False)
    assert done.returncode == 2
    assert "moderngl cannot be loaded" in done.stderr
    assert not (tmp_path / "no").exists()


def test_a_blender_on_vulkan_without_opengl(blender, given, tmp_path, same_pixels, monkeypatch):
    """OpenGL here is too old for moderngl, and for Blender."""
    first, _, opengl = given
    monkeypatch.setenv("MESA_GL_VERSION_OVERRIDE", "3.3")
    options = ("--gpu-backend", "vulkan", "--command", "shutter", "render", first, "--recipe", tmp_path / "recipe.json")
    done = blender(*options, "--output", tmp_path / "vulkan")
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "no OpenGL 4.3" in done.stderr
    assert BORROWED in done.stderr
    same_pixels(pictures(tmp_path / "vulkan"), opengl, 1)


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
        sessions.close_if_device_changed()
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
    monkeypatch.setattr(available, "opens_in_background", lambda: True)
    assert available.choose("gpu") == ("blender", None)
    monkeypatch.setattr(available, "opens_in_background", lambda: False)
    both = "no OpenGL 4.3: none, and Blender's own GPU cannot be used without a window here"
    assert available.choose("auto") == ("cpu", f"{both}; composing with NumPy, which is slow")
    for wanted, lacking in (("gpu", both), ("opengl", both.split(",")[0]), ("blender", both.split("and ")[1])):
        with pytest.raises(NoDeviceError, match=f"^{lacking}$"):
            available.choose(wanted)
