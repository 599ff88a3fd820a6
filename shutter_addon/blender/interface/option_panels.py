"""Panels of what an effect is made with: its options and in-between frames."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import PropertyGroup, Scene, Strip, UILayout

from ..rendering import inbetween_build
from ..rendering.effect_source import FAULTS
from . import inbetween_operators
from .operator_bases import soon
from .panel_parts import WithEffect, draw_properties, sentence


class Options(WithEffect):
    bl_label = "Options"

    def draw_effect(self, layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
        names = "position", "interpolation", "light", "exposure", "edges", "stop_at_cuts", "aggregate", "border"
        draw_properties(layout, effect, *names)
        column = layout.column()
        column.active = any(region.is_layer for region in effect.regions)
        draw_properties(column, effect, "decontaminate", "plate_reach")
        layout.prop(effect, "use_source_time")
        column = layout.column()
        column.active = effect.use_source_time
        column.prop(effect, "source_time")
        if effect.use_source_time and effect.inbetween == "1":
            sentence(column, iface_("No in-between frames: the nearest source frame is shown"), "INFO")


class Inbetween(WithEffect):
    bl_label = "In-Between Frames"

    def draw_effect(self, layout: UILayout, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
        build = inbetween_build.running()
        if build is not None and build.scene != effect.scene.session_uid:
            build = None  # of another effect
        column = layout.column()
        column.enabled = build is None
        column.prop(effect, "inbetween", text="Factor")
        column = column.column()
        is_on = effect.inbetween != "1"
        column.active = is_on
        draw_properties(column, effect, "inbetween_method", "inbetween_place")
        if build is not None:
            progress = iface_("{done} of {total}").format(done=build.done, total=build.total)
            layout.progress(factor=build.done / max(build.total, 1), text=progress, translate=False)
        elif is_on:
            try:
                _draw_look(layout, inbetween_build.look(scene, effect, strip))
            except FAULTS as error:
                sentence(layout, str(error), "ERROR")
        row = layout.row(align=True)
        row.operator("shutter.inbetween_build", text="Build")
        row.operator("shutter.inbetween_purge", text="Remove")


# How a state of in-between frames is called, and its icon.
_STATES = {
    "missing": (n_("Missing"), "ERROR"),
    "partial": (n_("Partial: {done} of {total}"), "ERROR"),
    "stale": (n_("Stale: the source has changed"), "ERROR"),
    "ready": (n_("Ready"), "CHECKMARK"),
}


def _draw_look(layout: UILayout, look: inbetween_build.Look) -> None:
    words, icon = _STATES[look.state.name]
    words = iface_(words).format(done=look.state.done, total=look.state.total)
    column = layout.column(align=True)
    sentence(column, words, icon)
    if look.size:
        size = inbetween_operators.size_in_words(look.size)
        column.label(text=iface_("{size} on disk").format(size=size), icon="DISK_DRIVE", translate=False)
    if look.state.name != "ready":
        if look.estimate:
            size = inbetween_operators.size_in_words(look.estimate)
            column.label(text=iface_("About {size} when built").format(size=size), icon="BLANK1", translate=False)
        elif look.estimate is None:
            soon(inbetween_operators.redraw_panels, inbetween_operators.TICK)
