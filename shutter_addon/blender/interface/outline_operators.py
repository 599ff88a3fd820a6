"""Operators of outlines: carried now, drawn where that is needed most, and made of what is carried."""

from contextlib import closing

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import IntProperty
from bpy.types import Context, Event, Operator, PropertyGroup

from ...core.messages import UserError
from ..data import selection, strips
from ..editing import outline_drawings, outline_masks, track_region
from ..rendering import outline_carrying
from .operator_bases import UNDOABLE, Beside, OfRegion, OfStrokes, is_escape, own_classes, redraw, report_warning
from .preview import show_carried

_TICK = 0.1  # seconds from one look at what is carried to the next


class OfOutline(OfRegion):
    """Works on the active region, which is an outline."""

    only_seen = True

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        if sentence := super().why_not(effect):
            return sentence
        return None if selection.active_region(effect).kind == "OUTLINE" else rpt_("The region is no outline")


class _Carries(Beside, OfOutline):
    """Carries the active outline through its strip, beside Blender, and then does something with it."""

    bl_options = {"REGISTER"}

    def carried(self, context: Context) -> set[str] | None:
        """Called once all is carried. One of FAULTS: what comes then cannot be done."""
        return None

    def execute(self, context: Context) -> set[str]:
        return self.tried(self._begin, context, True)

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return self.tried(self._begin, context, bpy.app.background)

    def _begin(self, context: Context, waits: bool) -> set[str] | None:
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
        outline_carrying.carry(file, frames, show_carried)
        return self.go_on(context, _TICK)

    def modal(self, context: Context, event: Event) -> set[str]:
        progress = outline_carrying.progress()
        is_stopped = self._target.effect() is None or is_escape(event)
        if is_stopped:
            outline_carrying.stop()
            show_carried()
        elif progress is not None:
            sentence = rpt_("Tracking the outline: {done} of {total} frames, Esc to stop")
            context.workspace.status_text_set(sentence.format(done=progress[0], total=progress[1]))
            return {"PASS_THROUGH"}
        self.cancel(context)
        return {"CANCELLED"} if is_stopped else self.tried(self._end, context)

    def _end(self, context: Context) -> set[str] | None:
        if (failure := outline_carrying.failure(self._file)) is not None:
            raise UserError(failure)
        return self.carried(context)


class SHUTTER_OT_outline_carry(_Carries, Operator):
    """Track the active outline through its strip now (Esc stops and keeps the tracked frames)"""

    bl_label = "Track Outline"


class SHUTTER_OT_outline_needed(_Carries, Operator):
    """Go to the middle of the frames at which the outline is least sure, tracking it first"""

    bl_label = "Next Drawing Needed"

    def carried(self, context: Context) -> set[str] | None:
        scene, effect, strip = selection.active(context)
        needed = outline_drawings.next_needed(scene, effect, strip, self._target.index)
        if needed.frame is None:
            self.report({"INFO"}, rpt_("The outline is sure by 75 % or more at all frames"))
            return {"CANCELLED"}
        scene.frame_set(needed.frame)
        sentence = rpt_("Frame {frame}: the outline is sure by {share:.0f} %")
        self.report({"INFO"}, sentence.format(frame=needed.frame, share=100 * needed.confidence))
        redraw(context)
        return None


class SHUTTER_OT_outline_mask(_Carries, Operator):
    """Make a Blender mask with shape keys of the active outline, tracking it first"""

    bl_label = "Outline to Mask"
    bl_options = UNDOABLE

    step: IntProperty(
        name="Every",
        description="Frames from one shape key to the next between drawings of a tracked outline; 0 for drawings alone",
        default=5,
        min=0,
        soft_max=50,
    )

    def carried(self, context: Context) -> None:
        mask = outline_masks.to_mask(context, selection.active(context), self._target.index, self.step)
        self.report({"INFO"}, rpt_('Made the mask "{mask}"').format(mask=mask.name))


class SHUTTER_OT_outline_draw(OfOutline, Operator):
    """Make the outline that is tracked to the current frame a drawing of its own, to be mended"""

    bl_label = "Insert Outline Drawing"

    def change(self, _context: Context, effect: PropertyGroup) -> set[str] | None:
        scene, strip, index = self.edit, self.effect_strip, effect.active_region
        curves = outline_drawings.curves_now(scene, effect, strip, index)
        if not curves:
            report_warning(self, rpt_("The outline encloses nothing at the current frame"))
            return {"CANCELLED"}
        outline_drawings.draw(effect, strip, effect.regions[index], curves, scene.frame_current)
        return None


class SHUTTER_OT_outline_it(OfStrokes, Operator):
    """Make the active region an outline of the subject that its strokes run over, or go around, at this frame"""

    bl_label = "Find Outline"
    only_seen = True

    frame: IntProperty(
        name="Frame",
        description="Timeline frame of the strokes; without one, the current frame",
        options={"SKIP_SAVE"},
    )

    def change(self, _context: Context, effect: PropertyGroup) -> set[str] | None:
        if self.properties.is_property_set("frame"):
            self.edit.frame_set(self.frame)
        if not outline_drawings.outline_it(self.edit, effect, self.effect_strip, effect.active_region):
            report_warning(self, rpt_("No subject is told from what is around it"))
            return {"CANCELLED"}
        return None


classes = own_classes(globals())
