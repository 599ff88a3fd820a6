"""Operators that make regions subjects, outlines and scribbles; and the first stroke of a new effect, which becomes a
subject by itself."""

import bpy
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Operator, PropertyGroup

from ...core.messages import UserError
from ..data import consistency, selection
from ..editing import subjects
from ..rendering.effect_source import FAULTS
from . import needs
from .operator_bases import operator, popup, redraw, report


@operator("Find Subject", needs.strokes, only_seen=True)
def subject_find(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Make the active region a subject, which a model finds under its strokes at this frame and follows"""
    if not subjects.find(self.edit, effect, self.effect_strip, effect.active_region):
        report(self, rpt_("The model finds no subject under the stroke: draw along its middle, or outline it"))
        return {"CANCELLED"}
    return None


@operator("Scribble", needs.a_subject, icon="IPO_LINEAR")
def subject_scribble(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Make the active subject a scribble: its strokes, as wide as the region's width"""
    effect.regions[effect.active_region].kind = "LINE"


@operator("Outline", needs.a_subject, icon="CURVE_BEZCIRCLE", only_seen=True)
def subject_outline(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Make the active subject an outline, which is drawn where the subject has strokes"""
    if not subjects.to_outline(self.edit, effect, self.effect_strip, effect.active_region):
        report(self, rpt_("The subject has no outline there"))
        return {"CANCELLED"}
    return None


def pen_is_up(context: Context) -> None:
    """Look for a subject under the first stroke of a new effect; the pen draws on the subject from now on."""
    seen = selection.in_picture(context)
    region = selection.active_region(seen[1]) if seen else None
    if region is None:
        return
    scene, effect, strip = seen
    consistency.aim_pen(effect)
    if not subjects.is_first_stroke(effect, region):
        return
    try:
        is_found = subjects.find(scene, effect, strip, effect.active_region)
    except (*FAULTS, UserError) as error:
        popup(context, str(error), icon="ERROR")
        return
    if is_found:
        bpy.ops.ed.undo_push(message=iface_("Find Subject", contexts.operator_default))
        redraw(context)
