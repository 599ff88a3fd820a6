"""Blender quits after a render from the window.

Run in a Blender with a window, the checkout linked as an extension."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
from driver import enable, key, play, quit_blender, until, xdotool


def windows():
    return bpy.context.window_manager.windows


def story():
    enable()
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    yield 1
    scene = windows()[0].workspace.sequencer_scene or bpy.context.scene
    scene.render.resolution_percentage = 20
    scene.sequence_editor_create().strips.new_effect(name="Grey", type="COLOR", channel=1, frame_start=1, length=10)
    xdotool("mousemove", 700, 300)
    yield 0.5
    key("F12")
    yield from until(lambda: len(windows()) == 2 and not bpy.app.is_job_running("RENDER"), "the frame is rendered", 60)
    quit_blender()
    yield 30
    raise AssertionError("Blender did not quit")


play(story)
