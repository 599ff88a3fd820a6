"""Blender as a library: one process, the modules registered once, a new file for each test."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from support import ROOT, read_picture, write_frames


@pytest.fixture(scope="session")
def bpy():
    import bpy
    import thread_guard

    from shutter_addon import blender

    blender.register()
    thread_guard.on()
    yield bpy
    blender.unregister()


@pytest.fixture(autouse=True)
def _no_data_on_threads():
    yield
    if "thread_guard" in sys.modules:  # by the fixture `bpy`
        assert not sys.modules["thread_guard"].faults()


@pytest.fixture
def no_exception(capfd):
    """Blender prints what a handler raises, and goes on."""
    yield
    assert "Traceback" not in capfd.readouterr().err


@pytest.fixture
def on_numpy(bpy):
    """Composes with NumPy, which starts faster than OpenGL: for tests of what comes before the device."""
    from shutter_addon.blender.rendering import render_settings, sessions

    sessions.forget()
    with render_settings.using(device="cpu"):
        yield
    sessions.forget()


@pytest.fixture
def edit(bpy):
    """An empty edit, set up to show code values as the source has them."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.sequence_editor_create()
    scene.render.resolution_percentage = 100
    scene.render.dither_intensity = 0
    scene.view_settings.view_transform = "Standard"
    return scene


@pytest.fixture
def effect(bpy, edit, tmp_path):
    """What the button makes: an effect with two shutters, on an image strip from frame 1 to 40; its strip active."""
    from shutter_addon.blender.data import selection
    from shutter_addon.blender.editing import add_effect, shutter_edits

    first = write_frames(tmp_path / "in", np.zeros((3, 24, 40, 3), dtype=np.uint8))
    source = edit.sequence_editor.strips.new_image("images", str(first), 1, 1)
    source.right_handle = 41
    strip, effect = add_effect.add_effect(edit, source)
    shutter_edits.start(effect)
    selection.choose(edit, strip)
    return effect


@pytest.fixture
def render(bpy, tmp_path, monkeypatch):
    """Renders frames of a scene through the sequencer: {frame: (H, W, 4) in 8-bit levels}, from 8 or 16 bits."""
    from shutter_addon.blender.rendering import engine

    faults = []
    monkeypatch.setattr(engine.VirtualShutterEngine, "fail", lambda _engine, sentence: faults.append(sentence))

    def rendered(scene, frames, depth="8"):
        scene.render.image_settings.file_format = "PNG"
        scene.render.image_settings.color_depth = depth
        scene.render.image_settings.color_mode = "RGBA"
        scene.render.image_settings.compression = 0
        pictures = {}
        for frame in frames:
            scene.frame_set(frame)
            scene.render.filepath = str(tmp_path / f"r{frame}.png")
            bpy.ops.render.render(write_still=True, scene=scene.name)
            assert not faults
            pictures[frame] = read_picture(tmp_path / f"r{frame}.png")
        return pictures

    return rendered


@pytest.fixture
def render_words(tmp_path):
    """The words of the command `render`; a recipe may be given as a dictionary."""

    def made(arguments, recipe):
        if recipe is not None:
            path = tmp_path / "recipe.json"
            path.write_text(json.dumps(recipe))
            arguments = [*arguments, "--recipe", path]
        return ["render", *map(str, arguments)]

    return made


@pytest.fixture
def run(bpy, capfd):
    """Runs a command in this process: its exit code, and what it says on stderr."""
    from shutter_addon.blender.command import main

    def told(*words):
        capfd.readouterr()
        return main([str(word) for word in words]), capfd.readouterr().err

    return told


@pytest.fixture
def command(render_words):
    """Runs `python -m shutter_addon render` in a process of its own."""

    def run(*arguments, recipe=None, check=True, env=None, **options):
        done = subprocess.run(
            [sys.executable, "-m", "shutter_addon", *render_words(arguments, recipe)],
            cwd=ROOT,
            env=os.environ | (env or {}),
            capture_output=True,
            text=True,
            check=False,
            **options,
        )
        if check:
            assert done.returncode == 0, done.stderr
        return done

    return run


@pytest.fixture
def command_here(bpy, render_words, capfd):
    """Runs the command `render` in this process, which is faster: as `command`, and each time from the start."""
    from shutter_addon.blender.command import main
    from shutter_addon.blender.rendering import sessions

    def run(*arguments, recipe=None, check=True):
        sessions.forget()
        capfd.readouterr()
        code = main(render_words(arguments, recipe))
        done = subprocess.CompletedProcess(arguments, code, *capfd.readouterr())
        if check:
            assert done.returncode == 0, done.stderr
        return done

    yield run
    sessions.forget()
