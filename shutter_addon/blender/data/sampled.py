"""What of Blender's data has F-curves, as channels that are sampled at timeline frames. On Blender's main thread."""

from collections.abc import Callable, Collection
from typing import Any

import numpy as np
from bpy.types import PropertyGroup, Strip

from ...core.messages import EffectError, UserError
from ...core.model import effect as model
from ...core.model import keyframes
from ...core.model.fields import Field, fields_of
from ...core.model.motions import Placement
from . import annotations, strips, validation
from .fcurves import Curves

Frames = Collection[float]  # of the timeline


def tried(function: Callable, *arguments: object) -> Any:
    """The result, or the UserError in its place, which is raised where the value is asked for."""
    try:
        return function(*arguments)
    except UserError as error:
        return error


def channel(
    curves: Curves, owner: PropertyGroup, path: str, name: str, frames: Frames, change: Callable = lambda v: v
) -> keyframes.Channel:
    """A float property or a vector, each value changed by a function."""

    def at(frame: float) -> object:
        return change(curves.value(owner, path, name, frame))

    try:
        keyed = curves.of(owner, path, name)
    except EffectError as error:
        return keyframes.Constant(error)
    return over(frames if keyed else None, at, curves.keys(keyed))


def over(
    frames: Frames | None, at: Callable[[float], object], keys: tuple[tuple[float, keyframes.Ease], ...] = ()
) -> keyframes.Channel:
    """What a function gives, sampled at frames; None: it gives the same at all of them."""
    if frames is None:
        return keyframes.Constant(tried(at, 0.0))
    return keyframes.Samples({frame: tried(at, frame) for frame in frames}, keys)


def sampled_fields(
    curves: Curves, owner: PropertyGroup, path: str, kind: type, frames: Frames, unused: Collection[str] = ()
) -> dict:
    """What the fields of one of the model's classes are in Blender, by their names there; path: the owner's, from the
    scene; unused: those that count nothing, which stay as a new one has them. EffectError: a choice is none of its
    items, or a number without keys outside of its range."""
    return {
        name: channel(curves, owner, path, field.blender, frames) if field.is_channel else value(owner, field)
        for name, field in fields_of(kind).items()
        if name not in unused
    }


def value(owner: PropertyGroup, field: Field, number: float | None = None) -> Any:
    """What a field without a channel is, as the model has it; number: which an F-curve gives it. EffectError: it is
    none of its choices, or outside of its range."""
    if field.choices:
        return field.word(validation.word(owner, field.blender, number))
    if isinstance(field.default, bool) and number is not None:
        return number >= 0.5
    if isinstance(field.default, bool | str):
        return getattr(owner, field.blender)
    if isinstance(field.default, tuple):
        return tuple(getattr(owner, field.blender))
    return validation.number(owner, field.blender)


def moves(curves: Curves, moving: PropertyGroup, path: str, frames: Frames) -> model.Moves:
    """Of a region or of the camera."""
    return model.Moves(
        location=channel(curves, moving, path, "location", frames),
        rotation=channel(curves, moving, path, "rotation", frames, np.degrees),
        scale=channel(curves, moving, path, "scale", frames),
    )


def placement_now(moving: PropertyGroup) -> Placement:
    """Where a region or the camera is as its properties stand: at the current frame, keyed or not."""
    return Placement(tuple(moving.location), float(np.degrees(moving.rotation)), moving.scale)


def _origins(
    curves: Curves, path: str, effect: PropertyGroup, region: PropertyGroup, numbers: Collection[float]
) -> tuple[Placement, ...]:
    """Where a region was as its drawings at these frames were made (model.Drawings)."""
    if not region.drawn or region.kind in strips.LAID:
        return ()
    known = {np.rint(effect.start + noted.frame): placement_now(noted) for noted in region.drawn}
    there = moves(curves, region, path, numbers)
    return tuple(known[number] if number in known else there.at(number) for number in numbers)


def drawings(
    curves: Curves,
    path: str,
    effect: PropertyGroup,
    region: PropertyGroup,
    placement: keyframes.Channel | None,
    frames: Frames | None,
    layer_name: str = "layer",
) -> model.Drawings:
    """A region's drawings: between two of them with the ease of its location's keys. Only those that the frames need
    are read; None: all. layer_name: one of annotations.LAYERS"""
    width, height = annotations.picture_size(effect)
    layer = annotations.layer_of(effect, region, layer_name)
    drawings = sorted(layer.frames, key=lambda drawing: drawing.frame_number) if layer else []
    numbers = tuple(drawing.frame_number for drawing in drawings)
    frames = numbers if frames is None else frames
    needed = {index for frame in frames for index in keyframes.span(numbers, frame)[:2]} if drawings else ()
    timing = tried(curves.find, f"{path}.location")
    is_curve = timing is not None and not isinstance(timing, EffectError)
    eases = dict(curves.keys([timing])) if is_curve and len(numbers) > 1 else {}
    return model.Drawings(
        name=region.name,
        frames=numbers,
        strokes=tuple(annotations.strokes_of(drawing) if i in needed else None for i, drawing in enumerate(drawings)),
        eases=tuple(eases.get(number, "linear") for number in numbers),
        aspect=width / height,
        placement=placement,
        origins=_origins(curves, path, effect, region, numbers),
    )


def placement(curves: Curves, effect: PropertyGroup, strip: Strip, frames: Frames) -> keyframes.Channel:
    """The matrix from the sequencer's image to the strip's picture, which may be keyed."""
    size, path = annotations.picture_size(effect), f"{strip.path_from_id()}.transform"
    keyed = {name: curve for name in annotations.TRANSFORM if (curve := tried(curves.find, f"{path}.{name}"))}

    def at(frame: float) -> np.ndarray | None:
        moved = {name: curve.evaluate(frame) for name, curve in keyed.items() if not isinstance(curve, EffectError)}
        return annotations.image_to_picture(strip, size, **moved)

    return over(frames if keyed else None, at)


def source_time(curves: Curves, path: str, effect: PropertyGroup, frames: Frames) -> keyframes.Channel:
    def value(frame: float) -> float:
        return curves.value(effect, path, "source_time", frame)

    try:
        keyed = curves.of(effect, path, "source_time")
    except EffectError as error:
        return keyframes.Constant(error)
    keys = curves.keys(keyed)
    return over(frames if keyed else None, keyframes.SourceTime(keyframes.Computed(value), keys).at, keys)
