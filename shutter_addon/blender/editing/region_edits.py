"""Edit an effect's regions and their annotation layers: add, remove, move, draw.

Strokes stay where they were drawn: each drawing notes where its region, which may move, was at the time.
"""

from collections.abc import Sequence
from contextlib import suppress
from itertools import repeat

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import AnnotationLayer, PropertyGroup, Strip

from ...core import revision
from ...core.messages import EffectError
from ...core.model.effect import Drawings
from ...core.model.motions import Placement
from ...core.model.outlines import Curves
from ...core.model.scribbles import mapped
from ..data import annotations, fcurves, selection, snapshot, strips
from ..data.annotations import LAYERS, NOT_THIS, annotation, layer_of, layers_of
from ..data.consistency import bars, choose_region, color_layers, refollow, unique
from ..data.sampled import Sampling
from . import motion_keys


def add_region(
    effect: PropertyGroup, shutter: PropertyGroup, kind: str = "LINE", name: str = "", **values: object
) -> PropertyGroup:
    """Add a region at the end of the list, make it active and return it.

    The region gets an annotation layer for strokes, unless it is a matte or ramp.

    Args:
        shutter: The shutter that exposes the region.
        kind: An item of choices.KINDS.
        name: The region's name, made unique by a number; "": the shutter's name.
        values: Further values of its properties, by name.
    """
    region = effect.regions.add()
    region.name = unique(name or shutter.name, {r.name for r in effect.regions})
    region.shutter, region.kind = shutter.name, kind
    if kind not in strips.MATTES:
        new_layer(effect, region)
    for prop, value in values.items():
        setattr(region, prop, value)
    effect.active_region = len(effect.regions) - 1
    return region


def first_drawn(effect: PropertyGroup, shutter: PropertyGroup, kind: str) -> PropertyGroup:
    """Return a region for new strokes: the active one if it is empty and uses the shutter, otherwise a new one.

    A matte or ramp, which has no strokes, does not count as empty.

    An effect's first scribble usually marks a subject, if its shutter is sharp (at most one open frame). Then turn
    *Follow Edges* on, and let the region, if it is a line, become a subject if one is found under its first stroke. Do
    neither if the user has set *Follow Edges*.

    Args:
        shutter: The shutter that exposes the region.
        kind: An item of choices.KINDS, which the region gets in any case.
    """
    is_sharp = bool(np.count_nonzero(bars(shutter)) <= 1)
    is_scribble = kind not in strips.LAID
    is_first = is_scribble and is_sharp and not effect.regions and not effect.is_property_set("edge_aware")
    if is_first:
        effect.edge_aware = 1.0
    if (region := _undrawn(effect, shutter)) is None:
        region = add_region(effect, shutter, kind)
    region.kind, region.finds_subject = kind, is_first
    if not is_scribble:
        region.motion = "LOCATION"  # limbs would turn the whole subject
    return region


def _undrawn(effect: PropertyGroup, shutter: PropertyGroup) -> PropertyGroup | None:
    """Return the active region if it uses this shutter and nothing is drawn in it yet, else None."""
    region = selection.active_region(effect)
    if region is None or region.kind in strips.MATTES or region.shutter != shutter.name:
        return None
    layer = layer_of(effect, region)
    return None if layer is not None and any(drawing.strokes for drawing in layer.frames) else region


def new_layer(effect: PropertyGroup, region: PropertyGroup, name: str = "layer") -> AnnotationLayer:
    """Give a region an empty annotation layer, and return the layer.

    It has the region's name and its shutter's color, or the color NOT_THIS if it is the "not_layer".

    Args:
        name: The region's property for the layer, one of annotations.LAYERS: "layer" (its strokes) or, for a subject,
            "not_layer" (strokes on what it is not) or "outline_layer" (outlines that correct it).
    """
    layer = annotation(effect).layers.new(region.name, set_active=name == "layer")
    layer.color = NOT_THIS if name == "not_layer" else effect.shutters[region.shutter].color
    setattr(region, name, layer.info)
    return layer


