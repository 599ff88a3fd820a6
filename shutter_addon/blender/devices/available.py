"""Choose the device that composes renders: a separate OpenGL 4.3 context, else Blender's own GPU, else NumPy."""

import threading
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import bpy
import gpu
from bpy.app.translations import pgettext_rpt as rpt_

from ...compute.cpu import CPUCompositor
from ...compute.devices.device import NoDeviceError
from ...compute.gpu import GPUCompositor
from ...compute.renderer import open_gl
from ...compute.request import Compositor
from ...core import threads
from .blender_gpu import BlenderDevice, opens_in_background
from .main_thread import RelayedDevice

CHOICES = ("auto", "gpu", "opengl", "blender", "cpu")  # gpu: opengl, else blender
# What opens each device. Arguments: a Budget and `ask_others`, as for Device.
OPEN: dict[str, Callable[..., Compositor]] = {
    "opengl": lambda *memory: GPUCompositor(open_gl(*memory)),
    "blender": lambda *memory: GPUCompositor(BlenderDevice(*memory)),
    "relayed": lambda *memory: GPUCompositor(RelayedDevice(*memory)),  # Blender's GPU, from the thread of a job
    "cpu": lambda *_memory: CPUCompositor(),
}


def choose(wanted: str, *, window_waits: bool = False) -> tuple[str, str | None]:
    """Choose the device that composes renders, which need not be the one for previews.

    Args:
        wanted: One of CHOICES. "auto" takes OpenGL, else Blender's GPU, else NumPy; "gpu" takes one of the first two.
        window_waits: Whether Blender's window is blocked until the picture is made. Then Blender's GPU cannot be used.

    Returns:
        The device as a key of OPEN. And, if "auto" cannot take OpenGL, a sentence for the user that says why,
        and what it takes instead; else None.

    Raises:
        NoDeviceError: The wanted device cannot be used.
    """
    if wanted == "cpu":
        return "cpu", None
    lacking, is_main = [], threading.current_thread() is threading.main_thread()
    if wanted != "blender":
        if (why := opengl().lacking) is None:
            return "opengl", None
        lacking.append(why)
    if wanted != "opengl":
        if window_waits:
            lacking.append(
                rpt_("View > Render Sequencer Animation cannot use Blender's own GPU, as Render > Render Animation can")
            )
        elif not bpy.app.background or (is_main and opens_in_background()):
            way = "blender" if bpy.app.background else "relayed"
            return way, f"{lacking[0]}; composing on Blender's own GPU, {name(way)}" if wanted == "auto" else None
        else:
            lacking.append("Blender's own GPU cannot be used without a window here")
    if wanted == "auto":
        return "cpu", f"{', and '.join(lacking)}; composing with NumPy, which is slow"
    raise NoDeviceError(", and ".join(lacking))


def name(kind: str) -> str:
    """Return the name of a device for the user: of its GPU, or "NumPy".

    Args:
        kind: The device, a key of OPEN.
    """
    if kind == "cpu":
        return "NumPy"
    return opengl().name if kind == "opengl" else gpu.platform.renderer_get()


class OpenGL(NamedTuple):
    """Whether a separate OpenGL 4.3 context can be used on this machine, as found by trying.

    Attributes:
        name: Name of the GPU; "": it cannot be used.
        memory: The most bytes that textures may take; None: OpenGL cannot be used.
        lacking: A sentence that says why OpenGL 4.3 cannot be used; None: it can.
    """

    name: str = ""
    memory: int | None = None
    lacking: str | None = None


@cache
def opengl() -> OpenGL:
    """Find out whether a separate OpenGL 4.3 context can be used. The answer is cached.

    A context is opened on a separate thread, because on one where Blender's own is current, that may fail.
    """
    return threads.start(_tried).result()


def _tried() -> OpenGL:
    try:
        device = open_gl()
    except NoDeviceError as error:
        return OpenGL(lacking=str(error))
    device.release()
    return OpenGL(device.name, device.budget.limit)
