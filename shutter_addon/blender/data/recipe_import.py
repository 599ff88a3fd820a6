"""A recipe into Blender's data: shutters, regions, strokes, keys and options."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import bpy
import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_

from ...core.messages import EffectError
from ...core.model import limits
from ...core.model.scribbles import mapped
from ...core.recipes import recipe
from ...media import MediaError
from ...media.files import check_name
from ...media.matte_files import MatteFile
from ...media.sequence import IMAGE_SUFFIXES
from . import fcurves, geometry, strips
from .annotations import add_stroke, annotation, picture_size
from .snapshot import OPTIONS


def apply(scene, effect, strip, source: recipe.Recipe, folder: Path = Path()) -> None:
    """Replaces the effect's data and keys by a recipe, whose frame 1 is the strip's first; folder: where it lies, which
    its mattes' paths begin at. EffectError: its keys cannot lie there; MediaError: it has no such mattes; nothing has
    changed."""
    first = strip.left_handle - 1
    _check_keys(source, first)
    mattes = [region for region in source.regions if isinstance(region, recipe.MatteRegion)]
    images = {region.path: matte_image(folder / region.path, region.channel) for region in mattes}
    clear(scene, effect)
    # Bars per frame before the factor, which else would change the window.
    effect.bars_per_frame, effect.inbetween = source.inbetween, str(source.inbetween)
    effect.inbetween_method = source.inbetween_method.upper()
    effect.window = source.window
    for name in OPTIONS:
        setattr(effect, name, getattr(source, name).upper())
    effect.aggregate, effect.border = str(source.aggregate), source.border
    for name in ("stop_at_cuts", "plate_reach", "decontaminate"):
        setattr(effect, name, getattr(source, name))
    path = effect.path_from_id()
    effect.use_source_time = bool(source.time)
    if source.time:
        _set_number(scene, effect, path, "source_time", source.time, first, group=effect.name)
    _set_number(scene, effect, path, "edge_aware", source.edge_aware, first, group=effect.name)
    _set_moves(scene, effect.camera, f"{path}.camera", source.camera, first, group=effect.camera.name)
    influence = source.camera_influence
    _set_number(scene, effect.camera, f"{path}.camera", "influence", influence, first, group=effect.camera.name)
    for i, shutter in enumerate(source.shutters):
        _add_shutter(scene, effect, f"{path}.shutters[{i}]", shutter, first)
    colors = {shutter.name: shutter.color for shutter in source.shutters}
    for region in source.regions:
        if isinstance(region, recipe.Region):
            _add_region(scene, effect, strip, region, colors[region.shutter], first)
        elif isinstance(region, recipe.OutlineRegion):
            _add_outline(scene, effect, strip, region, colors[region.shutter], first)
        else:
            _add_matte(scene, effect, strip, region, images, first)


def _set_number(scene, owner, path: str, name: str, value: recipe.Keyable, first: float, **curve) -> None:
    """A number of a property group, or its keys."""
    if not isinstance(value, list):
        setattr(owner, name, value)
        return
    setattr(owner, name, value[0].value)
    keys = [(key.frame + first, key.value, key.ease) for key in value]
    fcurves.set_keys(scene, f"{path}.{name}", 0, keys, **curve)


def matte_image(path: str | Path, channel: str = "luminance"):
    """The movie, image sequence or picture at a path, to which a region can point. MediaError: there is none, or none
    with such a channel."""
    with MatteFile(path=Path(path), channel=channel).open() as matte:
        path, count = matte.path, matte.count
    name = _kept(check_name(path))
    is_sequence = path.suffix.lower() in IMAGE_SUFFIXES and count > 1
    if is_sequence and (known := _sequence_at(name)) is not None:
        return known
    try:
        image = bpy.data.images.load(name, check_existing=not is_sequence)  # one that is there may be no sequence
    except RuntimeError as error:  # its path is longer than Blender's may be
        sentence = rpt_("{file}: Blender cannot read it ({error})")
        raise MediaError(sentence.format(file=path.name, error=error)) from None
    if is_sequence:
        image.source = "SEQUENCE"
    return image


def _sequence_at(name: str):
    """The image that is the sequence at a path already, or None."""
    own = [image for image in bpy.data.images if image.source == "SEQUENCE" and image.library is None]
    return next((image for image in own if bpy.path.abspath(image.filepath) == bpy.path.abspath(name)), None)


def _kept(name: str) -> str:
    """A path as Blender keeps those that are chosen: relative to the saved file, if the preferences say so. With two
    slashes before it, it would be relative in any case."""
    if os.name == "posix" and name.startswith("//"):
        name = name[1:]
    if bpy.data.filepath and bpy.context.preferences.filepaths.use_relative_paths:
        with suppress(ValueError):  # another drive
            return bpy.path.relpath(name)
    return name


def _check_keys(source: recipe.Recipe, first: float) -> None:
    """EffectError: keys would lie beyond Blender's timeline, or on the same frame, as it counts in float32."""
    mattes = [region for region in source.regions if not isinstance(region, recipe.Region)]
    numbers = [source.edge_aware, source.camera_influence, *(shutter.trail for shutter in source.shutters)]
    numbers += [number for shutter in source.shutters for number in (shutter.threshold, shutter.softness)]
    numbers += [*(region.opacity for region in source.regions), *(region.width for region in mattes)]
    keyed: list = [source.time, source.camera, *(number for number in numbers if isinstance(number, list))]
    for keys in (*keyed, *(part.keys for part in (*source.shutters, *source.regions))):
        frames = np.array([key.frame + first for key in keys], dtype=np.float32)
        if (wrong := np.flatnonzero(np.abs(frames) > limits.MAX_FRAME)).size:
            sentence = rpt_("frame {frame} of the recipe: a key cannot lie beyond Blender's timeline")
            raise EffectError(sentence.format(frame=f"{keys[wrong[0]].frame:.10g}"))
        if (wrong := np.flatnonzero(np.diff(frames) == 0)).size:
            sentence = rpt_("frame {frame} of the recipe: so late on the timeline, the next key is on the same frame")
            raise EffectError(sentence.format(frame=f"{keys[wrong[0]].frame:.10g}"))


