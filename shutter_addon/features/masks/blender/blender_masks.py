"""Blender's masks: read them as plain data, and make mattes or outlines of them.

Python's API evaluates a mask only at a scene's current frame. So a mask that moves cannot be a matte, but can be turned
into an outline.
"""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain

import bpy
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, Mask, MaskLayer, MaskSpline, Operator, PropertyGroup
from numpy.typing import ArrayLike

from ....blender.data import annotations, fcurves, selection, snapshot
from ....blender.data.struct_dna import LayoutError, read, record
from ....blender.editing import region_edits
from ....blender.interface import needs
from ....blender.interface.operator_bases import kept, operator
from ....core.messages import EffectError
from ....core.model import masks, outlines
from ....media import outlining

_FARTHEST = 1e4  # of coordinates, in pictures


def still_mask(mask: Mask) -> masks.MaskShape:
    """Return the shape of a mask that does not move, as plain data.

    Raises:
        EffectError: The mask has F-curves, shape keys or points with a parent, so it may move; or one of its numbers is
            not finite, or larger than _FARTHEST.
    """
    points = (point for layer in mask.layers for spline in layer.splines for point in spline.points)
    is_keyed = fcurves.curves_under(mask, "") or any(map(_has_shape_keys, mask.layers))
    if is_keyed or any(point.parent.id is not None for point in points):
        sentence = rpt_('mask "{mask}" moves: use "Outline from Mask", or take a film of its Mask strip for the matte')
        raise EffectError(sentence.format(mask=mask.name))
    return _shape(mask)


def at_frames(mask: Mask, frames: Iterable[int]) -> Iterator[masks.MaskShape]:
    """Yield the shape of a mask at each of these frames, as Blender evaluates it there: with all motion applied.

    Args:
        frames: Frames at which to evaluate the mask, counted as in the mask's own F-curves.

    Raises:
        EffectError: A number of the mask is not finite, or larger than _FARTHEST.
    """
    scene = bpy.data.scenes.new("mask")
    try:
        for frame in frames:
            scene.frame_set(frame)
            yield _shape(mask.evaluated_get(scene.view_layers[0].depsgraph))
    finally:
        bpy.data.scenes.remove(scene)


def _has_shape_keys(layer: MaskLayer) -> bool:
    """Tell whether a layer of a mask has shape keys. Blender's API does not say so, so this reads Blender's memory.

    If the memory cannot be interpreted, return False.
    """
    with suppress(LayoutError):
        (ends,) = read(record("MaskLayer", ("ListBase splines_shapes", "2u8")), layer.as_pointer())
        return any(ends)
    return False


def _shape(mask: Mask) -> masks.MaskShape:
    return masks.MaskShape(tuple(_layer(mask, layer) for layer in mask.layers if not layer.hide_render))


def _layer(mask: Mask, layer: MaskLayer) -> masks.MaskLayer:
    _check(mask, layer.alpha)
    return masks.MaskLayer(
        splines=tuple(_spline(mask, spline) for spline in layer.splines if spline.use_fill),
        alpha=layer.alpha,
        holes=layer.use_fill_holes,
        **{name: getattr(layer, name) for name in ("blend", "invert", "falloff", "fill_solver")},
    )


def _spline(mask: Mask, spline: MaskSpline) -> masks.MaskSpline:
    places = [fcurves.numbers(spline.points, name, size=2) for name in ("handle_left", "co", "handle_right")]
    points, weights = np.stack(places, axis=1), fcurves.numbers(spline.points, "weight")
    feathers = tuple(tuple((f.u, f.weight) for f in point.feather_points) for point in spline.points)
    _check(mask, [*points.flat, *weights, *chain(*chain(*feathers))])
    return masks.MaskSpline(
        points=tuple(tuple(map(tuple, point)) for point in points.tolist()),
        weights=tuple(weights.tolist()),
        feathers=feathers,
        cyclic=spline.use_cyclic,
        weight_interpolation=spline.weight_interpolation,
    )


