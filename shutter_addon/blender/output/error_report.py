"""Reports of errors, which users send: versions, the device, what the edit consists of, the last errors and warnings.

They are short Markdown, and contain no names of strips, scenes, files or folders of the user.
"""

import importlib
import platform
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from functools import partial

import bpy
import gpu
from bpy.types import PropertyGroup, Scene, Strip

from ...compute.devices.device import MEGABYTE, NoDeviceError
from ...core import recent_errors
from ...core.messages import UserError
from ..data import snapshot, source_media, strips, versions
from ..devices import available
from ..rendering import render_settings

PACKAGES = "numpy", "OpenImageIO", "av", "cv2", "moderngl"


def text(scene: Scene | None) -> str:
    """Return the error report as Markdown: versions, device, the edit, last errors. Call on the main thread.

    Args:
        scene: The scene whose edit is described; None: describe no edit.
    """
    lines = ["### Virtual Shutter: report of an error", ""]
    for part in (_versions, _device, partial(_edit, scene)):
        try:
            lines.extend(part())
        except Exception as error:  # the edit or a driver can be broken in any way
            recent_errors.exception(error)
            lines.append("- the rest cannot be told: see the last error")
    last = [f"- {line}" for line in recent_errors.last()]
    return "\n".join([*lines, "", "Last errors and warnings", "", *(last or ["- none"]), ""])


def _versions() -> Iterator[str]:
    window = "no window" if bpy.app.background else "with a window"
    yield f"- Virtual Shutter: {versions.extension()}"
    yield f"- Blender: {bpy.app.version_string}, build {bpy.app.build_hash.decode()}, {window}"
    yield f"- System: {platform.platform()}; Python: {platform.python_version()}"
    yield f"- Packages: {', '.join(f'{module} {_version(module)}' for module in PACKAGES)}"


def _version(module: str) -> str:
    try:
        return str(importlib.import_module(module).__version__)
    except Exception as error:  # it is missing, or a library for another system or Python
        return f"cannot be imported ({type(error).__name__})"


def _device() -> Iterator[str]:
    with suppress(SystemError):  # in the background, without gpu.init()
        driver = f"{gpu.platform.renderer_get()}, {gpu.platform.vendor_get()}, {gpu.platform.version_get()}"
        yield f"- Blender's GPU: {gpu.platform.backend_type_get()}, {driver}"
    wanted = render_settings.wanted()
    try:
        kind, lesser = available.choose(wanted)
        chosen = f"{available.name(kind)} ({kind}){'; ' if lesser else ''}{lesser or ''}"
    except NoDeviceError as error:
        chosen = f"nothing; {error}"
    yield f"- Renders: {without_paths(chosen)}; {wanted} is wanted"
    yield f"- GPU memory: {render_settings.memory().limit // MEGABYTE} MB may be taken"


def without_paths(words: str) -> str:
    """Return a message of a driver or a library with "(path)" in place of paths.

    Everything from the first path's beginning to the last path's end is replaced, since folders' names can have spaces.
    """
    return re.sub(r"(?<!\w)(?:[A-Za-z]:)?[\\/~](?:.*[\\/])?\S*", "(path)", words)


def _edit(scene: Scene | None) -> Iterator[str]:
    """Yield lines that describe an edit by types and numbers, without names."""
    if scene is None:
        return
    render, version = scene.render, ".".join(map(str, bpy.data.version))
    size = f"{render.resolution_x}×{render.resolution_y} at {render.resolution_percentage} %"
    yield f"- Frames: {scene.frame_start} to {scene.frame_end}, at {scene.frame_current}; {size}"
    yield f"- Saved by Blender {version}; output {render.image_settings.file_format}"
    counts = Counter(strip.type for strip in strips.all_strips(scene))
    yield f"- Strips: {', '.join(f'{count} {kind}' for kind, count in sorted(counts.items())) or 'none'}"
    for effect, strip, _source in strips.shown_effects(scene):
        yield from _effect(scene, effect, strip)


def _effect(scene: Scene, effect: PropertyGroup, strip: Strip) -> Iterator[str]:
    yield f"- Effect: window {effect.window}, {_options(effect)}"
    for what, groups in (("shutter", effect.shutters), ("region", effect.regions)):
        yield from (f"  - {times} × {what}, {line}" for line, times in Counter(map(_options, groups)).items())
    frame = min(max(scene.frame_current, strip.left_handle), strip.right_handle - 1)
    try:
        with source_media.spec(strips.source_of(scene, effect, strip)).open() as medium:
            size = f"{medium.width}×{medium.height}, {medium.count} frames"
            yield f"  - footage: {medium.file_kind}, {size}, read as {medium.dtype}, alpha {medium.alpha}"
        snapshot.take(scene, effect, strip, (frame,)).effect.at(frame)
    except UserError:
        yield f"  - cannot be shown at frame {frame}: see the last error"


def _options(group: PropertyGroup) -> str:
    """Return the choices, switches and integers of a property group that differ from their defaults, as a text."""
    words = []
    for prop in group.bl_rna.properties:
        name = prop.identifier
        if prop.type in ("ENUM", "BOOLEAN", "INT") and not (prop.is_hidden or name.startswith("active_")):
            value = getattr(group, name)
            if value != prop.default:
                words.append(f"{name} {value}")
    return ", ".join(words) or "defaults"
