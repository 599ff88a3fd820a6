"""Operators and the gizmo of outlines: track, draw by points, correct, find where a drawing is needed, convert."""

from contextlib import closing
from functools import partial
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import IntProperty
from bpy.types import Context, Event, Gizmo, GizmoGroup, Operator, PropertyGroup, Scene, Strip

from ...core.messages import UserError
from ...core.model import outlines
from ...media import outlining
from ..data import preview_areas, selection, strips
from ..editing import outline_drawings, track_region
from ..rendering import outline_carrying
from . import drawing, needs, sharp_frame
from .gizmo_groups import Dragged, View, WithKeys, view
from .operator_bases import UNDOABLE, Beside, OfEffect, operator, redraw, report_warning, show_status
from .preview import show_carried
from .region_gizmo import SHUTTER_GGT_region

_COLOR = (0.2, 0.9, 1.0, 0.9)
_NEAR = 6  # interface units from the pointer to a curve that it can grab
_REACH = 0.08  # fraction of the picture's height: how far a pull reaches along the curve at first
_MORE = 1.25  # factor for each turn of the wheel
_STRIDE = 12  # interface units between points while the pointer is dragged
_CLOSES = 8  # interface units around the first point: a click there closes the curve
_KEYS = {"ESC", "RIGHTMOUSE", "RET", "NUMPAD_ENTER", "BACK_SPACE"}
_ARROWS = {"LEFT_ARROW": (-1, 0), "RIGHT_ARROW": (1, 0), "DOWN_ARROW": (0, -1), "UP_ARROW": (0, 1)}
_STEP, _FINE = 10, 1  # interface units that an arrow key moves the pointer, without and with Shift


class _Carries(Beside, OfEffect):
    """An operator that tracks the active outline through its strip, and then calls `carried`."""

    bl_options = {"REGISTER"}
    only_seen = True
    needs = (needs.an_outline,)

    def carried(self, context: Context) -> set[str] | None:
        """Do the operator's own work after tracking. Errors of FAULTS are reported."""
        return None

    def begin(self, context: Context, waits: bool) -> set[str] | None:
        scene, effect, strip = selection.active(context)
        self._target = track_region.Target.of(effect, effect.active_region)
        if not strips.is_carried(selection.active_region(effect)):
            return self.carried(context)
        file, shown = outline_drawings.carried_frames(scene, effect, strip, effect.active_region)
        with closing(file.open()) as mattes:
            frames = sorted({number for number in shown.values() if not mattes.has(number)})
            if waits:
                for number in frames:
                    mattes.read(number)
        if waits or not frames:
            return self.carried(context)
        self._file = file
        outline_carrying.carry(file, frames, show_carried, shown.get(scene.frame_current))
        return self.go_on(context)

    def goes_on(self, _context: Context) -> bool:
        if self._target.effect() is None or (progress := outline_carrying.progress()) is None:
            return False
        done, total = progress
        show_status(rpt_("Tracking the outline: {done} of {total} frames, Esc to stop").format(done=done, total=total))
        return True

    def end(self, context: Context, is_stopped: bool) -> set[str] | None:
        if is_stopped or self._target.effect() is None:
            outline_carrying.stop()
            show_carried()
            return {"CANCELLED"}
        if (failure := outline_carrying.failure(self._file)) is not None:
            raise UserError(failure)
        return self.carried(context)


class SHUTTER_OT_outline_carry(_Carries, Operator):
    """Track the active outline through its strip now (Esc stops and keeps the tracked frames)"""

    bl_label = "Track Outline"


class SHUTTER_OT_outline_needed(_Carries, Operator):
    """Go to the frame that needs a drawing most, after tracking the outline"""

    bl_label = "Next Drawing Needed"

    def carried(self, context: Context) -> set[str] | None:
        scene, effect, strip = selection.active(context)
        frame, confidence = outline_drawings.next_needed(scene, effect, strip, self._target.index)
        if frame is None:
            sentence = rpt_("The confidence is {share:.0f} % or more at all frames")
            self.report({"INFO"}, sentence.format(share=100 * confidence))
            return {"CANCELLED"}
        scene.frame_set(frame)
        sentence = rpt_("Frame {frame}: the confidence is {share:.0f} %")
        self.report({"INFO"}, sentence.format(frame=frame, share=100 * confidence))
        redraw(context)
        return None


