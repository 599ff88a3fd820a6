"""Operators and panels that track a region or the camera, and that use tracked motion for layers and exposures."""

import math
import time

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty, IntProperty
from bpy.types import Context, Operator, PropertyGroup, Scene, Strip, UILayout

from .... import features
from ....blender.data import selection
from ....blender.editing import bar_edits, motion_keys
from ....blender.interface import needs
from ....blender.interface.operator_bases import Beside, OfEffect, given, operator, redraw, report, show_status
from ....blender.interface.panel_parts import draw_operators, draw_properties, panel, sentence
from ....blender.rendering.effect_source import FAULTS
from ....core.model.choices import CONTEXT
from ..tracking import SURE
from . import follow_track, track_region

# Seconds: work between two redraws, at least and at most; waiting for the tracking thread.
_TICK, _MOST, _PATIENCE = 0.05, 0.1, 0.02

DIRECTIONS = (
    ("BACKWARD", "Backward", "Towards the strip's first frame", "TRACKING_BACKWARDS", 0),
    ("BOTH", "Both", "Towards both ends of the strip", "ARROW_LEFTRIGHT", 1),
    ("FORWARD", "Forward", "Towards the strip's last frame", "TRACKING_FORWARDS", 2),
)


_DIRECTION = given(
    EnumProperty,
    "Direction",
    "Direction of tracking from the current frame",
    items=DIRECTIONS,
    default="BOTH",
    translation_context=CONTEXT,
)


class _Tracks(Beside):
    """A base of operators that track the active region or the camera from the current frame, step by step.

    Subclasses also have the attribute `direction`, an item of DIRECTIONS: whether to track backward, forward or both
    ways.

    Attributes:
        is_camera: Whether the camera is tracked instead of the active region.
        once: Whether tracking is skipped if the region or the camera is tracked already. `ended` is called all the
            same.
    """

    bl_options = {"UNDO"}
    only_seen = True
    tick = _TICK
    blocks = True
    is_camera = False
    once = False  # not again what is tracked already

    def ended(self, context: Context) -> None:
        """Do what a subclass does after tracking; here nothing. Not called after Esc.

        Raises:
            EffectError: It cannot be done.
        """

    def begin(self, context: Context, waits: bool) -> set[str] | None:
        """Begin to track: for a moment, after which `goes_on` is called, or to the end if `waits`."""
        scene, effect, strip = selection.active(context)
        index = None if self.is_camera else effect.active_region
        moving = selection.moving(effect, index)
        self._target, self._start = selection.Target.of(effect, index), scene.frame_current
        self._frame, self._done = self._start, set[int]()
        if self.once and track_region.is_tracked(scene, effect, strip, index):
            return self._finish(context)
        self._frames = track_region.frames_to_track(scene, strip, self.direction, moving.track_until)
        patience = None if waits else _PATIENCE
        self._steps = track_region.track(scene, effect, strip, index, self._frames, patience)
        if not self._track(math.inf if waits else _TICK):
            return self._finish(context)
        self._show(context)
        return self.go_on(context)

    def goes_on(self, context: Context) -> bool:
        if self._target.effect() is None:  # undone, removed in another window, or another file was loaded
            return False
        # Track for as long as drawing a frame takes, but not so long that Esc has to wait.
        goes_on = self._track(min(max(_TICK, time.perf_counter() - self._shown), _MOST))
        self._show(context)
        return goes_on

    def end(self, context: Context, is_stopped: bool) -> set[str] | None:
        if self._target.effect() is None:
            return {"CANCELLED"}
        if self.direction == "BOTH":
            self._go_to(self._start)
        return self._finish(context, is_stopped)

    def _finish(self, context: Context, is_stopped: bool = False) -> set[str] | None:
        self._tell()
        has_ended = not is_stopped and self._target.effect() is not None
        if has_ended and self.tried(self.ended, context) == {"CANCELLED"} and not self._done:
            return {"CANCELLED"}
        redraw(context)
        return None  # so that tracked frames can be undone

    def leave(self, context: Context) -> None:
        self._steps.close()
        super().leave(context)

    def _track(self, seconds: float) -> bool:
        """Track for some seconds, and return whether frames are left to track.

        Args:
            seconds: How long; math.inf: to the end.

        Raises:
            FAULTS: Tracking fails before any frame is tracked. Later errors are reported to the user, and tracking
                ends.
        """
        end = time.perf_counter() + seconds
        try:
            for frame in self._steps:
                if frame is not None:
                    self._frame = frame
                    self._done.add(frame)
                if time.perf_counter() >= end:
                    return True
        except FAULTS as error:
            if not self._done:
                raise
            report(self, str(error))
        return False

    def _go_to(self, frame: int) -> None:
        if (effect := self._target.effect()) is not None:
            effect.id_data.frame_set(frame)

    def _show(self, context: Context) -> None:
        self._go_to(self._frame)
        done, total = len(self._done), len(self._frames) - 1
        show_status(rpt_("Tracking: {done} of {total} frames, Esc to stop").format(done=done, total=total))
        redraw(context)
        self._shown = time.perf_counter()

    def _tell(self) -> None:
        if (effect := self._target.effect()) is None or not self._done:
            return
        words = rpt_("Tracked frames {first} to {last}")
        first, last = min(self._done | {self._start}), max(self._done | {self._start})
        self.report({"INFO"}, words.format(first=first, last=last))
        lost = track_region.lost(effect, self._target.index)
        if lost and lost[0] in self._frames:
            report(self, lost[1])
            return
        for frame, fault, is_fault in track_region.stops(effect, self._target.index):
            if frame in self._frames:
                words = rpt_("Tracking stopped at frame {frame}: {fault}").format(frame=frame, fault=fault)
                if is_fault:
                    report(self, words)
                else:
                    self.report({"INFO"}, words)


