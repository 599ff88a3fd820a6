"""Operators that make mattes and outlines of Blender's masks."""

import bpy
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, Mask, Operator, PropertyGroup, Scene, Strip

from ....blender.data import annotations, selection, snapshot
from ....blender.editing import region_edits
from ....blender.interface import needs
from ....blender.interface.operator_bases import kept, operator
from ....core.messages import EffectError
from ....core.model import outlines
from ....core.model.masks import MaskShape
from ....media import outlining
from . import mask_reading


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


@operator("Outline from Mask", needs.room_for_a_region, _why_no_mask, icon="CURVE_BEZCIRCLE", mask=_MASK)
def outline_from_mask(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Make an outline of the active shutter that moves as a mask does"""
    shutter = selection.active_shutter(effect)
    from_mask(self.edit, effect, self.effect_strip, shutter, _mask_named(self.mask))


_EVEN = 1e-5  # what an even motion of a mask may change from frame to frame, in pictures


def from_mask(scene: Scene, effect: PropertyGroup, strip: Strip, shutter: PropertyGroup, mask: Mask) -> PropertyGroup:
    """Add a region: an outline with drawings where a mask's motion changes.

    Raises:
        EffectError, MediaError: the mask cannot be read, encloses nothing in the strip, or OpenCV is missing.
    """
    size = annotations.picture_size(effect)
    shown = snapshot.source_frames(scene, effect, strip, range(strip.left_handle, strip.right_handle))
    masks = mask_reading.at_frames(mask, [mask.frame_start + number for number in shown.values()])
    drawn = _where_motion_changes(dict(zip(map(int, shown), masks, strict=True)))
    shapes = {frame: outlining.traced(shape.values(*size)) for frame, shape in drawn.items()}
    if not any(shapes.values()):
        raise EffectError(rpt_('mask "{mask}" encloses nothing in the strip').format(mask=mask.name))
    region = region_edits.add_region(effect, shutter, "OUTLINE", mask.name)
    region.motion, region.between = "LOCATION", "STRAIGHT"
    ordered = outlines.in_order(shapes.values(), size[0] / size[1])
    for frame, curves in zip(shapes, ordered, strict=True):
        region_edits.draw_curves(effect, strip, region, curves, frame)
    return region


def _where_motion_changes(shapes: dict[int, MaskShape]) -> dict[int, MaskShape]:
    """Return those of a mask's shapes by frame between which it moves evenly."""
    steps = np.diff(np.array([_numbers(shape) for shape in shapes.values()]), axis=0)
    changes = np.abs(np.diff(steps, axis=0, prepend=1, append=0)).max(axis=1, initial=0)
    return {frame: shape for (frame, shape), change in zip(shapes.items(), changes, strict=True) if change > _EVEN}


def _numbers(shape: MaskShape) -> np.ndarray:
    """Return the numbers of a mask that may move."""
    splines = [spline for layer in shape.layers for spline in layer.splines]
    moving = [np.concatenate([np.ravel(spline.points), spline.weights]) for spline in splines]
    return np.concatenate([[layer.alpha for layer in shape.layers], *moving])
