"""Operators that find a rolling shutter and repair it."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty, FloatProperty
from bpy.types import Context, Operator, PropertyGroup

from ....blender.editing import region_edits
from ....blender.interface.operator_bases import OfEffect, operator
from ....core.messages import EffectError
from ....core.model.choices import CONTEXT, READS, SIDES
from . import rolling_shutter_repair as rolling_shutter


def _why_no_repair(effect: PropertyGroup) -> str | None:
    try:
        has_repair = rolling_shutter.of(effect) is not None
    except EffectError as error:
        return str(error)
    return None if has_repair else region_edits.why_full(effect, regions=1, shutters=2)


class SHUTTER_OT_rolling_shutter(OfEffect, Operator):
    """Show every row as it was when the middle one was filmed, so that skewed lines become straight"""

    bl_label = "Rolling Shutter Repair"
    icon = "CAMERA_DATA"
    choices = "side"
    needs = (_why_no_repair,)

    side: EnumProperty(
        name="Read First",
        description="The side of the picture that the sensor reads first",
        items=SIDES,
        translation_context=CONTEXT,
    )
    readout: FloatProperty(
        name="Readout",
        description="Time from reading the first row to the last, as a percentage of a frame",
        subtype="PERCENTAGE",
        default=50.0,
        min=1.0,
        max=100.0,
        options={"SKIP_SAVE"},
    )

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        known = rolling_shutter.of(effect)
        if known is not None and not self.properties.is_property_set("readout"):
            self.readout = 100 * known.readout  # choosing a side in the menu keeps the readout
        rolling_shutter.repair(self.edit, effect, self.effect_strip, self.readout / 100, self.side)


_READS = EnumProperty(
    name="Reads",
    description="Whether the sensor reads row by row or column by column",
    items=READS,
    translation_context=CONTEXT,
)


@operator("Find Readout", _why_no_repair, icon="VIEWZOOM", reads=_READS)
def find_readout(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Find the sensor's readout time from lines that lean while they move around the current frame, and repair it"""
    found, side = rolling_shutter.find(self.edit, effect, self.effect_strip, columns=self.reads == "COLUMNS")
    rolling_shutter.repair(self.edit, effect, self.effect_strip, min(abs(found), 1.0), side)
    name = next(name for word, name, _ in SIDES if word == side)
    percent = round(100 * abs(found))
    sentence = rpt_("Readout of {percent} % of a frame, read first: {side}")
    self.report({"INFO"}, sentence.format(percent=percent, side=iface_(name, CONTEXT)))
