"""An edit of the source SHUTTER_FOOTAGE, a movie or the first picture of a sequence, under the effect SHUTTER_RECIPE,
for stories that render it as PNG."""

import os
from pathlib import Path

import bpy
from driver import edit, override, strip_added, video_editing_opened


def opened():
    yield from video_editing_opened()
    editor = edit().sequence_editor
    editor.use_cache_raw = editor.use_cache_final = False
    source = Path(os.environ["SHUTTER_FOOTAGE"])
    if source.suffix == ".png":
        strip = strip_added("Source", source)
    else:
        strip = editor.active_strip = editor.strips.new_movie("Source", str(source), 1, 1)
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("EXEC_DEFAULT") == {"FINISHED"}
    with override("PREVIEW"):
        assert bpy.ops.shutter.recipe_import("EXEC_DEFAULT", filepath=os.environ["SHUTTER_RECIPE"]) == {"FINISHED"}
    render = edit().render
    element = strip.elements[0]
    render.resolution_x, render.resolution_y = element.orig_width, element.orig_height
    render.image_settings.compression = 0
