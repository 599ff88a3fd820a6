"""Operators that key a region or the camera by the footage: as what is seen moves, or as a movie clip's tracks do; and
those that make layers of regions, a panning shot, or a tripod."""

import math
import time

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty, IntProperty
from bpy.types import Context, Operator, PropertyGroup, Scene, Strip

from ...core.model.choices import CONTEXT
from ..data import selection, validation
from ..editing import bar_edits, follow_track, shutter_edits, track_region
from ..rendering.effect_source import FAULTS
from . import needs
from .operator_bases import Beside, OfEffect, operator, redraw, report_warning, show_status

# Seconds of work from one look at the window to the next, at least and at most, and between two looks at its thread.
_TICK, _MOST, _PATIENCE = 0.05, 0.1, 0.02

DIRECTIONS = (
    ("BACKWARD", "Backward", "Towards the strip's first frame", "TRACKING_BACKWARDS", 0),
    ("BOTH", "Both", "Towards both ends of the strip", "ARROW_LEFTRIGHT", 1),
    ("FORWARD", "Forward", "Towards the strip's last frame", "TRACKING_FORWARDS", 2),
)


# Blender would use again what a button was pressed with before.
_DIRECTION = EnumProperty(
    name="Direction",
    description="Where tracking goes from the current frame",
    items=DIRECTIONS,
    default="BOTH",
    options={"SKIP_SAVE"},
    translation_context=CONTEXT,
)


class _Tracks(Beside):
    """Tracks the active region, or the camera, from the current frame in a `direction` of DIRECTIONS."""

    bl_options = {"UNDO"}
    only_seen = True
    tick = _TICK
    blocks = True
    is_camera = False

    def is_ready(self, scene: Scene, effect: PropertyGroup, strip: Strip) -> bool:
        """Whether nothing has to be tracked. EffectError: what comes after tracking cannot be done."""
        return False

    def ended(self, context: Context) -> None:
        """Called once all is tracked, and not after Esc. EffectError: what comes after tracking cannot be done."""

    def begin(self, context: Context, waits: bool) -> set[str] | None:
        """Tracks for a while, and then whenever Blender has time."""
        scene, effect, strip = selection.active(context)
        index = None if self.is_camera else effect.active_region
        moving = selection.moving(effect, index)
        self._target, self._start = track_region.Target.of(effect, index), scene.frame_current
        self._done: set[int] = set()
        if self.is_ready(scene, effect, strip):
            return self._finish(context)
        self._frames = track_region.frames_to_track(scene, strip, self.direction, moving.track_until)
        motion, all_keys = validation.word(moving, "motion"), moving.track_all_keys
        self._frame = self._start
        patience = None if waits else _PATIENCE
        self._steps = track_region.track(
            scene, effect, strip, index, self._frames, motion, all_keys=all_keys, patience=patience
        )
        if not self._track(math.inf if waits else _TICK):
            return self._finish(context)
        context.window_manager.progress_begin(0, len(self._frames))
        self._show(context)
        return self.go_on(context)

    def goes_on(self, context: Context) -> bool:
        if self._target.effect() is None:  # undone or removed in another window, or another file was loaded
            return False
        # What it takes to draw a frame, tracking takes as well, unless Esc would have to wait.
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
        return None  # what was tracked can be undone

    def leave(self, context: Context) -> None:
        self._steps.close()
        context.window_manager.progress_end()
        super().leave(context)

    def _track(self, seconds: float) -> bool:
        """Tracks for a while; whether there is more to track. One of FAULTS: there is nothing to track at all."""
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
            report_warning(self, str(error))
        return False

    def _go_to(self, frame: int) -> None:
        if (effect := self._target.effect()) is not None:
            effect.id_data.frame_set(frame)

    def _show(self, context: Context) -> None:
        self._go_to(self._frame)
        done, total = len(self._done), len(self._frames) - 1
        context.window_manager.progress_update(done)
        sentence = rpt_("Tracking: {done} of {total} frames, Esc to stop")
        show_status(sentence.format(done=done, total=total))
        redraw(context)
        self._shown = time.perf_counter()

    def _tell(self) -> None:
        if (effect := self._target.effect()) is None or not self._done:
            return
        sentence = rpt_("Frames {first} to {last} are tracked")
        first, last = min(self._done | {self._start}), max(self._done | {self._start})
        self.report({"INFO"}, sentence.format(first=first, last=last))
        lost = track_region.lost(effect, self._target.index)
        if lost and lost[0] in self._frames:
            report_warning(self, lost[1])
            return
        for frame, fault, is_fault in track_region.stops(effect, self._target.index):
            if frame in self._frames:
                sentence = rpt_("Tracking stopped at frame {frame}: {fault}")
                words = sentence.format(frame=frame, fault=fault)
                if is_fault:
                    report_warning(self, words)
                else:
                    self.report({"INFO"}, words)


