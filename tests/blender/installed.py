"""An edit as an editor makes it, with the extension that is installed; run inside Blender, by test_package.py.

Arguments: the footage (a movie, or the first of some pictures), a recipe, where to save the edit, the extension's id,
and modules that have to come out of its wheels."""

import importlib
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
from support import sequencer

footage, recipe, save, name, *wheels = sys.argv[sys.argv.index("--") + 1 :]
assert name in bpy.context.preferences.addons, "the extension is not enabled"
for wheel in wheels:
    place = importlib.import_module(wheel).__file__
    assert ".local" in place, f"{wheel} is not the extension's own: {place}"

edit = bpy.context.scene
edit.render.resolution_x, edit.render.resolution_y, edit.render.fps = 320, 180, 25
edit.render.dither_intensity = 0
edit.render.image_settings.color_depth = "16"
edit.view_settings.view_transform = "Standard"
strips = edit.sequence_editor_create().strips
if footage.endswith(".png"):
    source = strips.new_image("Footage", footage, 1, 1)
    for path in sorted(Path(footage).parent.iterdir())[1:]:
        source.elements.append(path.name)
else:
    source = strips.new_movie("Footage", footage, 1, 1)
edit.sequence_editor.active_strip = source
with sequencer(bpy):
    assert bpy.ops.shutter.add_effect() == {"FINISHED"}
    assert bpy.ops.shutter.recipe_import(filepath=recipe) == {"FINISHED"}
bpy.ops.wm.save_as_mainfile(filepath=save)
