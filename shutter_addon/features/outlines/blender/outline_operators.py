"""Operators and a gizmo for outlines and subjects: find, track and correct them, and go to where a drawing is needed.

Annotations have no key types in Blender 5.2, so the Dope Sheet shows generated and hand-made drawings the same way.
"""

from contextlib import closing
from functools import lru_cache

import bpy
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Event, Gizmo, GizmoGroup, Operator, PropertyGroup, Scene, Strip, UILayout

from ....blender.data import selection, snapshot, strips
from ....blender.data.annotations import layer_of
from ....blender.editing import region_edits
from ....blender.interface import drawing, needs
from ....blender.interface.gizmo_groups import Dragged, View, WithKeys, view
from ....blender.interface.operator_bases import Beside, OfEffect, operator, redraw, report, show_status
from ....blender.interface.region_gizmo import SHUTTER_GGT_region
from ....blender.rendering import effect_source, previews, render_job
from ....blender.rendering.effect_source import FAULTS
from ....core import revision
from ....core.messages import EffectError, UserError
from ....core.model import outlines, scribbles
from ....media import flow, outlining
from .. import carrying
from ..carried_mattes import CarriedMattes
from ..subject_mattes import CarriedFile
from . import outline_carrying

SURE_SUBJECT = 0.5  # a more confident frame of a subject needs no correction
SURE = 0.75  # a more confident frame needs no drawing: its overlap is usually 90 %
_COLOR = (0.2, 0.9, 1.0, 0.9)
_NEAR = 6  # interface units from the pointer to a curve that it can grab
_REACH = 0.08  # fraction of the picture's height: how far a pull reaches along the curve at first
_MORE = 1.25  # factor for each turn of the wheel


