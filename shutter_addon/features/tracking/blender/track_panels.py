"""Panels of tracking: of the active region and of the camera."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.types import MovieTracking, PropertyGroup, Scene, Strip, UILayout

from ....blender.data import selection
from ....blender.interface import needs
from ....blender.interface.panel_parts import draw_operators, draw_properties, panel, sentence
from ....core.model.choices import CONTEXT
from ..part_tracking import SURE
from . import track_operators, track_region

_TRACKING = "motion", "track_until", "track_all_keys", "track_ends"


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


def _has_camera(effect: PropertyGroup) -> bool:
    return any(shutter.follow == "CAMERA" for shutter in effect.shutters)


def _has_strokes(effect: PropertyGroup) -> bool:
    return needs.strokes(effect) is None


def _draw_track(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    draw_properties(layout, selection.active_region(effect), *_TRACKING)


def _draw_follow(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
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


def _draw_camera(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    """Draw the camera's transform and tracking settings. The track buttons are in the panel *Exposure Moves With*."""
    draw_properties(layout.column(align=True), effect.camera, "location", "rotation", "scale")
    draw_properties(layout, effect.camera, "influence", *_TRACKING)


classes = (
    panel("_track", "Track", _draw_track, _has_strokes, "_regions", bl_translation_context=CONTEXT),
    panel("_follow", "Follow Track", _draw_follow, selection.active_region, "_regions"),
    panel("_camera", "Camera", _draw_camera, _has_camera),
)
