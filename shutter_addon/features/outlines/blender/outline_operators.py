"""Operators and the gizmo of outlines and subjects: find, track, correct, and go to where a drawing is needed."""

from contextlib import closing

import bpy
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Event, Gizmo, GizmoGroup, Operator, PropertyGroup, Scene, Strip, UILayout

from ....blender.data import selection, strips
from ....blender.data.annotations import layer_of
from ....blender.editing import region_edits
from ....blender.interface import drawing, needs
from ....blender.interface.gizmo_groups import Dragged, View, WithKeys, view
from ....blender.interface.operator_bases import Beside, OfEffect, operator, popup, redraw, report, show_status
from ....blender.interface.region_gizmo import SHUTTER_GGT_region
from ....blender.rendering import previews
from ....blender.rendering.effect_source import FAULTS
from ....core.messages import UserError
from ....core.model import outlines
from . import outline_carrying, outline_drawings

_COLOR = (0.2, 0.9, 1.0, 0.9)
_NEAR = 6  # interface units from the pointer to a curve that it can grab
_REACH = 0.08  # fraction of the picture's height: how far a pull reaches along the curve at first
_MORE = 1.25  # factor for each turn of the wheel


class SHUTTER_OT_outline_needed(Beside, OfEffect, Operator):
    """Track the active outline through its strip and go to the frame that needs a drawing most (Esc stops)"""

    bl_label = "Next Drawing Needed"
    bl_options = {"REGISTER"}
    only_seen = True
    needs = (needs.an_outline,)

    def begin(self, context: Context, waits: bool) -> set[str] | None:
        scene, effect, strip = selection.active(context)
        self._target = selection.Target.of(effect, effect.active_region)
        file, shown = outline_drawings.carried_frames(scene, effect, strip, effect.active_region)
        with closing(file.open()) as mattes:
            frames = sorted({number for number in shown.values() if not mattes.has(number)})
            if waits:
                for number in frames:
                    mattes.read(number)
        if waits or not frames:
            return self._go(context)
        self._file = file
        outline_carrying.carry(file, frames, shown.get(scene.frame_current))
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
            previews.show_carried()
            return {"CANCELLED"}
        if (failure := outline_carrying.failure(self._file)) is not None:
            raise UserError(failure)
        return self._go(context)

    def _go(self, context: Context) -> set[str] | None:
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


@operator("Insert Outline Drawing", needs.an_outline, only_seen=True)
def outline_draw(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Turn the tracked outline at the current frame into a drawing that can be edited"""
    scene, strip, index = self.edit, self.effect_strip, effect.active_region
    curves = outline_drawings.curves_now(scene, effect, strip, index)
    if not curves:
        return report(self, rpt_("The outline is empty at the current frame"))
    region_edits.draw_curves(effect, strip, effect.regions[index], curves, scene.frame_current)
    return None


@operator("Find Outline", needs.strokes, only_seen=True)
def outline_it(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Make the active region an outline of the subject that its strokes mark or enclose at this frame"""
    is_found = outline_drawings.outline_it(self.edit, effect, self.effect_strip, effect.active_region)
    return None if is_found else report(self, rpt_("No subject stands out from its surroundings"))


@operator("Find Subject", needs.strokes, only_seen=True)
def subject_find(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Make the active region a subject, which a model finds under its strokes at this frame and follows"""
    if outline_drawings.find_subject(self.edit, effect, self.effect_strip, effect.active_region):
        return None
    return report(self, rpt_("The model finds no subject under the stroke: draw along its middle, or outline it"))


@operator("Scribble", needs.a_subject, icon="IPO_LINEAR")
def subject_scribble(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Make the active subject a scribble: its strokes, as wide as the region's width"""
    effect.regions[effect.active_region].kind = "LINE"


@operator("Outline", needs.a_subject, icon="CURVE_BEZCIRCLE", only_seen=True)
def subject_outline(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Make the active subject an outline, which is drawn where the subject has strokes"""
    has_outline = outline_drawings.to_outline(self.edit, effect, self.effect_strip, effect.active_region)
    return None if has_outline else report(self, rpt_("The subject has no outline there"))


def after_stroke(context: Context, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    """Look for a subject under the first stroke of a new effect; the pen draws on the subject from now on."""
    region = effect.regions[effect.active_region]
    layer = layer_of(effect, region)
    drawn = sum(len(drawing.strokes) for drawing in layer.frames) if layer else 0
    if not (region.finds_subject and region.kind == "LINE" and drawn == 1):
        return
    try:
        is_found = outline_drawings.find_subject(scene, effect, strip, effect.active_region)
    except (*FAULTS, UserError) as error:
        popup(context, str(error), icon="ERROR")
        return
    if is_found:
        bpy.ops.ed.undo_push(message=iface_("Find Subject", contexts.operator_default))
        redraw(context)


def draw_new(layout: UILayout) -> None:
    """Draw the menu's entries for new subjects and outlines."""
    subject = layout.operator("shutter.draw", text="Draw Subject", icon="OUTLINER_OB_ARMATURE")
    subject.new, subject.kind = True, "SUBJECT"
    outline = layout.operator("shutter.draw", text="Draw Outline", icon="CURVE_BEZCIRCLE")
    outline.new, outline.kind = True, "OUTLINE"


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
        self.target, self.frame = selection.Target.of(effect, effect.active_region), scene.frame_current
        self.strip, self.curves, self.by, self.reach = strip.name, curves, (0.0, 0.0), _REACH
        self.aspect = seen_as.aspect
        self.grabbed = tuple(seen_as.on_picture(event.mouse_region_x, event.mouse_region_y))
        self.pulled, _apart = outlines.nearest(curves, self.grabbed, self.aspect)

    def mended(self) -> outlines.Curves:
        return outlines.dragged(self.curves, self.pulled, self.grabbed, self.by, self.reach, self.aspect)

    def _there(self) -> tuple[PropertyGroup, Strip] | None:
        """Return effect and strip of the grabbed outline; None: they are gone."""
        effect = self.target.effect()
        strip = effect and effect.id_data.sequence_editor.strips_all.get(self.strip)
        return None if strip is None else (effect, strip)

    def drag(self, context: Context, event: Event, _tweak: set[str]) -> None:
        if (there := self._there()) is None:
            return
        if event.type in {"WHEELUPMOUSE", "WHEELDOWNMOUSE"}:
            self.reach *= _MORE if event.type == "WHEELUPMOUSE" else 1 / _MORE
        point = view(*there, context.region).on_picture(event.mouse_region_x, event.mouse_region_y)
        self.by = tuple(point - np.array(self.grabbed))
        context.area.tag_redraw()

    def exit(self, context: Context, cancel: bool) -> None:
        if cancel or not any(self.by) or (there := self._there()) is None:
            return
        effect, strip = there
        region_edits.draw_curves(effect, strip, effect.regions[self.target.index], self.mended(), self.frame)
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
