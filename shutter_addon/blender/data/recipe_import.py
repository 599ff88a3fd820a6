"""Write a recipe into an effect's Blender data: shutters, regions, strokes, keys and options."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_data as data_

from ...core.model import effect as model
from ...core.model import keyframes
from ...core.model.choices import CHANNELS
from ...core.model.fields import fields_of
from ...core.model.keyframes import Channel
from ...core.model.scribbles import mapped
from ...core.recipes import recipe
from ...media.files import check_name
from ...media.opening import MatteFile
from ...media.sequence import IMAGE_SUFFIXES
from . import external_files, fcurves, strips
from .annotations import LAYERS, NOT_THIS, add_stroke, annotation, picture_size, picture_to_image

_KINDS = {model.MatteRegion: "MATTE", model.OutlineRegion: "OUTLINE", model.SubjectRegion: "SUBJECT"}


def apply(scene, effect, strip, source: model.Effect, folder: Path = Path()) -> None:
    """Replace the settings, shutters, regions, strokes and keys of an effect by those of a recipe.

    Args:
        scene: The scene that has the effect.
        effect: The effect's property group.
        strip: The effect strip. Frame 1 of the recipe is its first frame.
        source: The recipe.
        folder: The recipe's folder. Paths of mattes in the recipe are relative to it.

    Raises:
        MediaError: A matte is missing or cannot be read. The effect is unchanged then.
    """
    first = strip.left_handle - 1
    images = {file: matte_image(folder / file.path, file.channel) for file in recipe.contents(source)}
    clear(scene, effect)
    path, options = effect.path_from_id(), source.options.at(1)
    _set_fields(effect, path, options, first)
    _set_fields(effect, path, source, first, group=effect.name)
    effect.use_source_time = source.time is not None
    if isinstance(source.time, keyframes.SourceTime):
        _set_channel(effect, path, "source_time", source.time.numbers, first, group=effect.name)
    _set_fields(effect.camera, f"{path}.camera", source.camera, first, group=effect.camera.name)
    _set_moves(effect.camera, f"{path}.camera", source.camera.moves, first, group=effect.camera.name)
    for i, shutter in enumerate(source.shutters):
        _add_shutter(effect, f"{path}.shutters[{i}]", shutter, first)
    for i, region in enumerate(source.regions):
        # Pass the path: path_from_id is slow among many items.
        _add_region(effect, strip, f"{path}.regions[{i}]", region, source.shutters[region.shutter], first)
        if isinstance(region, model.MatteRegion) and isinstance(region.content, model.FileContent):
            _set_file(effect.regions[-1], strip, region.content, images[region.content])


def _set_fields(owner, path: str, part: Any, first: float, **curve) -> None:
    """Set properties of a property group, with their keys, to the fields of an object of the model.

    Args:
        owner: The property group.
        path: Data path of `owner` from the scene.
        part: A part of the recipe, such as a model.Shutter. `owner` has a property for each of its declared fields
            (fields_of).
        first: Timeline frame before the effect strip's first one. Adding it to a recipe's frame gives the timeline
            frame.
        curve: Further arguments of fcurves.set_keys, such as `group`.
    """
    for name, each in fields_of(part.__class__).items():
        value = getattr(part, name)
        if each.is_channel:
            _set_channel(owner, path, each.blender, value, first, **curve)
        else:
            setattr(owner, each.blender, str(value).upper() if each.choices else value)


def _set_channel(owner, path: str, name: str, source: Channel, first: float, change: Callable = float, **curve) -> None:
    """Set a number or a vector of a property group, with F-curves if the recipe has keys for it.

    The property's own value becomes the constant one or, with keys, that of the first key.

    Args:
        owner, path, first, curve: As in _set_fields.
        name: Name of the property.
        source: The values over time, from the recipe.
        change: Converts each value to Blender's, such as degrees to radians.
    """
    if not isinstance(source, keyframes.Keys):
        setattr(owner, name, change(source.at(1)))
        return
    values = [change(value) for value in source.values]
    setattr(owner, name, values[0])
    for index, numbers in enumerate(np.reshape(values, (len(values), -1)).T.tolist()):
        _set_keys(owner, f"{path}.{name}", index, source, numbers, first, **curve)


def _set_keys(owner, path: str, index: int, keys: keyframes.Keys, values: Iterable[float], first: float, **curve):
    """Give one component of a property an F-curve that has the frames and eases of `keys`, but other values.

    Args:
        owner: The property group.
        path: Data path of the property from the scene.
        index: Component of a vector; 0 for a single number.
        keys: The recipe's keys.
        values: The value of each key for this component.
        first: Added to the frames of `keys` to give timeline frames.
        curve: Further arguments of fcurves.set_keys, such as `group`.
    """
    frames = (frame + first for frame in keys.frames)
    fcurves.set_keys(owner.id_data, path, index, list(zip(frames, values, keys.eases, strict=True)), **curve)


def matte_image(path: str | Path, channel: str = "luminance"):
    """Return a movie, image sequence or picture as an image data-block for a matte. Load it if needed.

    Args:
        path: The file, or the first file of an image sequence.
        channel: The channel that the matte will use, in the words of recipes. The file must have it.

    Raises:
        MediaError: The file is missing, cannot be read, or lacks the channel.
    """
    with MatteFile(path=Path(path), channel=channel).open() as matte:
        found, count = Path(matte.path), matte.count
    name = check_name(found)
    if bpy.data.filepath and bpy.context.preferences.filepaths.use_relative_paths:
        name = external_files.relative(name)
    is_sequence = found.suffix.lower() in IMAGE_SUFFIXES and count > 1
    image = bpy.data.images.load(name, check_existing=not is_sequence)  # an existing image may be a single one
    if is_sequence:
        image.source = "SEQUENCE"
    return image


def clear(scene, effect) -> None:
    """Remove an effect's shutters, regions, scribbles and keys."""
    fcurves.remove_curves(scene, effect.path_from_id() + ".")
    effect.shutters.clear()
    effect.regions.clear()
    effect.camera.stops.clear()
    effect.active_shutter = effect.active_region = 0
    if effect.scene.annotation is not None:
        for layer in list(effect.scene.annotation.layers):
            effect.scene.annotation.layers.remove(layer)


