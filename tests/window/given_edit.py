"""An edit of the source SHUTTER_FOOTAGE, a movie or the first picture of a sequence, under the effect SHUTTER_RECIPE,
for stories that render it as PNG."""

import os
from pathlib import Path

import bpy
from driver import override, video_editing_opened


def edit():
    return bpy.data.scenes["Edit"]


def opened():
    """Generator: yield from it."""
    yield from video_editing_opened()
    bpy.context.window_manager.windows[0].workspace.sequencer_scene.name = "Edit"
    editor = edit().sequence_editor_create()
    editor.use_cache_raw = editor.use_cache_final = False
    strips = editor.strips
    source = Path(os.environ["SHUTTER_FOOTAGE"])
    if source.suffix == ".png":
        strip = strips.new_image("Source", str(source), 1, 1)
        for path in sorted(source.parent.iterdir())[1:]:
            strip.elements.append(path.name)
    else:
        strip = strips.new_movie("Source", str(source), 1, 1)
    editor.active_strip = strip
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("EXEC_DEFAULT") == {"FINISHED"}
    with override("PREVIEW"):
        assert bpy.ops.shutter.recipe_import("EXEC_DEFAULT", filepath=os.environ["SHUTTER_RECIPE"]) == {"FINISHED"}
    render = edit().render
    element = strip.elements[0]
    render.resolution_x, render.resolution_y = element.orig_width, element.orig_height
    render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "PNG"
    render.image_settings.compression = 0
    render.dither_intensity = 0
    edit().view_settings.view_transform = "Standard"
