"""Reports of errors as short Markdown: versions, the device, the edit's parts, and the last errors and warnings.

They contain no names of strips, scenes, files or folders of the user.
"""

import importlib
import os
import platform
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, suppress

import bpy
import gpu
from bpy.types import PropertyGroup, Scene, Strip

from ...core import told
from ...core.messages import UserError
from ...devices.device import MEGABYTE, NoDeviceError, machine_memory
from ..data import annotations, fcurves, preferences, snapshot, source_media, strips, versions
from ..data.validation import word
from ..devices import available
from ..rendering import render_settings

# The packages that the extension uses, by module.
PACKAGES = {"NumPy": "numpy", "OpenImageIO": "OpenImageIO", "PyAV": "av", "OpenCV": "cv2", "moderngl": "moderngl"}
BACKENDS = {"OPENGL": "OpenGL", "VULKAN": "Vulkan", "METAL": "Metal", "NONE": "nothing", "UNKNOWN": "unknown"}


def text(scene: Scene | None) -> str:
    """Return the report, on the main thread; `scene` is the sequencer's, or None."""
    lines = ["### Virtual Shutter: report of an error", "", *_lines_of(_versions), *_lines_of(_device)]
    lines += ["", "Edit", "", *_lines_of(lambda: _edit(scene) if scene else ["- none"])]
    return "\n".join([*lines, "", "Last errors and warnings", "", *(_sentences() or ["- none"]), ""])


def _lines_of(part: Callable[[], Iterable[str]]) -> list[str]:
    """Return the lines of a part, as far as nothing fails: the edit or a driver can be broken in any way."""
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
    """Return which of the extension's zips this is. Those for a system list their wheels in the manifest."""
    manifest = tomllib.loads(versions.MANIFEST.read_text(encoding="utf-8"))
    if wheels := manifest.get("wheels"):
        return f"zip for {', '.join(manifest.get('platforms', ['any system']))} with {len(wheels)} wheels"
    return "zip without wheels, or a checkout"


def _version(module: str) -> str:
    try:
        return str(getattr(importlib.import_module(module), "__version__", "of unknown version"))
    except ModuleNotFoundError as error:
        return "missing" if error.name == module else f"lacks {error.name}"
    except Exception as error:  # a library for another system or Python
        return f"cannot be imported ({type(error).__name__})"


def _device() -> Iterator[str]:
    with suppress(SystemError):  # in the background, without gpu.init()
        backend = BACKENDS.get(gpu.platform.backend_type_get(), "unknown")
        driver = f"{gpu.platform.renderer_get()}, {gpu.platform.vendor_get()}, {gpu.platform.version_get()}"
        yield f"- Blender's GPU: {backend}, {driver}"
    wanted = render_settings.wanted()
    if wanted not in ("blender", "cpu"):  # otherwise OpenGL is not opened
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
    """Remove paths from a message of a driver or a library.

    Everything from the first path's beginning to the last path's end goes, since folders' names can have spaces.
    """
    return re.sub(r"(?<!\w)(?:[A-Za-z]:)?[\\/~](?:.*[\\/])?\S*", "(path)", words)


def _sentences() -> list[str]:
    """Return the messages, the oldest first, with the time when each was shown last, and how often."""
    return [
        f"- {each.seconds:.0f} s: {each.words}" + (f" × {each.times}" if each.times > 1 else "") for each in told.last()
    ]


def _edit(scene: Scene) -> list[str]:
    """Describe an edit by kinds and numbers: the scene and its effects."""
    found = list(_of_scene(scene))
    for number, strip in enumerate(strips.effect_strips(scene), 1):
        effect = strips.effect_of(scene, strip.scene)
        found += ["", f"Effect {number}", ""]
        found += _of_effect(scene, effect, strip) if effect else ["- its data are gone"]
    return found


def _of_scene(scene: Scene) -> Iterator[str]:
    render, view = scene.render, scene.view_settings
    size = f"{render.resolution_x}×{render.resolution_y} at {render.resolution_percentage} %"
    rate = f"{render.fps / render.fps_base:g} fps"
    yield f"- Frames: {scene.frame_start} to {scene.frame_end}, at {scene.frame_current}; {size}, {rate}"
    saved = scene.virtual_shutter.version
    by = saved if re.fullmatch(r"[\d.]{1,20}", saved) else "none"  # scripts can write anything there
    yield f"- Saved: by Blender {'.'.join(map(str, bpy.data.version))}, version {by} of the extension"
    yield f"- Output: {render.image_settings.file_format}, {render.image_settings.color_depth} bits"
    colours = {
        "display": scene.display_settings.display_device,
        "view": view.view_transform,
        "look": view.look,
        "sequencer": scene.sequencer_colorspace_settings.name,
        "working space": bpy.data.colorspace.working_space,
    }
    yield f"- Colors: {', '.join(f'{what} {_standard(name)}' for what, name in colours.items())}"
    all_strips = scene.sequence_editor.strips_all if scene.sequence_editor else ()
    counts = sorted(Counter(strip.type for strip in all_strips).items())
    yield f"- Strips: {', '.join(f'{count} {kind}' for kind, count in counts) or 'none'}"
    others = sum(bool(other.virtual_shutter.effects) for other in bpy.data.scenes if other != scene)
    yield f"- Effects: {len(scene.virtual_shutter.effects)}; other scenes with effects: {others}"


