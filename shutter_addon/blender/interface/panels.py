"""Panels, lists and menus of the Shutter tab in the sequencer's sidebar."""

from collections.abc import Iterator

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, Panel, PropertyGroup, Scene, Strip, UILayout, UIList

from ... import features
from ...core.messages import EffectError
from ...core.model import shutters
from ...core.model.choices import CONTEXT
from ...core.model.effect import Shutter
from ...core.model.fields import fields_of
from ..data import annotations, consistency, data_format, selection, strips, validation
from ..editing import bar_edits, match_source, motion_keys
from .panel_parts import WIDEST, draw_list, draw_operators, draw_properties, menu, panel, pattern_icon, sentence


class SHUTTER_UL_shutters(UIList):
    def draw_item(self, _context, layout, effect, shutter, _icon, _active, _property, index):
        row = layout.row(align=True)
        color = row.row(align=True)
        color.ui_units_x = 1.0
        color.prop(shutter, "color", text="")
        row.label(text="", icon_value=pattern_icon(index))
        row.prop(shutter, "name", text="", emboss=False)
        if index == 0:
            hint = row.row()
            hint.active = False
            hint.label(text="default")


_ICONS = {
    "LINE": "IPO_LINEAR",
    "LASSO": "MESH_CIRCLE",
    "OUTLINE": "CURVE_BEZCIRCLE",
    "MATTE": "MOD_MASK",
    "RAMP": "IPO_EASE_IN_OUT",
    "SUBJECT": "OUTLINER_OB_ARMATURE",
}
_BUTTONS = {  # operators of each kind with drawings
    "LINE": ("subject_find", "outline_it"),
    "OUTLINE": ("outline_it", "outline_needed"),
    "SUBJECT": ("subject_outline", "subject_scribble"),
}
_OF_KIND = {"LINE": "width", "OUTLINE": "between", "RAMP": "ramp"}  # the property that only this kind has


class SHUTTER_UL_regions(UIList):
    def draw_item(self, _context, layout, effect, region, _icon, _active, _property, _index):
        row = layout.row(align=True)
        row.label(text="", icon=_ICONS.get(region.kind, "ERROR"))
        row.prop(region, "name", text="", emboss=False)
        switch = row.row(align=True)
        switch.active = region.is_layer
        switch.prop(region, "is_layer", text="", icon="RENDERLAYERS", emboss=False)
        if region.kind in strips.MATTES:
            return
        layer = annotations.layer_of(effect, region)
        if layer is None or not any(drawing.strokes for drawing in layer.frames):
            row.label(text="", icon="ERROR")
        if layer is not None:
            row.prop(layer, "annotation_hide", text="", emboss=False)

    def filter_items(self, _context: Context, effect: PropertyGroup, _property: str) -> tuple[list[int], list[int]]:
        """Tell Blender to show only the regions that use the active shutter."""
        own = set(selection.own_regions(effect))
        return [self.bitflag_filter_item if i in own else 0 for i in range(len(effect.regions))], []


@menu("presets", "Presets")
def preset_menu(layout: UILayout, _context: Context) -> None:
    layout.operator_enum("shutter.preset", "preset")


@menu("regions", "Region Specials")
def region_menu(layout: UILayout, _context: Context) -> None:
    features.call("draw_new", layout)
    draw_operators(layout, "", "matte_add", "matte_strip", "matte_mask", "outline_from_mask", "ramp_add")
    draw_operators(layout, "", "time_map", "rolling_shutter", "find_readout")


@menu("shutters", "Shutter Specials")
def shutter_menu(layout: UILayout, _context: Context) -> None:
    layout.menu("SHUTTER_MT_presets", icon="PRESET")
    draw_operators(layout, "", "shutter_duplicate", "shutter_move")
    draw_operators(layout, "", "effect_copy", "effect_paste", "recipe_import", "recipe_export")


class SEQUENCER_PT_shutter(Panel):
    """The first panel of the Shutter tab: live preview, source, shutters, and buttons to draw and track.

    It fits into Blender's default layout without scrolling.
    """

    bl_label = "Shutter"
    bl_space_type = "SEQUENCE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Shutter"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return selection.active_strip(context) is not None or selection.active(context) is not None

    def draw(self, context: Context) -> None:
        layout = self.layout
        active = selection.active(context)
        if active is None:
            draw_operators(layout, "draw", "add_effect")
            return
        effect = active[1]
        _draw_live(layout, context)
        shown = match_source.shown(effect)
        words = iface_("Source: {strip}").format(strip=shown.source) if shown else iface_("Choose Source")
        layout.operator_menu_enum("shutter.source", "strip", text=words, icon="SEQUENCE", translate=False)
        draw_list(layout, effect, "shutter", len(effect.shutters))
        row = layout.row(align=True)
        draw_operators(row, "draw")
        region = selection.active_region(effect)
        if is_subject := region is not None and region.kind == "SUBJECT":
            row.operator("shutter.draw", text="Not This", icon="X").not_this = True
        draw_operators(row, "erase")
        row.menu("SHUTTER_MT_regions", text="", icon="DOWNARROW_HLT")
        features.call("draw_tracking", layout, effect.active_region, is_subject)
        draw_operators(layout.row(align=True), "sharp_subject", "panning_shot", "clean_trail")