def clear(scene, effect) -> None:
    """Removes the effect's shutters, regions, scribbles and keys."""
    fcurves.remove_curves(scene, effect.path_from_id() + ".")
    effect.shutters.clear()
    effect.regions.clear()
    effect.camera.stops.clear()
    effect.active_shutter = effect.active_region = 0
    if effect.scene.annotation is not None:
        for layer in list(effect.scene.annotation.layers):
            effect.scene.annotation.layers.remove(layer)


def _add_shutter(scene, effect, path: str, source: recipe.Shutter, first: float) -> None:
    shutter = effect.shutters.add()
    shutter.name, shutter.color = source.name, source.color
    if source.follow is not None:
        shutter.follow = "CAMERA" if source.follow == recipe.CAMERA else "REGION"
        shutter.follow_region = "" if source.follow == recipe.CAMERA else source.follow
    shutter.follow_motion, shutter.follow_smooth = source.follow_motion.upper(), source.follow_smooth
    if source.length == "timeline":
        shutter.length = "TIMELINE"
    if source.trail is not None:
        shutter.length = "MOTION"
        _set_number(scene, shutter, path, "trail", source.trail, first)
    shutter.combine, shutter.by_luminance = source.combine.upper(), source.by_luminance
    if source.threshold is not None:
        shutter.use_threshold = True
        for name in ("threshold", "softness"):
            _set_number(scene, shutter, path, name, getattr(source, name), first)
    for weight in source.bars if source.bars is not None else source.keys[0].bars:
        shutter.bars.add().weight = weight
    if source.keys:
        for k in range(len(shutter.bars)):
            keys = [(key.frame + first, key.bars[k], key.ease) for key in source.keys]
            fcurves.set_keys(scene, f"{path}.bars[{k}].weight", 0, keys)


