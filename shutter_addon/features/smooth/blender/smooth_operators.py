"""The property Smooth in the panel, notes on it, and the operator that turns it on."""

from collections.abc import Iterator

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Operator, PropertyGroup, UILayout

from ....blender.interface.operator_bases import operator
from ....blender.interface.panel_parts import sentence
from . import strobing


def _why_smooth(effect: PropertyGroup) -> str | None:
    return None if effect.inbetween == "1" else rpt_("The exposures are already smooth")


@operator("Smooth Streaks", _why_smooth)
def smooth_streaks(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Expose as many moments between filmed frames as the footage needs"""
    effect.inbetween = "AUTO"


def draw_smooth(layout: UILayout, effect: PropertyGroup) -> None:
    """Draw how smooth an effect is."""
    row = layout.row(align=True)
    row.prop(effect, "inbetween")
    if effect.inbetween != "1":
        row.prop(effect, "skip_repeats", text="", icon="FRAME_NEXT")
        if strobing.repeats(effect):
            sentence(layout, iface_("The source repeats frames: motion continues across them"), "INFO")


def notes(effect: PropertyGroup) -> Iterator[tuple[str, str]]:
    """Yield notes on an effect, each with the operator that helps."""
    if (step := strobing.last(effect)) is not None:
        yield strobing.too_few_frames(step), "shutter.smooth_streaks"