def curves_now(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> outlines.Curves:
    """Return the curves of an outline or subject at the current frame, in fractions of the picture.

    If there is a drawing at this frame, these are its curves. Otherwise they are traced around the tracked matte. If
    that matte is not made yet, or the outline is not tracked, curves move straight from drawing to drawing.

    Args:
        scene: The scene of the edit, which has the current frame.
        strip: The effect strip.
        index: The index of the region in the effect.

    Raises:
        EffectError, MediaError: The effect has no source, or a matte cannot be read.
    """
    frame = scene.frame_current
    if not strips.is_carried(effect.regions[index]):
        return outlines.curves(snapshot.strokes_at(scene, effect, strip, index, frame))
    file, shown = snapshot.carried_outline(scene, effect, strip, index, (frame,))
    with closing(_opened(file)) as mattes:
        return mattes.curves(min(shown[frame], mattes.count - 1))


@lru_cache(1)  # opening a movie for each frame would be slow; reading opens it again
def _opened(file: CarriedFile) -> CarriedMattes:
    return file.open()


def shown_curves(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> outlines.Curves:
    """Return what `curves_now` returns, for drawing code. It, or the error, is cached until the edit changes."""
    key = effect.scene.session_uid, strip.name, index, scene.frame_current
    return revision.until_change("outline", key, lambda: curves_now(scene, effect, strip, index))


def carried_frames(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> tuple[CarriedFile, dict[int, int]]:
    """Return the mattes of a tracked outline or subject, and which frame of the footage each frame of the strip shows.

    Args:
        scene: The scene of the edit.
        strip: The effect strip.
        index: The index of the region in the effect.

    Returns:
        The CarriedFile that makes and stores the mattes, and {timeline frame: frame of the footage, from 0} for all
        frames of the strip.

    Raises:
        EffectError, MediaError: The outline is not tracked, or the effect has no source.
    """
    frames = range(strip.left_handle, strip.right_handle)
    file, shown = snapshot.carried_outline(scene, effect, strip, index, frames)
    return file, {int(frame): number for frame, number in shown.items()}


def next_needed(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> tuple[int | None, float]:
    """Find the frame of a tracked outline or a subject that most needs a drawing: where tracking is least sure.

    Only mattes that are made already count. A frame of an outline without one counts as confidence 0; such a frame of a
    subject is ignored. So are frames of an outline that have a drawing.

    Args:
        index: Index of the region.

    Returns:
        The timeline frame with the lowest confidence (if several frames have it, the middle one of them), and this
        confidence, 0 to 1. If no frame is below the confidence that is enough (SURE, SURE_SUBJECT): None, and that one.

    Raises:
        EffectError, MediaError: The outline is interpolated instead of tracked, or the effect has no source.
    """
    file, shown = carried_frames(scene, effect, strip, index)
    is_subject = effect.regions[index].kind == "SUBJECT"
    drawn = [] if is_subject else [number for number, _curves in file.drawings]
    with closing(file.open()) as mattes:
        known = {frame: mattes.confidence(number) for frame, number in shown.items() if number not in drawn}
    # Not all mattes of a subject may be made. Frames of an outline without one are too far from any drawing.
    sure = {frame: share or 0.0 for frame, share in known.items() if not (is_subject and share is None)}
    enough = SURE_SUBJECT if is_subject else SURE
    least = min(sure.values(), default=enough)
    if least >= enough:
        return None, enough
    worst = sorted(frame for frame, share in sure.items() if share == least)
    return worst[len(worst) // 2], least


def find_subject(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Make a region a subject, if the network finds one under its strokes.

    The strokes are those of the region's drawing nearest in time to the current frame. If nothing is found, the region
    keeps its kind. An outline becomes a subject at once: its drawings are kept, and the network is not asked.

    Args:
        index: Index of the region.

    Returns:
        Whether the region is a subject now.

    Raises:
        EffectError, MediaError: There are no strokes or no source, the footage or the network cannot be read, or OpenCV
            is missing.
    """
    region, before = effect.regions[index], effect.regions[index].kind
    if before == "OUTLINE":
        region.kind, region.layer, region.outline_layer = "SUBJECT", "", region.layer
        return True
    layer, frame = layer_of(effect, region), scene.frame_current
    drawn = [drawing.frame_number for drawing in layer.frames] if layer else []
    frame = min(drawn, key=lambda each: abs(each - frame), default=frame)
    if not snapshot.strokes_at(scene, effect, strip, index, frame):
        raise EffectError(rpt_("The region has no strokes at the current frame"))
    region.kind, is_found = "SUBJECT", False
    try:
        file, shown = snapshot.carried_outline(scene, effect, strip, index, (frame,))
        with closing(file.open()) as mattes:  # its first matte is kept, and shown at once
            mattes.read(shown[frame])
            is_found = bool(mattes.confidence(shown[frame]))
    finally:
        if not is_found:
            region.kind = before
    if is_found:
        region.motion = "LOCATION"
    return is_found


class SHUTTER_OT_outline_needed(Beside, OfEffect, Operator):
    """Track the active outline through its strip and go to the frame that needs a drawing most (Esc stops)"""

    bl_label = "Next Drawing Needed"
    bl_options = {"REGISTER"}
    only_seen = True
    needs = (needs.an_outline,)

    def begin(self, context: Context, waits: bool) -> set[str] | None:
        scene, effect, strip = selection.active(context)
        self._target = selection.Target.of(effect, effect.active_region)
        file, shown = carried_frames(scene, effect, strip, effect.active_region)
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
        frame, confidence = next_needed(scene, effect, strip, self._target.index)
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
    curves = curves_now(scene, effect, strip, index)
    if not curves:
        return report(self, rpt_("The outline is empty at the current frame"))
    region_edits.draw_curves(effect, strip, effect.regions[index], curves, scene.frame_current)
    return None


@operator("Find Outline", needs.strokes, only_seen=True)
def outline_it(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Make the active region an outline of the subject that its strokes mark or enclose at this frame"""
    scene, strip, index = self.edit, self.effect_strip, effect.active_region
    region, frame = effect.regions[index], scene.frame_current
    there = snapshot.region_at(scene, effect, strip, index, (frame,))
    strokes = there.drawings.at(frame) if region.kind == "OUTLINE" else there.at(frame).strokes
    if not len(strokes):
        raise EffectError(rpt_("The region has no strokes at the current frame"))
    taken = snapshot.take(scene, effect, strip, (frame,))
    with effect_source.open_source(taken) as source:
        samples = source.read(effect_source.clip_of(taken, source).shown(frame).source_frame)
        picture = flow.displayed(samples, source.transfer, source.alpha)
    width, height = carrying.working_size(*picture.shape[1::-1])
    encloses = region.kind != "LINE"
    shape = scribbles.Shape(shutter=0, kind="line", width=region.width, strokes=tuple(strokes))
    drawn = outlines.coverage(strokes, width, height) > 0.5 if encloses else np.zeros((height, width), bool)
    if not drawn.any():
        drawn = scribbles.rasterise([shape], width, height) > 0
    curves = outlining.proposed(picture, drawn, encloses=encloses)
    if not curves:
        return report(self, rpt_("No subject stands out from its surroundings"))
    if region.kind != "OUTLINE":  # drawings of an outline at other frames stay
        region.kind, region.motion = "OUTLINE", "LOCATION"
        layer = layer_of(effect, region)
        for drawing in list(layer.frames):
            layer.frames.remove(drawing)
    region_edits.draw_curves(effect, strip, region, curves, frame)
    return None


@operator("Find Subject", needs.strokes, only_seen=True)
def subject_find(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Make the active region a subject, which a model finds under its strokes at this frame and follows"""
    if find_subject(self.edit, effect, self.effect_strip, effect.active_region):
        return None
    return report(self, rpt_("The model finds no subject under the stroke: draw along its middle, or outline it"))


@operator("Scribble", needs.a_subject, icon="IPO_LINEAR")
def subject_scribble(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Make the active subject a scribble: its strokes, as wide as the region's width"""
    effect.regions[effect.active_region].kind = "LINE"


@operator("Outline", needs.a_subject, icon="CURVE_BEZCIRCLE", only_seen=True)
def subject_outline(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Turn the active subject into an outline, with a drawing at each frame where you drew on the subject"""
    strip, index = self.effect_strip, effect.active_region
    region = effect.regions[index]
    layers = [layer_of(effect, region, name) for name in ("layer", "outline_layer")]
    frames = sorted({drawing.frame_number for layer in layers if layer for drawing in layer.frames})
    file, shown = snapshot.carried_outline(self.edit, effect, strip, index, frames)
    with closing(file.open()) as mattes:
        for frame in frames:
            mattes.read(shown[frame])
        curves = {frame: mattes.curves(shown[frame]) for frame in frames}
    if not any(curves.values()):
        return report(self, rpt_("The subject has no outline there"))
    region_edits.remove_layers(effect, region)
    region.kind = "OUTLINE"
    for frame, drawn in curves.items():
        region_edits.draw_curves(effect, strip, region, drawn, frame)
    return None


def after_stroke(context: Context, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    """Look for a subject under the first stroke of a new effect's first region. If there is one, the region becomes it.

    Called after each stroke, when the pen goes up. It does nothing unless the active region is a line with one stroke
    that region_edits.first_drawn has marked for it (`finds_subject`). Errors are shown in a popup.
    """
    region = effect.regions[effect.active_region]
    layer = layer_of(effect, region)
    drawn = sum(len(drawing.strokes) for drawing in layer.frames) if layer else 0
    if not (region.finds_subject and region.kind == "LINE" and drawn == 1):
        return
    try:
        is_found = find_subject(scene, effect, strip, effect.active_region)
    except (*FAULTS, UserError) as error:
        render_job.popup(str(error), icon="ERROR")
        return
    if is_found:
        bpy.ops.ed.undo_push(message=iface_("Find Subject", contexts.operator_default))
        redraw(context)


def draw_new(layout: UILayout) -> None:
    """Draw the menu entries that start a new subject or a new outline."""
    subject = layout.operator("shutter.draw", text="Draw Subject", icon="OUTLINER_OB_ARMATURE")
    subject.new, subject.kind = True, "SUBJECT"
    outline = layout.operator("shutter.draw", text="Draw Outline", icon="CURVE_BEZCIRCLE")
    outline.new, outline.kind = True, "OUTLINE"


class SHUTTER_GT_outline(Dragged, Gizmo):
    """The curves of the active outline or subject in a preview. Dragging corrects them and makes them a drawing."""

    def seen(self, context: Context) -> tuple[outlines.Curves, View] | None:
        """Return the curves at the current frame, and where the picture is; None: there are none, or the film plays."""
        seen = None if context.screen.is_animation_playing else selection.in_picture(context)
        if seen is None:
            return None
        scene, effect, strip = seen
        try:
            curves = shown_curves(scene, effect, strip, effect.active_region)
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
        """Return the effect and the strip of the outline that is dragged; None: they are gone."""
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