def _add_region(scene, effect, strip, source: recipe.Region, color: Sequence[float], first: float) -> None:
    region = effect.regions.add()
    region.name, region.shutter, region.width = source.name, source.shutter, source.width
    region.kind, region.is_layer = source.kind.upper(), source.layer
    region.layer = _draw(effect, strip, source, color, first)
    path = _last_path(effect)
    _set_number(scene, region, path, "opacity", source.opacity, first)
    _set_moves(scene, region, path, source.keys, first)


def _add_outline(scene, effect, strip, source: recipe.OutlineRegion, color: Sequence[float], first: float) -> None:
    region = _new_matte(effect, source)
    region.between = source.between.upper()
    region.layer = _draw(effect, strip, source, color, first)
    _set_numbers(scene, effect, source, first)


def _add_matte(scene, effect, strip, source: recipe.MatteRegion | recipe.RampRegion, images, first: float) -> None:
    region = _new_matte(effect, source)
    if isinstance(source, recipe.RampRegion):
        region.ramp = source.ramp.upper()
    else:
        region.matte, region.image = "IMAGE", images[source.path]
        # Blender's offset counts from the strip's untrimmed start, a recipe's from the strip's first frame.
        region.offset = source.offset - (strips.skipped(strip) if source.timing == "timeline" else 0)
        region.timing = source.timing.upper()
        is_named = source.channel not in recipe.CHANNELS
        region.channel = "NAMED" if is_named else source.channel.upper()
        region.channel_name = source.channel if is_named else ""
    _set_numbers(scene, effect, source, first)


def _new_matte(effect, source: recipe.OutlineRegion | recipe.MatteRegion | recipe.RampRegion):
    region = effect.regions.add()
    region.name, region.shutter, region.kind = source.name, source.shutter, source.kind.upper()
    region.invert, region.blend, region.is_layer = source.invert, source.blend.upper(), source.layer
    return region


def _last_path(effect) -> str:
    """The path of the region that was added last. Blender takes long to find an item's place among many."""
    return f"{effect.path_from_id()}.regions[{len(effect.regions) - 1}]"


def _set_numbers(scene, effect, source, first: float) -> None:
    """Numbers of the matte that was added last, and their keys."""
    region, path = effect.regions[-1], _last_path(effect)
    _set_number(scene, region, path, "opacity", source.opacity, first)
    _set_number(scene, region, path, "feather", source.width, first)
    _set_moves(scene, region, path, source.keys, first)


def _set_moves(scene, moving, path: str, keys: list, first: float, **curve) -> None:
    """Location, rotation and scale of a region or of the camera, and their keys."""
    start = keys[0] if keys else recipe.CameraKey(frame=0)
    moving.location, moving.rotation, moving.scale = start.location, np.radians(start.rotation), start.scale
    if not keys:
        return
    channels = {
        ("location", 0): lambda key: key.location[0],
        ("location", 1): lambda key: key.location[1],
        ("rotation", 0): lambda key: np.radians(key.rotation),
        ("scale", 0): lambda key: key.scale,
    }
    for (name, index), value in channels.items():
        numbers = [(key.frame + first, value(key), key.ease) for key in keys]
        fcurves.set_keys(scene, f"{path}.{name}", index, numbers, **curve)


def _draw(effect, strip, source: recipe.Region | recipe.OutlineRegion, color: Sequence[float], first: float) -> str:
    """Draws a region's strokes on an annotation layer of its own, a frame per drawing; the layer's name."""
    layer = annotation(effect).layers.new(source.name or data_("Region"), set_active=False)
    layer.color = color
    to_image = geometry.picture_to_image(strip, picture_size(effect))
    for key, strokes in source.drawings():
        drawing = layer.frames.new(int((key.frame if key else 1) + first))
        for points in strokes:
            add_stroke(drawing, mapped(to_image, np.asarray(points)))
    return layer.info
