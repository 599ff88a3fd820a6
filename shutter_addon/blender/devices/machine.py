"""What a bug report says of the machine, and the device that it measures."""

import os
import platform

import bpy
import gpu
import numpy as np

from ...compute.benchmark import processor
from ...devices.budget import Budget, machine_memory
from ..data import preferences, versions
from . import available
from .blender_gpu import BlenderDevice

BACKENDS = {"OPENGL": "OpenGL", "VULKAN": "Vulkan", "METAL": "Metal", "NONE": "nothing", "UNKNOWN": "unknown"}


def open_device(wanted: str | None, *memory: Budget):
    """A compositor, and why it is a lesser one, or None. NoDeviceError: there is none as it is wanted.

    wanted: one of available.CHOICES; None: as the user prefers; memory: a Budget, in place of the device's own"""
    kind, lesser = available.choose(wanted or preferences.device())
    return available.OPEN[kind](*memory), lesser


def described(compositor, lesser: str | None) -> dict[str, str]:
    """The machine, by headings."""
    memory, device = machine_memory(), getattr(compositor, "device", None)
    return {
        "Virtual Shutter": versions.extension(),
        "Blender": f"{bpy.app.version_string}, Python {platform.python_version()}, NumPy {np.__version__}",
        "Device": compositor.name if device is None else f"{device.name}, by {_backend(device)}",
        **({"Because": lesser} if lesser else {}),
        "Processor": f"{processor()}, {os.cpu_count()} logical cores",
        "Memory": "unknown" if memory is None else f"{memory / (1 << 30):.1f} GB",
        "System": platform.platform(),
    }


def _backend(device) -> str:
    if isinstance(device, BlenderDevice):
        return f"Blender's own {BACKENDS[gpu.platform.backend_type_get()]}"
    return "OpenGL"
