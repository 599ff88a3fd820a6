"""Panels of the active region and of the camera: mattes, transform and tracking."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.types import MovieTracking, PropertyGroup, Scene, Strip, UILayout

from ...core.messages import EffectError
from ...media.part_tracking import SURE
from ..data import selection, strips, validation
from ..editing import track_region
from . import needs, track_operators
from .panel_parts import draw_list, draw_operators, draw_properties, sentence

_PLACEMENT = "location", "rotation", "scale"
_TRACKING = "motion", "track_until", "track_all_keys", "track_ends"
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


def draw_tracking(layout: UILayout, index: int | None, is_subject: bool = False) -> None:
    """Draw the buttons that track a region or the camera (selection.moving)."""
    row = layout.row(align=True)
    track = "shutter.track_camera" if index is None else "shutter.track"
    for direction, _name, _description, icon, _number in track_operators.DIRECTIONS:
        button = row.operator(
            track, text=("Track Camera" if index is None else "Track") if direction == "BOTH" else "", icon=icon
        )
        button.direction = direction
    row.operator("shutter.outline_needed" if is_subject else f"{track}_look", text="", icon="VIEWZOOM")


def tracking_icon(effect: PropertyGroup, index: int | None) -> str | None:
    """Return the icon of what `draw_tracked` draws; None: it draws nothing."""
    faults = track_region.faults(effect, index)
    if any(is_fault for _, _, is_fault in faults):
        return "ERROR"
    is_tracked = track_region.confidence_at(effect, index, effect.id_data.frame_current) is not None
    return "INFO" if is_tracked or faults else None


def draw_tracked(layout: UILayout, effect: PropertyGroup, index: int | None) -> None:
    """Draw the tracking confidence at the current frame, and where tracking stopped or lost the subject."""
    look = "shutter.track_camera_look" if index is None else "shutter.track_look"
    confidence = track_region.confidence_at(effect, index, effect.id_data.frame_current)
    if confidence is not None:
        text = iface_("Confidence: {percent} %").format(percent=f"{100 * confidence:.0f}")
        layout.label(text=text, icon="CHECKMARK" if confidence >= SURE else "ERROR", translate=False)
    for frame, reason, is_fault in track_region.faults(effect, index):
        row = layout.row(align=True)
        sentence(row, reason, "ERROR" if is_fault else "INFO", room=0.85)
        place = row.row()
        place.ui_units_x = 2.5
        place.operator(look, text=str(frame), translate=False).frame = frame


def has_strokes(effect: PropertyGroup) -> bool:
    return needs.strokes(effect) is None


def has_camera(effect: PropertyGroup) -> bool:
    return any(shutter.follow == "CAMERA" for shutter in effect.shutters)


def draw_transform(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    draw_properties(layout.column(align=True), selection.active_region(effect), *_PLACEMENT)
    layout.operator("shutter.region_key", text="Insert Keyframes", icon="KEY_HLT")


def draw_track(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    draw_properties(layout, selection.active_region(effect), *_TRACKING)


def draw_follow(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    region = selection.active_region(effect)
    draw_properties(layout, region, "follow_clip", "follow_kind")
    if region.follow_clip is not None:
        _draw_tracks(layout, region, region.follow_clip.tracking)
    draw_operators(layout, "follow")


def _draw_tracks(layout: UILayout, region: PropertyGroup, tracking: MovieTracking) -> None:
    layout.prop_search(region, "follow_object", tracking, "objects")
    objects = tracking.objects
    holder = objects.get(region.follow_object) if region.follow_object else objects[0]
    if region.follow_kind != "OBJECT" and holder is not None:
        kind = "plane_tracks" if region.follow_kind == "PLANE" else "tracks"
        layout.prop_search(region, "follow_track", holder, kind)


def draw_camera(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    """Draw the camera's transform and tracking settings. The track buttons are in the panel *Exposure Moves With*."""
    draw_properties(layout.column(align=True), effect.camera, *_PLACEMENT)
    draw_properties(layout, effect.camera, "influence", *_TRACKING)