class SHUTTER_OT_track(_Tracks, OfEffect, Operator):
    """Track what the active region covers here, up to your own keyframes (Esc stops and keeps the tracked frames)"""

    bl_label = "Track Region"
    choices = "direction"
    needs = (needs.strokes,)

    direction: _DIRECTION


class SHUTTER_OT_track_camera(_Tracks, OfEffect, Operator):
    """Track the camera outside the regions, up to your own keyframes (Esc stops and keeps the tracked frames)"""

    bl_label = "Track Camera"
    choices = "direction"
    is_camera = True

    direction: _DIRECTION


class SHUTTER_OT_panning_shot(_Tracks, OfEffect, Operator):
    """Keep the active region sharp while all else streaks past it (tracks the region unless it has keyframes)"""

    bl_label = "Panning Shot"
    needs = (needs.strokes,)
    direction = "BOTH"
    once = True

    def ended(self, context: Context) -> None:
        track_region.panning_shot(self._target.effect(), self._target.index, bar_edits.auto_key(context))


class SHUTTER_OT_tripod(_Tracks, OfEffect, Operator):
    """Make a long exposure as if the camera stood still (tracks the camera unless it has keyframes)"""

    bl_label = "Stabilize Exposure"
    needs = (needs.a_shutter,)
    icon = "CON_CAMERASOLVER"
    is_camera = True
    direction = "BOTH"
    once = True

    def ended(self, context: Context) -> None:
        track_region.tripod(self._target.effect(), bar_edits.auto_key(context))


_FRAME = given(IntProperty, "Frame", "Timeline frame; without one, the least confident of the next unsure frames")


def _look(looking: Operator, effect: PropertyGroup, index: int | None) -> set[str] | None:
    """Go to the timeline frame that the operator's property `frame` gives or, if that is not set, to an unsure frame.

    That is the least sure frame of the next stretch of frames where tracking is unsure; for a subject, the frame of the
    whole strip that most needs a drawing.

    Args:
        looking: The operator, with the property `frame`.
        index: Index of the region; None: the camera.

    Returns:
        {"CANCELLED"} if no unsure frame is left, which the user is told; else None.
    """
    frame: int | None = looking.frame
    is_given = looking.properties.is_property_set("frame")
    if index is not None and effect.regions[index].kind == "SUBJECT" and not is_given:
        frame = features.needed("next_needed")(looking.edit, effect, looking.effect_strip, index)[0]
    elif not is_given:
        frame = track_region.next_unsure(effect, index, looking.edit.frame_current)
    if frame is None:
        looking.report({"INFO"}, "No other stretch of unsure frames lies ahead")
        return {"CANCELLED"}
    looking.edit.frame_set(frame)
    return None