def _draw_header(self: Panel, context: Context) -> None:
    shutter = selection.active_shutter(selection.active(context)[1])
    self.layout.label(text=iface_('Exposure of "{shutter}"').format(shutter=shutter.name), translate=False)


def _draw_exposure(layout: UILayout, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    """Draw the settings of how the active shutter exposes frames: preset, window, length and so on."""
    shutter = selection.active_shutter(effect)
    row = layout.row(align=True)
    preset = consistency.preset_of(effect, effect.active_shutter)
    label = iface_(shutters.PRESETS[preset][0], CONTEXT) if preset else None
    row.menu("SHUTTER_MT_presets", text=label, icon="PRESET", translate=False)
    row.operator("shutter.bars_key", text="", icon="KEY_HLT")
    row.operator("shutter.bars_unkey", text="", icon="KEY_DEHLT")
    layout.prop(effect, "window")
    features.call("draw_smooth", layout, effect)
    layout.prop(shutter, "length")
    if shutter.length == "MOTION" and shutter.follow != "NOTHING":
        layout.prop(shutter, "trail")
    layout.prop(shutter, "combine")
    if shutter.combine in ("LIGHTEST", "DARKEST"):
        draw_properties(layout, shutter, "by_luminance", "use_threshold")
        if shutter.use_threshold:
            draw_properties(layout, shutter, "threshold", "softness")
    draw_properties(layout, shutter, *(field.blender for field in fields_of(Shutter).values() if field.shown))
    draw_operators(layout, "tripod")
    _draw_bars(layout, scene, effect, strip)


def _draw_bars(layout: UILayout, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    """Draw a sentence about the active shutter's bars, such as their angle, or what is wrong with them."""
    try:
        bars, _states = bar_edits.shown(effect, effect.active_shutter)
    except EffectError as error:
        sentence(layout, str(error), "ERROR")
        return
    is_open = bool(bars.any())
    words = bar_edits.current_summary(scene, effect, strip, bars)
    sentence(layout, words, "NONE" if is_open else "ERROR", is_quiet=is_open)


def _draw_live(layout: UILayout, context: Context) -> None:
    live = context.window_manager.virtual_shutter
    row = layout.row(align=True)
    row.prop(live, "live", toggle=True, icon="HIDE_OFF" if live.live else "HIDE_ON")
    view = row.row(align=True)
    view.active = live.live
    view.prop(live, "view", text="")
    view.prop(live, "probe", text="", icon="EYEDROPPER")
    row.operator("shutter.full_quality", text="", icon="VIEW_ZOOM")
    notes = row.row(align=True)
    effect = selection.active(context)[1]
    found = {icon(effect, index) for icon in features.each("tracking_icon") for index in _tracked(effect)}
    found |= {"INFO" for _note in _notes(context)}
    notes.enabled = bool(found - {None})
    notes.alert = "ERROR" in found
    notes.popover("SHUTTER_PT_notes", text="", icon="ERROR" if notes.alert else "INFO")


def _notes(context: Context) -> Iterator[tuple[str, str]]:
    """Yield notes about the active effect, such as differences from its source.

    Yields:
        The sentence, and the bl_idname of an operator that solves the problem, or "".
    """
    scene, effect, strip = selection.active(context)
    if (newer := data_format.note([scene, *bpy.data.scenes])) is not None:
        yield newer, ""
    if selection.in_picture(context) is None:
        yield selection.why_unseen(scene, strip), ""
    if (shown := match_source.shown(effect)) is not None:
        if shown.differences:
            what = ", ".join(iface_(word) for word in shown.differences)
            yield iface_("Differs from its source: {what}").format(what=what), "shutter.match_source"
        if shown.lacks_modifiers:
            yield iface_("The effect does not use the modifiers of the source"), ""
        if shown.has_effects:
            words = iface_("The effect does not use effect strips of the source: make the Shutter strip their input")
            yield words, ""
    for notes in features.each("notes"):
        yield from notes(effect)


def _tracked(effect: PropertyGroup) -> list[int | None]:
    """List what may be tracked: the active region's index; None for the camera, if the active shutter follows it."""
    region = [effect.active_region] if selection.active_region(effect) is not None else []
    shutter = selection.active_shutter(effect)
    return region + ([None] if shutter is not None and shutter.follow == "CAMERA" else [])


class SHUTTER_PT_notes(Panel):
    """Notes about the effect and its tracking. It is a popover, so that no button moves when notes come and go."""

    bl_label = "Notes"
    bl_space_type = "TOPBAR"
    bl_region_type = "HEADER"
    bl_ui_units_x = WIDEST // 20

    @classmethod
    def poll(cls, context: Context) -> bool:
        return selection.active(context) is not None

    def draw(self, context: Context) -> None:
        layout, effect = self.layout, selection.active(context)[1]
        for words, operator in _notes(context):
            column = layout.column(align=True)
            sentence(column, words, "INFO")
            if operator:
                column.operator(operator)
        for index in _tracked(effect):
            features.call("draw_tracked", layout, effect, index)


def _draw_regions(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    layout.use_property_split = False
    draw_list(layout, effect, "region", len(selection.own_regions(effect)))
    region = selection.active_region(effect)
    if region is not None:
        row = layout.row(align=True)
        row.operator_menu_enum("shutter.region_assign", "shutter", text=region.shutter, translate=False)
        row.prop(region, "kind", text="")
        if region.kind in _OF_KIND:
            row.prop(region, _OF_KIND[region.kind], text=None if region.kind == "LINE" else "")
    layout.use_property_split = True
    if region is None or region.kind not in strips.LAID:
        layout.prop(effect, "edge_aware")
    if region is None:
        return
    if region.kind == "MATTE":
        _draw_matte(layout, region)
    if region.kind not in strips.LAID:
        layout.prop(region, "opacity")
    if region.kind not in strips.MATTES:
        row = layout.row(align=True)
        draw_operators(row, *_BUTTONS.get(region.kind, _BUTTONS["LINE"]))
        row.menu("SHUTTER_MT_of_outline", text="", icon="DOWNARROW_HLT")
    if region.kind in strips.LAID:
        draw_properties(layout, region, "opacity", "feather", "invert")
        if not region.is_layer:  # a layer covers all mattes below
            layout.prop(region, "blend")
        draw_operators(layout, "matte_export")
    try:
        validation.check_moving(region)
    except EffectError as error:
        sentence(layout, str(error), "ERROR")


def _draw_matte(layout: UILayout, region: PropertyGroup) -> None:
    """Draw the settings of a region's matte: where it comes from (strip, image and so on) and how it is read."""
    layout.prop(region, "matte")
    if region.matte == "IMAGE":
        layout.template_ID(region, "image", open="image.open")
        if region.image is not None:
            layout.prop(region.image, "source")
        draw_properties(layout, region, "timing", "offset")
    elif region.matte == "STRIP":
        layout.prop_search(region, "strip_name", region.id_data.sequence_editor, "strips_all", text="Strip")
    else:
        layout.prop(region, "mask")
    if region.matte != "MASK":
        layout.prop(region, "channel")
        if region.channel == "NAMED":
            layout.prop(region, "channel_name", text="Name")


def _draw_transform(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    draw_properties(layout.column(align=True), selection.active_region(effect), *motion_keys.CHANNELS)
    layout.operator("shutter.region_key", text="Insert Keyframes", icon="KEY_HLT")


def _draw_move(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    shutter = selection.active_shutter(effect)
    layout.prop(shutter, "follow")
    if shutter.follow == "REGION":
        layout.prop_search(shutter, "follow_region", effect, "regions", text="Region")
    if shutter.follow != "NOTHING":
        draw_properties(layout, shutter, "follow_motion", "follow_smooth")
    if shutter.follow == "CAMERA":
        features.call("draw_tracking", layout, None)


def _draw_options(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
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
        sentence(column, iface_("Smooth is off: the nearest source frame is used"), "INFO")


classes = (
    SEQUENCER_PT_shutter,
    panel("_regions", "Regions", _draw_regions, bl_options=set()),
    panel("_transform", "Transform", _draw_transform, selection.active_region, "_regions"),
    panel("_exposure", "", _draw_exposure, selection.active_shutter, bl_options=set(), draw_header=_draw_header),
    panel("_move", "Exposure Moves With", _draw_move, selection.active_shutter, "_exposure"),
    panel("_options", "Options", _draw_options, bl_order=1),
)