def _add_shutter(effect, path: str, source: model.Shutter, first: float) -> None:
    shutter = effect.shutters.add()
    _set_fields(shutter, path, source, first)
    if isinstance(source.follow, model.AnyRegion):
        shutter.follow, shutter.follow_region = "REGION", source.follow.name
    elif source.follow is not None:
        shutter.follow = "CAMERA"
    keys = source.bars.channel
    bars = keys.values if isinstance(keys, keyframes.Keys) else (keys.at(1),)
    for k, weight in enumerate(bars[0]):
        shutter.bars.add().weight = weight
        if isinstance(keys, keyframes.Keys):
            _set_keys(shutter, f"{path}.bars[{k}].weight", 0, keys, (each[k] for each in bars), first)


def _add_region(effect, strip, path: str, source: model.AnyRegion, shutter: model.Shutter, first: float) -> None:
    region = effect.regions.add()
    region.shutter = shutter.name
    region.kind = source.kind.upper() if isinstance(source, model.Region) else _KINDS[type(source)]
    content = getattr(source, "content", None)
    if isinstance(content, model.RampContent):
        region.kind = "RAMP"
        _set_fields(region, path, content, first)
    _set_fields(region, path, source, first)
    if isinstance(source, model.SubjectRegion):
        for layer, drawings in zip(LAYERS, (source.drawings, source.nots, source.outlines), strict=True):
            color = NOT_THIS if layer == "not_layer" else shutter.color
            if drawings.frames:
                setattr(region, layer, _draw(effect, strip, source, drawings, color, first))
    elif source.drawings:
        region.layer = _draw(effect, strip, source, source.drawings, shutter.color, first)
    _set_moves(region, path, source.moves, first)


def _set_file(region, strip, content: model.FileContent, image) -> None:
    """Make a region's matte an image, with the recipe's timing and channel."""
    region.matte, region.image = "IMAGE", image
    # Blender's offset counts from the strip's untrimmed start, a recipe's from its first frame.
    region.offset = content.offset - (strips.skipped(strip) if content.timing == "timeline" else 0)
    region.timing = content.timing.upper()
    is_named = content.channel not in [word.lower() for word, *_ in CHANNELS if word != "NAMED"]
    region.channel = "NAMED" if is_named else content.channel.upper()
    region.channel_name = content.channel if is_named else ""


def _set_moves(moving, path: str, moves: model.Moves, first: float, **curve) -> None:
    """Set location, rotation and scale of a region or the camera, with their keys; arguments as in _set_fields."""
    for name, change in (("location", tuple), ("rotation", np.radians), ("scale", float)):
        _set_channel(moving, path, name, getattr(moves, name), first, change, **curve)


def _draw(effect, strip, source: model.AnyRegion, drawn: model.Drawings, color: Sequence[float], first: float) -> str:
    """Draw a region's strokes on a new annotation layer, and return the layer's name.

    Each drawing goes to its own frame if the region is a subject, or its location has keys. Otherwise it goes to the
    strip's first frame.

    Args:
        effect: The effect, which has the annotation.
        strip: The effect strip, by whose transform the strokes are placed in the sequencer's image.
        source: The region in the recipe.
        drawn: The drawings by frame: strokes as points in fractions of the picture.
        color: The layer's color.
        first: Timeline frame before the effect strip's first one. Adding it to a recipe's frame gives the timeline
            frame.
    """
    layer = annotation(effect).layers.new(source.name or data_("Region"), set_active=False)
    layer.color = color
    to_image = picture_to_image(strip, picture_size(effect))
    is_keyed = isinstance(source.moves.location, keyframes.Keys) or isinstance(source, model.SubjectRegion)
    for frame, strokes in zip(drawn.frames, drawn.strokes, strict=True):
        drawing = layer.frames.new(int((frame if is_keyed else 1) + first))
        for points in strokes:
            add_stroke(drawing, mapped(to_image, points))
    return layer.info
