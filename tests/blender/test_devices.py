"""Which device renders without a window, and how much of its memory it may take: the same pictures, in chunks the same
bits."""

import sys

import numpy as np
import pytest
from support import noise, picture_of, read_picture, recipe, write_frames

from shutter_addon.blender.data import preferences
from shutter_addon.blender.devices import available
from shutter_addon.blender.rendering import job_snapshots, render_settings, sessions
from shutter_addon.compute.cpu import CPUCompositor
from shutter_addon.compute.devices.device import NoDeviceError
from shutter_addon.compute.gpu import GPUCompositor

BORROWED = "composing on Blender's own GPU, "  # and its name


SIZE = 480, 270
# In megabytes, for windows of 8 frames of that size: room for their running sums, and for no window.
ROOMY, SMALL = 64, 12


@pytest.fixture
def film(tmp_path):
    """The first of eight frames of noise, and a recipe whose scribble moves."""
    keys = [{"frame": 1}, {"frame": 8, "location": [0.3, 0.1]}]
    line = {"shutter": "S1", "strokes": [[[0.2, 0.2], [0.6, 0.9]]], "width": 0.1, "keys": keys}
    data = recipe(8, [1] * 8, [0, 0, 1] + [0] * 5, regions=[line], border=True)
    return write_frames(tmp_path / "in", noise(8, *SIZE[::-1], 3)), data


@pytest.fixture
def opengl(command_here, film, tmp_path):
    """moderngl's pictures of it."""
    command_here(film[0], "--output", tmp_path / "opengl", "--device", "opengl", recipe=film[1])
    return pictures(tmp_path / "opengl")


def pictures(folder):
    """One below the other."""
    return np.concatenate([read_picture(path)[..., :3] for path in sorted(folder.iterdir())])


def test_without_moderngl_blenders_own_gpu_renders(command, film, opengl, tmp_path, same_pixels):
    first, data = film
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
    assert np.array_equal(auto[3 * SIZE[1] :], pictures(tmp_path / "chunk"))


def test_a_device_that_was_asked_for_is_not_replaced(command_here, film, tmp_path, monkeypatch):
    first, data = film
    for module in ("moderngl", "shutter_addon.compute.devices.gl"):
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr(available, "opengl", available.opengl.__wrapped__)  # which remembers what it found
    done = command_here(first, "--output", tmp_path / "no", "--device", "opengl", recipe=data, check=False)
    assert done.returncode == 2
    assert "moderngl cannot be loaded" in done.stderr
    assert not (tmp_path / "no").exists()


def test_a_blender_on_vulkan_without_opengl(blender, film, opengl, tmp_path, same_pixels, monkeypatch):
    """OpenGL here is too old for moderngl, and for Blender."""
    first, _ = film
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


def test_little_memory_shows_the_same_and_says_so_once(command_here, film, tmp_path):
    first, data = film
    for name, megabytes in (("roomy", ROOMY), ("small", SMALL)):
        options = "--output", tmp_path / name, "--frames", "1:3", "--gpu-memory", str(megabytes)
        done = command_here(first, *options, recipe=data)
        told = "12 MB of GPU memory are too little for 8 frames of 480×270: every picture uploads all of them"
        assert done.stderr.count(told) == (name == "small"), done.stderr
    command_here(first, "--output", tmp_path / "part", "--frames", "3", "--gpu-memory", str(SMALL), recipe=data)
    roomy, small, part = (pictures(tmp_path / name) for name in ("roomy", "small", "part"))
    assert np.abs(small - roomy).max() <= 1 / 16
    assert np.array_equal(part, small[2 * SIZE[1] :])


def test_what_cannot_be_is_told(command_here, film, tmp_path):
    first, data = film
    for megabytes, sentence in (
        ("1", "in the 1 MB that it may take"),
        *((each, f"--gpu-memory: '{each}' is not a number of megabytes") for each in ("-5", "1.5", "much")),
    ):
        options = "--output", tmp_path / "none", "--gpu-memory", megabytes
        done = command_here(first, *options, recipe=data, check=False)
        assert done.returncode == 2
        assert sentence in done.stderr


def test_a_session_gives_back_what_it_took_and_settles_for_another_limit(bpy, edit, effect):
    sessions.forget()
    with render_settings.using(gpu_memory=ROOMY):
        sessions.close_if_device_changed()
        picture = picture_of(effect.scene, 1)
        budget = render_settings.memory()
        assert (budget.limit, budget.used > 0) == (ROOMY << 20, True)
        sessions.SESSIONS.offscreen.free()
        assert np.array_equal(picture_of(effect.scene, 1), picture)
    with render_settings.using(gpu_memory=SMALL):
        sessions.close_if_device_changed()
        assert budget.used == 0
        assert np.abs(picture_of(effect.scene, 1) - picture).max() <= 2**-14
        budget = render_settings.memory()
        assert (budget.limit, budget.used > 0) == (SMALL << 20, True)
    sessions.forget()
    assert budget.used == 0
    sessions.close_if_device_changed()
    assert render_settings.memory().limit > ROOMY << 20
