"""What a report of an error should have in it, as short Markdown: versions, the device, what the edit is made of, and
the last errors and warnings. Nothing in it names what is the user's: no strip, no scene, no file, no folder."""

from __future__ import annotations

import importlib
import os
import platform
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress

import bpy
import gpu
from bpy.types import Scene

from ...core import told
from ...devices.device import MEGABYTE, NoDeviceError, machine_memory
from ..data import preferences, versions
from ..devices import available
from ..rendering import render_settings
from . import edit_structure

# What the extension uses, by the names that it is imported by.
PACKAGES = {
    "NumPy": "numpy",
    "OpenImageIO": "OpenImageIO",
    "PyAV": "av",
    "OpenCV": "cv2",
    "moderngl": "moderngl",
}
BACKENDS = {"OPENGL": "OpenGL", "VULKAN": "Vulkan", "METAL": "Metal", "NONE": "nothing", "UNKNOWN": "unknown"}


def text(scene: Scene | None) -> str:
    """The report; scene: whose sequencer is shown, or None. On the main thread."""
    lines = ["### Virtual Shutter: report of an error", "", *_told(_versions), *_told(_device)]
    lines += ["", "Edit", "", *_told(lambda: edit_structure.lines(scene) if scene else ["- none"])]
    return "\n".join([*lines, "", "Last errors and warnings", "", *(_sentences() or ["- none"]), ""])


def _told(part: Callable[[], Iterable[str]]) -> list[str]:
    """The lines of a part: what is reported may be broken in any way, the edit as well as a driver."""
    lines: list[str] = []
    try:
        lines.extend(part())
    except Exception as error:
        told.exception(error)
        lines.append("- the rest cannot be told: see the last error")
    return lines


def _versions() -> Iterator[str]:
    app = bpy.app
    yield f"- Virtual Shutter: {versions.extension()}, {_zip()}"
    branch = app.build_branch.decode("utf-8", "replace")
    yield f"- Blender: {app.version_string}, build {branch} {app.build_hash.decode()}"
    yield f"- System: {platform.platform()}; {'no window' if app.background else 'with a window'}"
    yield f"- Python: {platform.python_version()}"
    yield f"- Packages: {', '.join(f'{name} {_version(module)}' for name, module in PACKAGES.items())}"


def _zip() -> str:
    """Which of the extension's zips this is: those for a system list their wheels in the manifest."""
    manifest = tomllib.loads(versions.MANIFEST.read_text(encoding="utf-8"))
    if wheels := manifest.get("wheels"):
        return f"zip for {', '.join(manifest.get('platforms', ['any system']))} with {len(wheels)} wheels"
    return "zip without wheels, or a checkout"


def _version(module: str) -> str:
    try:
        return str(getattr(importlib.import_module(module), "__version__", "of unknown version"))
    except ModuleNotFoundError as error:
        return "missing" if error.name == module else f"lacks {error.name}"
    except Exception as error:  # a library of another system, or another Python
        return f"cannot be imported ({type(error).__name__})"


def _device() -> Iterator[str]:
    with suppress(SystemError):  # in the background, where nobody has called gpu.init()
        backend = BACKENDS.get(gpu.platform.backend_type_get(), "unknown")
        driver = f"{gpu.platform.renderer_get()}, {gpu.platform.vendor_get()}, {gpu.platform.version_get()}"
        yield f"- Blender's GPU: {backend}, {driver}"
    wanted = render_settings.wanted()
    if wanted not in ("blender", "cpu"):  # else it is left alone
        opengl = available.opengl()
        yield f"- OpenGL 4.3: {without_paths(opengl.lacking or f'{opengl.name}, {opengl.driver}')}"
    try:
        kind, lesser = available.choose(wanted)
        because = f"; {without_paths(lesser)}" if lesser else ""
        yield f"- Renders: {available.name(kind)} ({kind}), {wanted} is wanted{because}"
    except NoDeviceError as error:
        yield f"- Renders: nothing, {wanted} is wanted; {without_paths(str(error))}"
    most, memory = render_settings.memory().limit // MEGABYTE, machine_memory()
    yield f"- GPU memory: {most} MB may be taken, {preferences.gpu_memory() or 'nothing'} is set in the preferences"
    in_all = "unknown" if memory is None else f"{memory / (1 << 30):.1f} GB"
    processor = platform.processor() or platform.machine()
    yield f"- Processor: {processor}, {os.cpu_count()} logical cores; memory: {in_all}"


def without_paths(words: str) -> str:
    """What a driver or a library says, without the paths that it may name: all from the first one's beginning to the
    last one's end, as folders may have spaces in their names."""
    return re.sub(r"(?<!\w)(?:[A-Za-z]:)?[\\/~](?:.*[\\/])?\S*", "(path)", words)


def _sentences() -> list[str]:
    """The oldest first; when each was told last, and how often."""
    return [
        f"- {each.seconds:.0f} s: {each.words}" + (f" × {each.times}" if each.times > 1 else "") for each in told.last()
    ]
