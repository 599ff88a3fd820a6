"""Operators that make mattes and outlines of Blender's masks."""

import bpy
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, Mask, Operator, PropertyGroup

from ....blender.data import selection
from ....blender.editing import region_edits
from ....blender.interface import needs
from ....blender.interface.operator_bases import kept, operator
from . import mask_outlines


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
    mask_outlines.from_mask(self.edit, effect, self.effect_strip, shutter, _mask_named(self.mask))