class SHUTTER_OT_track(_Tracks, OfEffect, Operator):
    """Key the active region by what it covers here, up to your own keys (Esc stops and keeps the tracked frames)"""

    bl_label = "Track Region"
    needs = (needs.strokes,)

    direction: _DIRECTION


class SHUTTER_OT_track_camera(_Tracks, OfEffect, Operator):
    """Key the camera by what the regions leave free, up to your own keys (Esc stops and keeps the tracked frames)"""

    bl_label = "Track Camera"
    is_camera = True

    direction: _DIRECTION


class SHUTTER_OT_panning_shot(_Tracks, OfEffect, Operator):
    """Keep the active region sharp while all else streaks past it (tracks the region unless it has keys)"""

    bl_label = "Panning Shot"
    needs = (needs.strokes,)
    direction = "BOTH"

    def is_ready(self, scene: Scene, effect: PropertyGroup, strip: Strip) -> bool:
        return shutter_edits.can_pan(scene, effect, strip, effect.active_region)

    def ended(self, context: Context) -> None:
        shutter_edits.panning_shot(self._target.effect(), self._target.index, bar_edits.auto_key(context))


class SHUTTER_OT_tripod(_Tracks, OfEffect, Operator):
    """Expose for long as if the camera had stood still (tracks the camera unless it has keys)"""

    bl_label = "Stabilize Exposure"
    needs = (needs.a_shutter,)
    is_camera = True
    direction = "BOTH"

    def is_ready(self, _edit: Scene, effect: PropertyGroup, _strip: Strip) -> bool:
        return shutter_edits.can_stand(effect)

    def ended(self, context: Context) -> None:
        shutter_edits.tripod(self._target.effect(), bar_edits.auto_key(context))


_FRAME = IntProperty(
    name="Frame",
    description="Timeline frame; without one, the worst of the next that are unsure",
    options={"SKIP_SAVE"},
)


def _look(looking: Operator, effect: PropertyGroup, index: int | None) -> set[str] | None:
    """Goes to a frame at which tracking of what has an `index` (selection.moving) is not sure."""
    frame: int | None = looking.frame
    if not looking.properties.is_property_set("frame"):
        frame = track_region.next_unsure(effect, index, looking.edit.frame_current)
    if frame is None:
        looking.report({"INFO"}, "No other stretch of unsure frames lies ahead")
        return {"CANCELLED"}
    looking.edit.frame_set(frame)
    return None


@operator("Next Unsure Frame", needs.a_region, options={"REGISTER"}, frame=_FRAME)
def track_look(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Go to a frame that tracking is not sure of"""
    return _look(self, effect, effect.active_region)


@operator("Next Unsure Camera Frame", options={"REGISTER"}, frame=_FRAME)
def track_camera_look(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Go to a frame that tracking of the camera is not sure of"""
    return _look(self, effect, None)


def _why_no_clip(effect: PropertyGroup) -> str | None:
    return None if selection.active_region(effect).follow_clip is not None else rpt_("Choose a clip first")


@operator("Follow Track", needs.strokes, _why_no_clip)
def follow(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Key the active region by a track of a movie clip, from where the region is at this frame"""
    follow_track.follow(self.edit, effect, self.effect_strip, effect.active_region)


def _why_no_track(effect: PropertyGroup) -> str | None:
    return None if selection.active_region(effect).follow_stamp else rpt_("The region does not follow a track")


@operator("Update Followed Track", needs.strokes, _why_no_track)
def follow_update(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Key the active region anew by what it follows, after the track has changed"""
    follow_track.update(self.edit, effect, self.effect_strip, effect.active_region)


def _why_no_camera_clip(effect: PropertyGroup) -> str | None:
    return None if effect.camera.follow_clip is not None else rpt_("Choose a clip first")


@operator("Follow Stabilization", _why_no_camera_clip)
def follow_stabilization(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Key the camera by the 2D stabilization of a movie clip, from where the camera is at this frame"""
    follow_track.follow_stabilization(self.edit, effect, self.effect_strip)


@operator("Sharp Subject", needs.a_region)
def sharp_subject(_self: Operator, context: Context, effect: PropertyGroup) -> None:
    """Keep the active region sharp before all else, which is exposed for long and without it"""
    shutter_edits.sharp_subject(effect, effect.active_region, bar_edits.auto_key(context))


@operator("Trail", needs.a_region)
def clean_trail(_self: Operator, context: Context, effect: PropertyGroup) -> None:
    """Have the active region leave a trail before all else, which stays sharp"""
    shutter_edits.clean_trail(effect, effect.active_region, bar_edits.auto_key(context))
