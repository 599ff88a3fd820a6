"""The extension's preferences."""

import bpy
from bpy.props import EnumProperty

from .properties import CONTEXT

ADDON = __package__.rpartition(".shutter_addon")[0] or "shutter_addon"

DEVICES = (
    ("AUTO", "Automatic", "OpenGL 4.3 where there is one, else Blender's own GPU, else NumPy"),
    ("GPU", "GPU", "As Automatic, but never NumPy"),
    ("OPENGL", "OpenGL 4.3", "An OpenGL context of its own, beside Blender's"),
    ("BLENDER", "Blender's GPU", "The GPU that Blender draws with"),
    ("CPU", "NumPy", "The processor, which is slow"),
)


class ShutterPreferences(bpy.types.AddonPreferences):
    bl_idname = ADDON

    device: EnumProperty(
        name="Render Device",
        description="What composes renders; the preview is always composed on the GPU that Blender draws with",
        items=DEVICES,
        translation_context=CONTEXT,
    )

    def draw(self, _context):
        self.layout.prop(self, "device")


def device() -> str:
    """The device that renders are wanted on, one of rendering.devices.CHOICES."""
    addon = bpy.context.preferences.addons.get(ADDON)
    return addon.preferences.device.lower() if addon and addon.preferences else "auto"


classes = (ShutterPreferences,)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