@operator("Next Unsure Frame", needs.a_region, options={"REGISTER"}, frame=_FRAME)
def track_look(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Go to the next frames with low tracking confidence"""
    return _look(self, effect, effect.active_region)


@operator("Next Unsure Camera Frame", options={"REGISTER"}, frame=_FRAME)
def track_camera_look(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Go to the next frames with low tracking confidence of the camera"""
    return _look(self, effect, None)


def _why_no_clip(effect: PropertyGroup) -> str | None:
    has_clip = selection.active_region(effect).follow_clip is not None
    return None if has_clip else rpt_("Choose a clip first")


@operator("Follow Track", needs.strokes, _why_no_clip, icon="TRACKER")
def follow(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Key the active region by a track of a movie clip, from its place at this frame"""
    follow_track.follow(self.edit, effect, self.effect_strip, effect.active_region)


_SETTINGS = "motion", "track_until", "track_all_keys", "track_ends"  # of tracking, in panels


def draw_tracking(layout: UILayout, index: int | None, is_subject: bool = False) -> None:
    """Draw a row of buttons: those that track a region or the camera, and one that goes to the next unsure frame.

    Args:
        index: Index of the region; None: the camera.
        is_subject: Whether the region is a subject. The last button then finds the frame that most needs a drawing.
    """
    row = layout.row(align=True)
    track = "shutter.track_camera" if index is None else "shutter.track"
    for direction, _name, _description, icon, _number in DIRECTIONS:
        button = row.operator(
            track, text=("Track Camera" if index is None else "Track") if direction == "BOTH" else "", icon=icon
        )
        button.direction = direction
    row.operator("shutter.outline_needed" if is_subject else f"{track}_look", text="", icon="VIEWZOOM")


def tracking_icon(effect: PropertyGroup, index: int | None) -> str | None:
    """Return the icon for what `draw_tracked` says of a region: "ERROR", "INFO" or None. Index None: the camera."""
    faults = track_region.faults(effect, index)
    if any(is_fault for _, _, is_fault in faults):
        return "ERROR"
    is_tracked = track_region.confidence_at(effect, index, effect.id_data.frame_current) is not None
    return "INFO" if is_tracked or faults else None


def draw_tracked(layout: UILayout, effect: PropertyGroup, index: int | None) -> None:
    """Draw how sure tracking is at the current frame, and buttons for where it stopped or lost the subject.

    Args:
        index: Index of the region; None: the camera.
    """
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
    draw_properties(layout, selection.active_region(effect), *_SETTINGS)


def _draw_follow(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    region = selection.active_region(effect)
    draw_properties(layout, region, "follow_clip", "follow_kind")
    if region.follow_clip is not None:
        layout.prop_search(region, "follow_object", region.follow_clip.tracking, "objects")
        holder = follow_track.holder_of(region)
        if region.follow_kind != "OBJECT" and holder is not None:
            kind = "plane_tracks" if region.follow_kind == "PLANE" else "tracks"
            layout.prop_search(region, "follow_track", holder, kind)
    draw_operators(layout, "follow")


def _draw_camera(layout: UILayout, _scene: Scene, effect: PropertyGroup, _strip: Strip) -> None:
    """Draw the camera's transform and tracking settings. The track buttons are in the panel *Exposure Moves With*."""
    draw_properties(layout.column(align=True), effect.camera, *motion_keys.CHANNELS)
    draw_properties(layout, effect.camera, "influence", *_SETTINGS)


classes = (
    panel("_track", "Track", _draw_track, _has_strokes, "_regions", bl_translation_context=CONTEXT),
    panel("_follow", "Follow Track", _draw_follow, selection.active_region, "_regions"),
    panel("_camera", "Camera", _draw_camera, _has_camera),
)
