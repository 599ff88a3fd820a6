"""What operators need from an effect. Each function returns why it is missing, in the user's language, or None."""

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup

from ..data import selection, strips
from ..editing import region_edits


def a_shutter(effect: PropertyGroup) -> str | None:
    return None if selection.active_shutter(effect) is not None else rpt_("The effect has no shutter: add one")


def a_region(effect: PropertyGroup) -> str | None:
    return None if selection.active_region(effect) is not None else rpt_("The shutter has no region: draw one")


def strokes(effect: PropertyGroup) -> str | None:
    if sentence := a_region(effect):
        return sentence
    is_matte = selection.active_region(effect).kind in strips.MATTES
    return rpt_("The region is a matte or a ramp without strokes") if is_matte else None


def an_outline(effect: PropertyGroup) -> str | None:
    if sentence := a_region(effect):
        return sentence
    return None if selection.active_region(effect).kind == "OUTLINE" else rpt_("The region is not an outline")


def room_for_a_region(effect: PropertyGroup) -> str | None:
    return a_shutter(effect) or region_edits.why_full(effect, regions=1)


def room_for_a_shutter(effect: PropertyGroup) -> str | None:
    return region_edits.why_full(effect, shutters=1)
