"""The extension's preferences: render device, GPU memory, and the model that finds subjects."""

from pathlib import Path

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty
from bpy.types import Context

from ...core.model.choices import CONTEXT
from ...media.files import MODEL
from . import strips

ADDON = __package__.rpartition(".shutter_addon")[0] or "shutter_addon"

DEVICES = (
    ("AUTO", "Automatic", "OpenGL 4.3 where there is one, else Blender's own GPU, else NumPy"),
    ("GPU", "GPU", "As Automatic, but never NumPy"),
    ("OPENGL", "OpenGL 4.3", "A separate OpenGL context beside Blender's"),
    ("BLENDER", "Blender's GPU", "The GPU that Blender draws with"),
    ("CPU", "NumPy", "The processor, which is slow"),
)


class ShutterPreferences(bpy.types.AddonPreferences):
    bl_idname = ADDON

    device: EnumProperty(
        name="Render Device",
        description="Device that composes renders. Previews always use the GPU that Blender draws with",
        items=DEVICES,
        translation_context=CONTEXT,
    )
    gpu_memory: IntProperty(
        name="GPU Memory",
        description="Megabytes of the GPU's memory that frames and pictures may take, from the next render on."
        " 0: three quarters of what there is, and half of the machine's memory at most",
        min=0,
        soft_max=65536,
        translation_context=CONTEXT,
    )
    model: StringProperty(
        name="Subject Model",
        description="ONNX file of another model that finds subjects: one picture in, one mask out."
        " Empty: the one that Virtual Shutter brings",
        update=strips.invalidate_all,
        subtype="FILE_PATH",
    )

    def draw(self, _context: Context) -> None:
        for name in ("device", "gpu_memory", "model"):
            self.layout.prop(self, name)
        self.layout.operator("shutter.copy_report", icon="COPYDOWN")


def device() -> str:
    """Return the render device that the user chose, one of devices.available.CHOICES; "auto" without preferences."""
    return getattr(_preferences(), "device", "").lower() or "auto"  # "" also for a device of a newer version


def gpu_memory() -> int:
    """Return how many megabytes of GPU memory textures may take; 0: a share of what compute.devices.device finds."""
    return getattr(_preferences(), "gpu_memory", 0)


def model() -> Path:
    """Return the ONNX file of the model that finds subjects: the user's, or the one that comes with the extension."""
    chosen = getattr(_preferences(), "model", "")
    return Path(bpy.path.abspath(chosen)).expanduser() if chosen else MODEL


def _preferences() -> ShutterPreferences | None:
    addon = bpy.context.preferences.addons.get(ADDON)
    return addon.preferences if addon else None


classes = (ShutterPreferences,)
