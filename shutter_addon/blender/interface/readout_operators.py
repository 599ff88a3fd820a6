"""Operators that repair what a rolling shutter has skewed, and find how long its readout is."""

from collections.abc import Iterator
from contextlib import contextmanager

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty, FloatProperty
from bpy.types import Context, Operator, PropertyGroup, Window

from ...core.messages import EffectError
from ...core.model.choices import CONTEXT, READOUT_UNITS, READS, SIDES
from ..editing import collection_edits, rolling_shutter
from .operator_bases import OfEffect, own_classes


@contextmanager
def _waiting(window: Window | None) -> Iterator[None]:
    """Inside, the pointer shows that it takes some seconds."""
    if window is not None:
        window.cursor_modal_set("WAIT")
    try:
        yield
    finally:
        if window is not None:
            window.cursor_modal_restore()


class _OfReadout(OfEffect):
    """Needs room for what a repair adds, unless there is one."""

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        try:
            has_repair = rolling_shutter.of(effect) is not None
        except EffectError as error:
            return str(error)
        return None if has_repair else collection_edits.why_full(effect, regions=1, shutters=2)


class SHUTTER_OT_rolling_shutter(_OfReadout, Operator):
    """Show every row as it was when the middle one was filmed: straight, where a rolling shutter has skewed it"""

    bl_label = "Rolling Shutter Repair"

    side: EnumProperty(
        name="Read First",
        description="Side of the filmed picture that the sensor reads first",
        items=SIDES,
        translation_context=CONTEXT,
    )
    unit: EnumProperty(
        name="Unit",
        description="What the readout is counted in",
        items=READOUT_UNITS,
        translation_context=CONTEXT,
        options={"SKIP_SAVE"},
    )
    readout: FloatProperty(
        name="Readout",
        description="Time from the first row to the last, of that from a filmed frame to the next",
        subtype="PERCENTAGE",
        default=50.0,
        min=1.0,
        max=100.0,
        options={"SKIP_SAVE"},
    )
    milliseconds: FloatProperty(
        name="Readout",
        description="Time from the first row to the last, in milliseconds",
        default=15.0,
        min=0.1,
        max=1000.0,
        soft_max=40.0,
        options={"SKIP_SAVE"},
    )

    def draw(self, _context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "side")
        layout.prop(self, "unit")
        layout.prop(self, "readout" if self.unit == "PERCENT" else "milliseconds")

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        known = rolling_shutter.of(effect)
        if known is not None and not self.properties.is_property_set("readout"):
            self.readout = 100 * known.readout  # from the menu, another side keeps it
        share = self.readout / 100
        if self.unit == "MILLISECONDS":
            share = rolling_shutter.share_of(self.edit, effect, self.effect_strip, self.milliseconds)
        rolling_shutter.repair(self.edit, effect, self.effect_strip, share, self.side)


class SHUTTER_OT_find_readout(_OfReadout, Operator):
    """Find how long the sensor reads out, by lines that lean as they move around the current frame, and repair that"""

    bl_label = "Find Readout"

    reads: EnumProperty(
        name="Reads",
        description="What the sensor reads one after the other",
        items=READS,
        translation_context=CONTEXT,
    )

    def change(self, context: Context, effect: PropertyGroup) -> None:
        with _waiting(context.window):
            found, side = rolling_shutter.find(
                self.edit, effect, self.effect_strip, "TOP" if self.reads == "ROWS" else "LEFT"
            )
        rolling_shutter.repair(self.edit, effect, self.effect_strip, min(abs(found.share), 1.0), side)
        name = next(name for word, name, _ in SIDES if word == side)
        percent = round(100 * abs(found.share))
        sentence = rpt_("Readout of {percent} % of a frame, read first: {side}")
        self.report({"INFO"}, sentence.format(percent=percent, side=iface_(name, CONTEXT)))


classes = own_classes(globals())
