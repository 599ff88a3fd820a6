"""What an edit is made of, in kinds and numbers: no names, no paths, for a report of an error."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import closing

import bpy

from ...core import templates
from ...core.messages import UserError
from ...media.file_kind import file_kind
from ..data import annotations, colour_configuration, fcurves, snapshot, source_media, strips
from ..data.validation import word

_OPTIONS = ("position", "interpolation", "light", "exposure", "edges", "aggregate", "inbetween", "inbetween_method")
_SWITCHES = ("stop_at_cuts", "decontaminate", "border", "use_source_time")


def lines(scene) -> list[str]:
    """Of a scene and its effects, as Markdown."""
    found = [*_of_scene(scene)]
    for number, strip in enumerate(strips.effect_strips(scene), 1):
        effect = strips.effect_of(scene, strip.scene)
        found += ["", f"Effect {number}", ""]
        found += _of_effect(scene, effect, strip) if effect else ["- its data are gone"]
    return found


def _of_scene(scene) -> Iterator[str]:
    render, view = scene.render, scene.view_settings
    size = f"{render.resolution_x}×{render.resolution_y} at {render.resolution_percentage} %"
    yield f"- Frames: {scene.frame_start} to {scene.frame_end}, at {scene.frame_current}; {size}, {_rate(render)} fps"
    saved = scene.virtual_shutter.version
    by = saved if re.fullmatch(r"[\d.]{1,20}", saved) else "none"  # a script may have written anything there
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
    yield f"- Strips: {_counted(strip.type for strip in all_strips) or 'none'}"
    others = sum(bool(other.virtual_shutter.effects) for other in bpy.data.scenes if other != scene)
    yield f"- Effects: {len(scene.virtual_shutter.effects)}; other scenes with effects: {others}"


def _of_effect(scene, effect, strip) -> Iterator[str]:
    options = [f"{name} {_word(effect, name)}" for name in _OPTIONS]
    options += [f"{name} {'on' if getattr(effect, name) else 'off'}" for name in _SWITCHES]
    yield f"- Options: window {effect.window}, {', '.join(options)}, follow edges {effect.edge_aware:g}"
    yield f"- Strip: {', '.join(_of_strip(strip))}"
    yield from _of_source(scene, effect, strip)
    path = effect.path_from_id()
    yield f"- Keys: {_keys(scene, path)} of the effect, {_keys(scene, f'{path}.camera')} of the camera"
    shutters = [_of_shutter(scene, path, index, shutter) for index, shutter in enumerate(effect.shutters)]
    yield from _listed("Shutter", len(shutters), shutters)
    regions = [_of_region(scene, effect, index, region) for index, region in enumerate(effect.regions)]
    yield from _listed("Region", len(regions), regions)
    frame = min(max(scene.frame_current, strip.left_handle), strip.right_handle - 1)
    try:
        snapshot.take(scene, effect, strip, (frame,)).effect.at(frame)
    except UserError as error:
        yield f"- Cannot be shown at frame {frame}: {templates.plain(str(error))}"


def _of_strip(strip) -> Iterator[str]:
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


def _of_source(scene, effect, strip) -> Iterator[str]:
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
                f"- Footage: {file_kind(spec.path, spec.options['stream'])}, {medium.width}×{medium.height}, {rate},"
                f" {medium.count} frames, read as {medium.dtype}, alpha {medium.alpha}, color space {_standard(space)}"
            )
    except UserError as error:
        yield f"- Footage: {templates.plain(str(error))}"


def _of_shutter(scene, path: str, index: int, shutter) -> str:
    words = [_word(shutter, "combine"), f"{len(shutter.bars)} bars", f"moves with {_word(shutter, 'follow')}"]
    words += [f"length {_word(shutter, 'length')}", f"{_keys(scene, f'{path}.shutters[{index}]')} keys"]
    words += ["threshold"] if shutter.use_threshold else []
    return ", ".join(words + (["by luminance"] if shutter.by_luminance else []))


def _of_region(scene, effect, index: int, region) -> str:
    """Whose it is as a number: shutters are named."""
    names = [shutter.name for shutter in effect.shutters]
    owner = names.index(region.shutter) + 1 if region.shutter in names else "none"
    words = [_word(region, "kind"), f"shutter {owner}"]
    if region.kind == "MATTE":
        words += [f"from {_word(region, 'matte')}", f"channel {_word(region, 'channel')}", _word(region, "timing")]
    elif region.kind == "RAMP":
        words.append(_word(region, "ramp"))
    else:
        layer = annotations.layer_of(effect, region)
        drawings = layer.frames if layer else ()
        words += [f"{len(drawings)} drawings", f"{sum(len(drawing.strokes) for drawing in drawings)} strokes"]
    words += [f"between {_word(region, 'between')}"] if region.kind == "OUTLINE" else []
    words += [f"blend {_word(region, 'blend')}"] if region.kind in strips.LAID else []
    words += ["layer"] if region.is_layer else []
    words += [f"follows {_word(region, 'follow_kind')}"] if region.follow_clip else []
    return ", ".join([*words, f"{_keys(scene, f'{effect.path_from_id()}.regions[{index}]')} keys"])


def _listed(what: str, count: int, found: list[str]) -> Iterator[str]:
    """Equal ones in one line."""
    yield f"- {what}s: {count}"
    yield from (f"  - {times} × {words}" for words, times in Counter(found).items())


def _keys(scene, path: str) -> int:
    """How many keyframes there are of a thing and of all in it."""
    return sum(len(curve.keyframe_points) for curve in fcurves.curves_under(scene, f"{path}."))


def _word(owner, name: str) -> str:
    """An enum's identifier; files can hold numbers that stand for none."""
    try:
        return word(owner, name)
    except UserError:
        return "unknown"


def _counted(words: Iterable[str]) -> str:
    return ", ".join(f"{count} {word}" for word, count in sorted(Counter(words).items()))


def _rate(render) -> str:
    return f"{render.fps / render.fps_base:g}"


def _standard(name: str) -> str:
    """A name of Blender's own OpenColorIO configuration, or of one that OpenColorIO brings; others are somebody's."""
    configuration = colour_configuration.name()
    return name if not configuration or configuration.startswith("ocio://") else "(of another configuration)"
