"""A newer version of the extension, as a process of its own: `make` an edit of it, and `read` what is left of that.

It stores what this one does not know: properties of all kinds, a property of strips, an item of an enum; an effect that
no strip shows, and an effect scene that this one would mend.
"""

import json
import sys

import bpy
import stored
from bpy.props import CollectionProperty, EnumProperty, FloatProperty, PointerProperty, StringProperty

from shutter_addon import blender
from shutter_addon.blender import handlers
from shutter_addon.blender.data import data_format, properties, versions
from shutter_addon.core.model import choices


class Glow(bpy.types.PropertyGroup):
    strength: FloatProperty()


def become_newer() -> None:
    bpy.utils.register_class(Glow)
    properties.ShutterEffect.__annotations__ |= {
        "glow": FloatProperty(),
        "lamp": PointerProperty(type=bpy.types.Object),
        "position": EnumProperty(items=(*choices.POSITIONS, ("SCATTERED", "Scattered", ""))),
    }
    properties.Shutter.__annotations__["glows"] = CollectionProperty(type=Glow)
    properties.Shutter.__annotations__["halo"] = PointerProperty(type=Glow)
    data_format.FORMAT += 1
    versions.extension = lambda: "9.0.0"
    blender.register()
    handlers.unregister()  # a newer one may have other ways to keep things in line, or none
    bpy.types.Strip.virtual_shutter_glow = StringProperty()


def make(path: str, saved: str) -> None:
    bpy.ops.wm.open_mainfile(filepath=saved)
    scene = bpy.data.scenes["Edit"]
    effect = scene.virtual_shutter.effects[0]
    effect.glow, effect.lamp, effect.position = 0.75, bpy.data.objects.new("Lamp", None), "SCATTERED"
    shutter = effect.shutters[0]
    shutter.halo.strength, shutter.glows.add().strength = 3, 4
    scene.keyframe_insert("virtual_shutter.effects[0].glow", frame=3)
    scene.sequence_editor.strips["regions effect"].virtual_shutter_glow = "soft"
    alone = scene.virtual_shutter.effects.add()
    alone.name, alone.scene = "shown otherwise", bpy.data.scenes.new("Unshown")
    effect.scene.render.use_border, effect.scene.camera = True, None
    scene.sequence_editor.strips["regions effect"].content_start += 100
    for each in bpy.data.scenes:
        each.virtual_shutter.format = data_format.FORMAT if each.virtual_shutter.effects else 0
    scene.virtual_shutter.version = versions.extension()
    bpy.ops.wm.save_as_mainfile(filepath=path)


def read() -> None:
    effect = bpy.data.scenes["Edit"].virtual_shutter.effects[0]
    render, camera = effect.scene.render, effect.scene.camera
    saved_by = {s.name: [s.virtual_shutter.format, s.virtual_shutter.version] for s in bpy.data.scenes}
    values = stored.values() | {"mended": [render.use_border, camera is None], "saved by": saved_by}
    values["lamp"] = effect.lamp and effect.lamp.name
    print("VALUES", json.dumps(values))


if __name__ == "__main__":
    what, path, *saved = sys.argv[1:]
    become_newer()
    make(path, *saved) if what == "make" else bpy.ops.wm.open_mainfile(filepath=path)
    read()
