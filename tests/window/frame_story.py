"""The way of a preview's frame, as the film plays and as it stands still. Run inside Blender, by test_frame.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

import bpy
import driver
import frame_trace
import preview_sizes_story as sizes
import story

_PACKAGE = "bl_ext.user_default.virtual_shutter.shutter_addon"


def stops(seconds):
    """The way of the next frame that is drawn; generator: yield from it."""
    package = Path(sys.modules[_PACKAGE].__file__).parent
    with frame_trace.traced(package, "VirtualShutterEngine.render", "_draw") as traced:
        yield seconds
    return traced


def note(name, traced):
    back = frame_trace.returns(traced)
    driver.saw(frame=name, stops=[[stop.path, stop.function, stop in back] for stop in traced])


def frames():
    yield from story.opened()
    yield from story.movie_added()
    yield from sizes.effect_added()
    sizes.space().show_overlays = True
    with driver.override("PREVIEW"):
        bpy.ops.screen.animation_play()
    yield 1.0
    note("played", (yield from stops(0.5)))
    with driver.override("PREVIEW"):
        bpy.ops.screen.animation_cancel(restore_frame=False)
    yield 1.0
    for _still in range(2):  # the first one goes on from a smaller size
        story.edit().frame_set(story.edit().frame_current + 1)
        traced = yield from stops(1.0)
    note("still", traced)


driver.play(frames)