def _of_effect(scene: Scene, effect: PropertyGroup, strip: Strip) -> Iterator[str]:
    options = [f"window {effect.window}", f"follow edges {effect.edge_aware:g}", *_chosen(effect)]
    yield f"- Options: {', '.join(dict.fromkeys(options))}"
    yield f"- Strip: {', '.join(_of_strip(strip))}"
    yield from _of_source(scene, effect, strip)
    yield f"- Keys: {_keys(scene, effect)} of the effect, {_keys(scene, effect.camera)} of the camera"
    yield from _listed(scene, "Shutter", [(shutter, [f"{len(shutter.bars)} bars"]) for shutter in effect.shutters])
    yield from _listed(scene, "Region", [(region, _of_region(effect, region)) for region in effect.regions])
    frame = min(max(scene.frame_current, strip.left_handle), strip.right_handle - 1)
    try:
        snapshot.take(scene, effect, strip, (frame,)).effect.at(frame)
    except UserError as error:
        yield f"- Cannot be shown at frame {frame}: {told.described(error)}"


def _of_strip(strip: Strip) -> Iterator[str]:
    yield f"{strip.type} in channel {strip.channel}, frames {strip.left_handle} to {strip.right_handle - 1}"
    yield f"content of {strip.content_duration} from {strip.content_start:g}, blend {strip.blend_type}"
    if strip.parent_meta():
        yield "in a meta strip"
    retimed = len(getattr(strip, "retiming_keys", ()))
    changes = {
        "muted": strip.mute,
        "reversed": getattr(strip, "use_reverse_frames", False),
        f"strobe {getattr(strip, 'strobe', 1):g}": getattr(strip, "strobe", 1) > 1,
        f"{retimed} retiming keys": retimed > 0,
        f"{len(strip.modifiers)} modifiers": len(strip.modifiers) > 0,
        "baked": bool(strip.virtual_shutter_bake.identity),
        "proxy": getattr(strip, "use_proxy", False),
        "deinterlaced": getattr(strip, "use_deinterlace", False),
    }
    yield from (word for word, is_so in changes.items() if is_so)


def _of_source(scene: Scene, effect: PropertyGroup, strip: Strip) -> Iterator[str]:
    source = strips.nearest_source(scene, effect, strip)
    if source is None:
        yield "- Source: none"
        return
    parts = sum(other.virtual_shutter_source == effect.source for other in scene.sequence_editor.strips_all)
    yield f"- Source: {', '.join(_of_strip(source))}; parts: {parts}"
    try:
        spec = source_media.spec(source)
        with closing(spec.open()) as medium:
            space = spec.options["colorspace"]
            rate = f"{float(medium.fps):g} fps" if medium.fps else "no rate"
            yield (
                f"- Footage: {medium.file_kind}, {medium.width}×{medium.height}, {rate},"
                f" {medium.count} frames, read as {medium.dtype}, alpha {medium.alpha}, color space {_standard(space)}"
            )
    except UserError as error:
        yield f"- Footage: {told.described(error)}"


def _of_region(effect: PropertyGroup, region: PropertyGroup) -> list[str]:
    """Describe a region, with its shutter as a number, since shutters have names."""
    names = [shutter.name for shutter in effect.shutters]
    words = [f"shutter {names.index(region.shutter) + 1 if region.shutter in names else 'none'}"]
    if layer := annotations.layer_of(effect, region):
        words += [f"{len(layer.frames)} drawings", f"{sum(len(drawing.strokes) for drawing in layer.frames)} strokes"]
    return words + (["follows a clip"] if region.follow_clip else [])


def _chosen(group: PropertyGroup) -> Iterator[str]:
    """Yield the enums, switches and integers of a property group that differ from their defaults."""
    for prop in group.bl_rna.properties:
        name = prop.identifier
        if prop.type in ("ENUM", "BOOLEAN", "INT") and not (prop.is_hidden or name.startswith("active_")):
            value = _word(group, name) if prop.type == "ENUM" else getattr(group, name)
            if value != prop.default:
                yield f"{name} {value}"


def _listed(scene: Scene, what: str, found: list[tuple]) -> Iterator[str]:
    """List property groups with a description; equal ones share a line."""
    yield f"- {what}s: {len(found)}"
    lines = (", ".join([*words, *_chosen(group), f"{_keys(scene, group)} keys"]) for group, words in found)
    yield from (f"  - {times} × {line}" for line, times in Counter(lines).items())


def _keys(scene: Scene, group: PropertyGroup) -> int:
    """Count the keyframes of a property group and everything in it."""
    curves = fcurves.curves_under(scene, f"{group.path_from_id()}.")
    return sum(len(curve.keyframe_points) for curve in curves)


def _word(owner: PropertyGroup, name: str) -> str:
    """Return an enum's identifier; files can hold invalid numbers."""
    try:
        return word(owner, name)
    except UserError:
        return "unknown"


def _standard(name: str) -> str:
    """Return a name from Blender's or OpenColorIO's own configurations; other names are the user's."""
    configuration = versions.colours()
    return name if not configuration or configuration.startswith("ocio://") else "(of another configuration)"
