"""Panels of the active region and of the camera: mattes, transform and tracking."""

from bpy.types import PropertyGroup, Scene, Strip, UILayout

from ...core.messages import EffectError
from ..data import selection, strips, validation
from .panel_parts import draw_list, draw_operators, draw_properties, sentence

_PLACEMENT = "location", "rotation", "scale"
_BUTTONS = {  # operators of each kind with drawings
    "LINE": ("subject_find", "outline_it"),
    "OUTLINE": ("outline_it", "outline_needed"),
    "SUBJECT": ("subject_outline", "subject_scribble"),
}
_OF_KIND = {"LINE": "width", "OUTLINE": "between", "RAMP": "ramp"}  # the property that only this kind has


def draw_regions(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    layout.use_property_split = False
    shutter = selection.active_shutter(effect)
    own = [region for region in effect.regions if shutter and region.shutter == shutter.name]
    draw_list(layout, effect, "region", own)
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
        _draw_blend(layout, region)
    try:
        validation.check_moving(region)
    except EffectError as error:
        sentence(layout, str(error), "ERROR")


def _draw_matte(layout: UILayout, region: PropertyGroup) -> None:
    """Draw the matte's source and settings."""
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


def _draw_blend(layout: UILayout, region: PropertyGroup) -> None:
    """Draw how a matte, ramp or outline blends with the mattes below."""
    for name in ("opacity", "feather", "invert", "blend"):
        row = layout.row()
        row.active = name != "blend" or not region.is_layer  # a layer covers all of them
        row.prop(region, name)
    draw_operators(layout, "matte_export")


def draw_transform(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    draw_properties(layout.column(align=True), selection.active_region(effect), *_PLACEMENT)
    layout.operator("shutter.region_key", text="Insert Keyframes", icon="KEY_HLT")