def _check(mask: Mask, values: ArrayLike) -> None:
    """Check that numbers of a mask, such as coordinates, weights or opacities, are finite and at most ±_FARTHEST.

    Args:
        mask: The mask, for the message.
        values: The numbers.

    Raises:
        EffectError: A number is not.
    """
    if not (np.abs(np.asarray(values, np.float64)) <= _FARTHEST).all():
        sentence = rpt_('mask "{mask}": a point, a feather or an opacity is not a usable number')
        raise EffectError(sentence.format(mask=mask.name))


@kept
def _masks(_context: Context) -> list[tuple]:
    return [(mask.name_full, mask.name_full, "") for mask in bpy.data.masks]


def _mask_named(name: str) -> Mask:
    return next(mask for mask in bpy.data.masks if mask.name_full == name)


def _why_no_mask(_effect: PropertyGroup) -> str | None:
    return None if bpy.data.masks else rpt_("There is no mask: draw one in the Mask mode of an image or clip")


_MASK = EnumProperty(name="Mask", items=_masks, translation_context=contexts.no_translation)


@operator("Matte from Mask", needs.room_for_a_region, _why_no_mask, icon="MOD_MASK", mask=_MASK)
def matte_mask(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Make a mask the matte of the active shutter"""
    mask = _mask_named(self.mask)
    region_edits.add_region(effect, selection.active_shutter(effect), "MATTE", mask.name, matte="MASK", mask=mask)


_EVEN = 1e-5  # what an even motion of a mask may change from frame to frame, in pictures


@operator("Outline from Mask", needs.room_for_a_region, _why_no_mask, icon="CURVE_BEZCIRCLE", mask=_MASK)
def outline_from_mask(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Make an outline of the active shutter that moves as a mask does"""
    mask, strip, size = _mask_named(self.mask), self.effect_strip, annotations.picture_size(effect)
    shown = snapshot.source_frames(self.edit, effect, strip, range(strip.left_handle, strip.right_handle))
    read_shapes = at_frames(mask, [mask.frame_start + number for number in shown.values()])
    drawn = _where_motion_changes(dict(zip(map(int, shown), read_shapes, strict=True)))
    shapes = {frame: outlining.traced(shape.values(*size)) for frame, shape in drawn.items()}
    if not any(shapes.values()):
        raise EffectError(rpt_('mask "{mask}" encloses nothing in the strip').format(mask=mask.name))
    region = region_edits.add_region(effect, selection.active_shutter(effect), "OUTLINE", mask.name)
    region.motion, region.between = "LOCATION", "STRAIGHT"
    ordered = outlines.in_order(shapes.values(), size[0] / size[1])
    for frame, curves in zip(shapes, ordered, strict=True):
        region_edits.draw_curves(effect, strip, region, curves, frame)


def _where_motion_changes(shapes: dict[int, masks.MaskShape]) -> dict[int, masks.MaskShape]:
    """Keep only the shapes that are needed to reproduce a mask's motion by linear interpolation between them.

    A shape is dropped if the step from it to the next frame's shape equals the step from the previous one to it. The
    last one is dropped if the mask stood still before it.

    Args:
        shapes: The mask's shape at each frame, by ascending frame. All have the same points, apart from their places.

    Returns:
        The shapes that are kept, by frame.
    """
    steps = np.diff(np.array([_numbers(shape) for shape in shapes.values()]), axis=0)
    changes = np.abs(np.diff(steps, axis=0, prepend=1, append=0)).max(axis=1, initial=0)
    return {frame: shape for (frame, shape), change in zip(shapes.items(), changes, strict=True) if change > _EVEN}


def _numbers(shape: masks.MaskShape) -> np.ndarray:
    """Return all numbers of a mask that may move, in one array: opacities of layers, points and their weights."""
    splines = [spline for layer in shape.layers for spline in layer.splines]
    moving = [np.concatenate([np.ravel(spline.points), spline.weights]) for spline in splines]
    return np.concatenate([[layer.alpha for layer in shape.layers], *moving])