class SHUTTER_OT_outline_mask(_Carries, Operator):
    """Make a Blender mask with shape keys of the active outline, after tracking it"""

    bl_label = "Outline to Mask"
    bl_options = UNDOABLE

    step: IntProperty(
        name="Every",
        description="Frames between shape keys of a tracked outline; 0 for its drawings only",
        default=5,
        min=0,
        soft_max=50,
    )

    def carried(self, context: Context) -> None:
        mask = outline_drawings.to_mask(context, selection.active(context), self._target.index, self.step)
        self.report({"INFO"}, rpt_('Made the mask "{mask}"').format(mask=mask.name))


@operator("Insert Outline Drawing", needs.an_outline, only_seen=True)
def outline_draw(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Turn the tracked outline at the current frame into a drawing that can be edited"""
    scene, strip, index = self.edit, self.effect_strip, effect.active_region
    curves = outline_drawings.curves_now(scene, effect, strip, index)
    if not curves:
        report_warning(self, rpt_("The outline is empty at the current frame"))
        return {"CANCELLED"}
    outline_drawings.draw(effect, strip, effect.regions[index], curves, scene.frame_current)
    return None


_FRAME = IntProperty(
    name="Frame", description="Timeline frame of the strokes; without one, the current frame", options={"SKIP_SAVE"}
)


@operator("Find Outline", needs.strokes, only_seen=True, frame=_FRAME)
def outline_it(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Make the active region an outline of the subject that its strokes mark or enclose at this frame"""
    if self.properties.is_property_set("frame"):
        self.edit.frame_set(self.frame)
    if not outline_drawings.outline_it(self.edit, effect, self.effect_strip, effect.active_region):
        report_warning(self, rpt_("No subject stands out from its surroundings"))
        return {"CANCELLED"}
    return None


def _there(held: Operator | Gizmo) -> Any:
    """Return scene, effect and strip of an operator or gizmo that keeps a `target` and a `strip` name; None: they are
    gone."""
    effect = held.target.effect()
    strip = effect and effect.id_data.sequence_editor.strips_all.get(held.strip)
    return (effect.id_data, effect, strip) if effect is not None and strip is not None else None


class SHUTTER_OT_outline_points(OfEffect, Operator):
    """Draw a curve of the active outline point by point, along the picture's edges (Ctrl for straight lines)"""

    bl_label = "Draw by Points"
    only_seen = True
    needs = (needs.an_outline,)

    def invoke(self, context: Context, _event: Event) -> set[str]:
        scene, effect, strip = selection.active(context)
        areas = [area for window, area in preview_areas.previews(context) if window == context.window]
        if not areas:
            return self.execute(context)
        self._area = context.area if context.area in areas else areas[0]
        if self.tried(self._read, scene, effect, strip) == {"CANCELLED"}:
            return {"CANCELLED"}
        self.target, self._frame = track_region.Target.of(effect, effect.active_region), scene.frame_current
        self.strip, self._next, self._is_down = strip.name, np.zeros((0, 2)), False
        self._ways: list[np.ndarray] = []
        sharp_frame.show(context)
        self._drawn = bpy.types.SpaceSequenceEditor.draw_handler_add(self._draw, (), "PREVIEW", "POST_PIXEL")
        sentence = rpt_(
            "Click points around the subject (arrow keys, Space), Ctrl: straight, Backspace: undo point, "
            "Return: close, Esc: cancel"
        )
        show_status(sentence)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _read(self, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
        self._picture = outline_drawings.picture_now(scene, effect, strip)
        outlining.along_edges(self._picture, np.zeros(2), np.zeros(2))  # raises now if OpenCV is missing

    def execute(self, _context: Context) -> set[str]:
        """Report that drawing needs a preview."""
        report_warning(self, rpt_("Open a sequencer with a preview to draw"))
        return {"CANCELLED"}

    def modal(self, context: Context, event: Event) -> set[str]:
        there, has_preview = _there(self), self._area.type == "SEQUENCE_EDITOR"
        has_preview = has_preview and self._area.spaces.active.view_type != "SEQUENCER"
        if there is None or there[0].frame_current != self._frame or not has_preview:
            return self._ended(context, {"CANCELLED"})
        if event.type == "LEFTMOUSE" and event.value == "RELEASE":
            self._is_down = False
        if event.type in _ARROWS and event.value == "PRESS":
            return self._stepped(context, event)
        if event.type in {"MOUSEMOVE", "LEFTMOUSE", "SPACE"} and self._is_over(event):
            return self._pointed(context, event)
        return self._key(context, event) if event.type in _KEYS else {"PASS_THROUGH"}

    def _pointed(self, context: Context, event: Event) -> set[str]:
        """Add a point at a click or the space bar, and points along the way while dragging."""
        point = self._on_picture(event)
        if event.type in {"LEFTMOUSE", "SPACE"} and event.value in {"PRESS", "DOUBLE_CLICK"}:
            if len(self._ways) > 2 and self._apart(point, self._ways[0][0]) <= _CLOSES * drawing.ui_scale():
                return self._closed(context)
            self._is_down = event.type == "LEFTMOUSE"
            self._ways.append(self._way(point, event.ctrl))
        elif self._is_down and self._apart(point, self._ways[-1][-1]) >= _STRIDE * drawing.ui_scale():
            self._ways.append(self._way(point, event.ctrl))
        self._next = self._way(point, event.ctrl) if self._ways else np.zeros((0, 2))
        self._area.tag_redraw()
        return {"RUNNING_MODAL"}

    def _stepped(self, context: Context, event: Event) -> set[str]:
        """Move the pointer with an arrow key, first into the middle of the preview."""
        region = preview_areas.preview_region(self._area)
        x, y = region.x + region.width // 2, region.y + region.height // 2
        if self._is_over(event):
            step = round((_FINE if event.shift else _STEP) * drawing.ui_scale())
            x, y = (
                place + step * way
                for place, way in zip((event.mouse_x, event.mouse_y), _ARROWS[event.type], strict=True)
            )
        context.window.cursor_warp(x, y)
        return {"RUNNING_MODAL"}

    def _key(self, context: Context, event: Event) -> set[str]:
        if event.value == "PRESS":
            if event.type in {"ESC", "RIGHTMOUSE"}:
                return self._ended(context, {"CANCELLED"})
            if event.type in {"RET", "NUMPAD_ENTER"}:
                return self._closed(context)
            if event.type == "BACK_SPACE" and self._ways:
                self._ways.pop()
                self._next = np.zeros((0, 2))
                self._area.tag_redraw()
        return {"RUNNING_MODAL"}

    def _closed(self, context: Context) -> set[str]:
        """Close the curve and add it to the drawing of this frame."""
        if len(self._ways) < 3:
            report_warning(self, rpt_("A curve needs at least three points"))
            return {"RUNNING_MODAL"}
        _scene, effect, strip = _there(self)
        region = effect.regions[self.target.index]
        # The first click snaps to no edge, so the curve begins at the edge point next to it.
        first = self._ways[1][0]
        curve = np.concatenate([*self._ways[1:], self._way(first, False)])
        steps = np.hypot(*np.diff(curve, axis=0, append=curve[:1]).T)
        add = partial(outline_drawings.draw, adds=True)
        return self._ended(context, self.tried(add, effect, strip, region, [curve[steps > 0]], self._frame))

    def _ended(self, context: Context, result: set[str]) -> set[str]:
        self.cancel(context)
        redraw(context)
        return result

    def cancel(self, context: Context) -> None:
        """Clean up at the end, or when Blender closes the window."""
        bpy.types.SpaceSequenceEditor.draw_handler_remove(self._drawn, "PREVIEW")
        show_status(None)
        sharp_frame.give_back(context)

    def _way(self, point: np.ndarray, is_straight: bool) -> np.ndarray:
        """Return the points from the last point to a new one. The first point is alone."""
        if not self._ways:
            return point[None]
        last = self._ways[-1][-1]
        return np.stack([last, point]) if is_straight else outlining.along_edges(self._picture, last, point)

    def _is_over(self, event: Event) -> bool:
        region = preview_areas.preview_region(self._area)
        x, y = event.mouse_x - region.x, event.mouse_y - region.y
        return 0 <= x < region.width and 0 <= y < region.height

    def _view(self) -> View:
        _scene, effect, strip = _there(self)
        return view(effect, strip, preview_areas.preview_region(self._area))

    def _on_picture(self, event: Event) -> np.ndarray:
        """Return the pointer's position in fractions of the picture."""
        region = preview_areas.preview_region(self._area)
        return self._view().on_picture(event.mouse_x - region.x, event.mouse_y - region.y)

    def _apart(self, *points: np.ndarray) -> float:
        """Return the distance of two points in pixels of the region."""
        return float(np.hypot(*np.diff(self._view().on_region(points), axis=0)[0]))

    def _draw(self) -> None:
        if bpy.context.area != self._area or _there(self) is None or not self._ways:
            return
        curve = np.concatenate([*self._ways, self._next])
        drawing.lines(self._view().on_region(curve), _COLOR, width=2)


class SHUTTER_GT_outline(Dragged, Gizmo):
    """The curves of the active outline in a preview. Dragging corrects them and makes the frame a drawing."""

    def seen(self, context: Context) -> tuple[outlines.Curves, View] | None:
        """Return the curves at the current frame and the view of the picture. There are none during playback."""
        seen = None if context.screen.is_animation_playing else selection.in_picture(context)
        if seen is None:
            return None
        scene, effect, strip = seen
        try:
            curves = outline_drawings.shown_curves(scene, effect, strip, effect.active_region)
        except UserError:  # panels and the live preview show the error
            return None
        return (curves, view(effect, strip, context.region)) if curves else None

    def show(self, _context: Context, seen: tuple[outlines.Curves, View]) -> None:
        curves, seen_as = seen
        for points in self.mended() if self.is_modal else curves:
            width = 2 if self.is_highlight or self.is_modal else 1
            drawing.lines(seen_as.on_region(points), _COLOR, closed=True, width=width)

    def is_at(self, _context: Context, seen: tuple[outlines.Curves, View], location: tuple[int, int]) -> bool:
        curves, seen_as = seen
        _index, apart = outlines.nearest(curves, tuple(seen_as.on_picture(*location)), seen_as.aspect)
        height = float(np.hypot(*seen_as.matrix[:2, 1]))  # of the picture, in region pixels
        return bool(apart * height <= drawing.ui_scale() * _NEAR)

    def grab(self, context: Context, event: Event, seen: tuple[outlines.Curves, View]) -> None:
        curves, seen_as = seen
        scene, effect, strip = selection.in_picture(context)
        self.target, self.frame = track_region.Target.of(effect, effect.active_region), scene.frame_current
        self.strip, self.curves, self.by, self.reach = strip.name, curves, (0.0, 0.0), _REACH
        self.aspect = seen_as.aspect
        self.grabbed = tuple(seen_as.on_picture(event.mouse_region_x, event.mouse_region_y))
        self.pulled, _apart = outlines.nearest(curves, self.grabbed, self.aspect)

    def mended(self) -> outlines.Curves:
        return outlines.dragged(self.curves, self.pulled, self.grabbed, self.by, self.reach, self.aspect)

    def drag(self, context: Context, event: Event, _tweak: set[str]) -> None:
        if (there := _there(self)) is None:
            return
        if event.type in {"WHEELUPMOUSE", "WHEELDOWNMOUSE"}:
            self.reach *= _MORE if event.type == "WHEELUPMOUSE" else 1 / _MORE
        _scene, effect, strip = there
        point = view(effect, strip, context.region).on_picture(event.mouse_region_x, event.mouse_region_y)
        self.by = tuple(point - np.array(self.grabbed))
        context.area.tag_redraw()

    def exit(self, context: Context, cancel: bool) -> None:
        if cancel or not any(self.by) or (there := _there(self)) is None:
            return
        _scene, effect, strip = there
        outline_drawings.draw(effect, strip, effect.regions[self.target.index], self.mended(), self.frame)
        context.area.tag_redraw()
        bpy.ops.ed.undo_push(message=iface_("Edit Outline", contexts.operator_default))


class SHUTTER_GGT_outline(WithKeys, GizmoGroup):
    bl_label = "Shutter Outline"
    gizmo = SHUTTER_GT_outline

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not SHUTTER_GGT_region.poll(context):
            return False
        return selection.active_region(selection.in_picture(context)[1]).kind in strips.OUTLINED
