"""Operators that set as numbers, in a dialog, what is dragged or pointed at in the preview."""

import math

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import FloatProperty, FloatVectorProperty, IntProperty
from bpy.types import Context, Event, Operator, PropertyGroup

from ...core.messages import EffectError
from ...core.model.limits import MAX_DEGREES, MAX_DISTANCE, MAX_SCALE
from ..data import annotations, preview_areas, selection
from ..editing import drawn_places, region_edits
from .operator_bases import OfEffect, OfRegion, own_classes
from .region_gizmo import wants_keys


class SHUTTER_OT_region_transform(OfRegion, Operator):
    """Move, turn and scale the active region by numbers, as its handles in the preview do"""

    bl_label = "Transform Region"

    location: FloatVectorProperty(
        name="Location",
        description="Distance from where the region was drawn, as a fraction of the picture",
        subtype="XYZ",
        size=2,
        min=-MAX_DISTANCE,
        max=MAX_DISTANCE,
        step=1,
    )
    rotation: FloatProperty(
        name="Rotation",
        description="Rotation about the region's center",
        subtype="ANGLE",
        min=-math.radians(MAX_DEGREES),
        max=math.radians(MAX_DEGREES),
    )
    scale: FloatProperty(
        name="Scale", description="Scale about the region's center", default=1.0, min=-MAX_SCALE, max=MAX_SCALE
    )

    def invoke(self, context: Context, _event: Event) -> set[str]:
        region = selection.active_region(selection.active(context)[1])
        self.location, self.rotation, self.scale = region.location, region.rotation, region.scale
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: Context) -> None:
        layout = self.layout
        layout.activate_init = True  # Blender heeds it neither with a property split nor for a vector
        layout.prop(self, "location", index=0, text="Location X")
        layout.prop(self, "location", index=1, text="Location Y")
        layout.prop(self, "rotation")
        layout.prop(self, "scale")

    def change(self, context: Context, effect: PropertyGroup) -> None:
        index, region = effect.active_region, selection.active_region(effect)
        drawn_places.hold(effect, index)
        region.location, region.rotation, region.scale = self.location, self.rotation, self.scale
        if wants_keys(context, effect, index):
            region_edits.key_region(effect, index)


class SHUTTER_OT_probe_pixel(OfEffect, Operator):
    """Probe a pixel that is named by its numbers, and not the one under the pointer"""

    bl_label = "Probe Pixel"
    bl_options = {"REGISTER"}
    only_seen = True

    column: IntProperty(name="Column", description="Number of the pixel from the left, from 1", default=1, min=1)
    row: IntProperty(name="Row", description="Number of the pixel from below, from 1", default=1, min=1)

    def invoke(self, context: Context, _event: Event) -> set[str]:
        size = annotations.picture_size(selection.active(context)[1])
        at = context.window_manager.virtual_shutter.probe_at
        inside = all(0 <= place < 1 for place in at)
        self.column, self.row = (
            int(place * n) + 1 for place, n in zip(at if inside else (0.5, 0.5), size, strict=True)
        )
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, _context: Context) -> None:
        self.layout.activate_init = True
        self.layout.prop(self, "column")
        self.layout.prop(self, "row")

    def change(self, context: Context, effect: PropertyGroup) -> None:
        width, height = annotations.picture_size(effect)
        if self.column > width or self.row > height:
            sentence = rpt_("The picture has {width} × {height} pixels")
            raise EffectError(sentence.format(width=width, height=height))
        live = context.window_manager.virtual_shutter
        live.live = live.probe = True
        live.probe_at = (self.column - 0.5) / width, (self.row - 0.5) / height
        preview_areas.redraw(context)


classes = own_classes(globals())