def draw_curves(
    effect: PropertyGroup, strip: Strip, region: PropertyGroup, curves: Curves | Sequence[np.ndarray], frame: int
) -> None:
    """Store curves as the drawing of a region at a timeline frame, in place of one that it has at that frame.

    Args:
        strip: The effect strip, whose transform places the curves in the sequencer's image.
        region: The region. Curves of a subject are outlines that correct it ("outline_layer").
        curves: Points (n, 2) of each curve, in fractions of the picture.
        frame: The timeline frame.

    Raises:
        EffectError: The strip has a scale of 0, or its transform is not finite.
    """
    to_image = annotations.picture_to_image(strip, annotations.picture_size(effect))
    if not annotations.is_invertible(to_image):
        raise EffectError(rpt_('strip "{strip}" has a scale of 0').format(strip=strip.name))
    name = "outline_layer" if region.kind == "SUBJECT" else "layer"
    layer = layer_of(effect, region, name) or new_layer(effect, region, name)
    for drawing in [drawing for drawing in layer.frames if drawing.frame_number == frame]:
        layer.frames.remove(drawing)
    drawing = layer.frames.new(frame)
    for points in curves:
        annotations.add_stroke(drawing, mapped(to_image, np.asarray(points)))
    revision.changed()  # Blender does not report new strokes


def remove_layers(effect: PropertyGroup, region: PropertyGroup) -> None:
    """Remove all annotation layers of a region."""
    for layer in layers_of(effect, region):
        effect.scene.annotation.layers.remove(layer)
    for name in LAYERS:
        setattr(region, name, "")


def remove_region(effect: PropertyGroup, index: int) -> None:
    """Remove the region with this index, its keyframes and its annotation layers."""
    remove_layers(effect, effect.regions[index])
    name = effect.regions[index].name
    fcurves.remove_item(effect, "regions", index)
    refollow(effect, name, None)
    effect.active_region = min(effect.active_region, max(len(effect.regions) - 1, 0))
    choose_region(effect)


def move(effect: PropertyGroup, kind: str, index: int, to: int) -> None:
    """Move a shutter or a region in its list, and make it active.

    The first shutter is the default, and later regions cover earlier ones.

    Args:
        kind: "shutter" or "region".
        index: Index of the shutter or region.
        to: Its new index.
    """
    fcurves.move_item(effect, f"{kind}s", index, to)
    setattr(effect, f"active_{kind}", to)


def assign_region(effect: PropertyGroup, index: int, shutter: PropertyGroup) -> None:
    """Make the region with this index use another shutter and its color, and make both active."""
    effect.regions[index].shutter = shutter.name
    color_layers(effect, shutter)
    effect.active_region = index
    effect.active_shutter = list(effect.shutters).index(shutter)


def hold_drawings(effect: PropertyGroup, index: int) -> None:
    """Store, for each drawing of a region, the region's placement when it was drawn, unless that is stored already.

    Call this before the region is first moved: its strokes then move along from where they were drawn. Do nothing for
    mattes, ramps, outlines and subjects (strips.LAID).

    Args:
        index: Index of the region.
    """
    region = effect.regions[index]
    if region.kind not in strips.LAID:
        _note(effect, region, _origins(Sampling.of(effect.id_data, effect, None, ()).drawings(index)))


def begin_drawing(effect: PropertyGroup, strip: Strip, index: int, *, erases: bool = False) -> None:
    """Prepare a region's drawing at the current frame for the pen, so that strokes appear where they are drawn.

    If the region has moved since a drawing was made at this frame, store the drawing where it appears now. The eraser
    also needs the strokes that appear here from another frame's drawing: if this frame has none, and the region has
    moved since any was made, store a copy here. If the region was tracked, insert keyframes of the user's here. Do
    nothing for mattes, ramps, outlines and subjects (strips.LAID).

    Args:
        index: Index of the region.
        erases: Whether strokes will be erased.

    Raises:
        EffectError: The region's strokes or placement at this frame cannot be read.
    """
    region, scene = effect.regions[index], effect.id_data
    frame = scene.frame_current
    if region.kind in strips.LAID:
        return
    shown = snapshot.region_at(scene, effect, strip, index, (frame,))
    here, origins = shown.placement(frame), _origins(shown.drawings)
    is_elsewhere = any(origin != here for origin in origins.values())
    if origins.get(frame, here) != here or (erases and is_elsewhere and frame not in origins):
        draw_curves(effect, strip, region, shown.at(frame).strokes, frame)
    if motion_keys.MotionKeys(effect, index, region.motion).are_made():
        with suppress(EffectError):  # with locked curves, tracking stops, too
            motion_keys.insert(effect, index)
    _note(effect, region, {**origins, frame: here})


def _origins(drawings: Drawings) -> dict[float, Placement]:
    """Return where the region was when each of its drawings was made, by the drawing's timeline frame."""
    return dict(zip(drawings.frames, drawings.origins or repeat(Placement()), strict=False))


def _note(effect: PropertyGroup, region: PropertyGroup, origins: dict[float, Placement]) -> None:
    region.drawn.clear()
    for frame, origin in origins.items():
        noted = region.drawn.add()
        noted.frame, noted.location = frame - effect.start, origin.location
        noted.rotation, noted.scale = np.radians(origin.rotation), origin.scale
