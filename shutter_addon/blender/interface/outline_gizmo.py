"""The active outline as it is carried to the current frame: pulling at it mends it, and makes that frame a drawing."""

import bpy
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, Event, Gizmo, GizmoGroup, PropertyGroup, Strip

from ...core.messages import UserError
from ...core.model import outlines
from ..data import selection
from ..editing import outline_drawings, track_region
from . import drawing, region_gizmo
from .gizmo_groups import Dragged, View, WithKeys, view

_CARRIED = (0.2, 0.9, 1.0, 0.9)
_NEAR = 6  # units of the interface, within which the pointer is at a curve
_REACH = 0.08  # parts of the picture's height, along the curve, that are pulled along at first
_MORE = 1.25  # times, with a turn of the wheel


class SHUTTER_GT_outline(Dragged, Gizmo):
    """The curves."""

    def draw(self, context: Context) -> None:
        if context.screen.is_animation_playing:
            return
        if not (curves := _curves(context)):
            return
        seen = _view(context)
        for points in self.mended() if self.is_modal else curves:
            width = 2 if self.is_highlight or self.is_modal else 1
            drawing.lines(seen.on_region(points), _CARRIED, closed=True, width=width)

    def test_select(self, context: Context, location: tuple[int, int]) -> int:
        if not (curves := _curves(context)):
            return -1
        seen = _view(context)
        _index, apart = outlines.nearest(curves, _point(seen, location), seen.aspect)
        height = float(np.hypot(*seen.matrix[:2, 1]))  # of the picture, in pixels of the region
        return 0 if apart * height <= drawing.ui_scale() * _NEAR else -1

    def invoke(self, context: Context, event: Event) -> set[str]:
        if not (curves := _curves(context)):
            return {"CANCELLED"}
        scene, effect, strip = selection.in_picture(context)
        self.target, self.frame = track_region.Target.of(effect, effect.active_region), scene.frame_current
        self.strip, self.curves, self.by, self.reach = strip.name, curves, (0.0, 0.0), _REACH
        seen = _view(context)
        self.aspect = seen.aspect
        self.grabbed = _point(seen, (event.mouse_region_x, event.mouse_region_y))
        self.pulled, _apart = outlines.nearest(curves, self.grabbed, self.aspect)
        return {"RUNNING_MODAL"}

    def mended(self) -> outlines.Curves:
        return outlines.dragged(self.curves, self.pulled, self.grabbed, self.by, self.reach, self.aspect)

    def modal(self, context: Context, event: Event, _tweak: set[str]) -> set[str]:
        if (effect := self.target.effect()) is None or (strip := self._strip(effect)) is None:
            return {"RUNNING_MODAL"}
        if event.type in {"WHEELUPMOUSE", "WHEELDOWNMOUSE"}:
            self.reach *= _MORE if event.type == "WHEELUPMOUSE" else 1 / _MORE
        seen = view(effect, strip, context.region)
        point = _point(seen, (event.mouse_region_x, event.mouse_region_y))
        self.by = tuple(np.subtract(point, self.grabbed))
        context.area.tag_redraw()
        return {"RUNNING_MODAL"}

    def exit(self, context: Context, cancel: bool) -> None:
        if cancel or not any(self.by) or (effect := self.target.effect()) is None:
            return
        if (strip := self._strip(effect)) is None:
            return
        outline_drawings.draw(effect, strip, effect.regions[self.target.index], self.mended(), self.frame)
        context.area.tag_redraw()
        bpy.ops.ed.undo_push(message=iface_("Mend Outline", contexts.operator_default))

    def _strip(self, effect: PropertyGroup) -> Strip | None:
        return effect.id_data.sequence_editor.strips_all.get(self.strip)


def _view(context: Context) -> View:
    _scene, effect, strip = selection.in_picture(context)
    return view(effect, strip, context.region)


def _point(seen: View, location: tuple[int, int]) -> tuple[float, float]:
    """A point of the preview's region in fractions of the picture."""
    x, y = seen.on_picture(*location)
    return float(x), float(y)


def _curves(context: Context) -> outlines.Curves:
    """The active outline's at the current frame, where it is seen."""
    if (seen := selection.in_picture(context)) is None:  # while it plays, it may just have gone
        return ()
    scene, effect, strip = seen
    try:
        return outline_drawings.shown_curves(scene, effect, strip, effect.active_region)
    except UserError:  # panels and the live preview tell it
        return ()


class SHUTTER_GGT_outline(WithKeys, GizmoGroup):
    bl_label = "Shutter Outline"
    gizmo = SHUTTER_GT_outline

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not region_gizmo.SHUTTER_GGT_region.poll(context):
            return False
        return selection.active_region(selection.in_picture(context)[1]).kind == "OUTLINE"
