"""Gizmos in the preview: handles that move, rotate and scale the active region."""

from typing import NamedTuple

import bpy
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, Event, Gizmo, GizmoGroup, PropertyGroup, Scene, Strip

from ...core import revision
from ...core.messages import EffectError
from ...core.model import scribbles
from ..data import selection, snapshot, validation
from ..editing import bar_edits, motion_keys, region_edits
from ..rendering import render_job
from . import drawing
from .gizmo_groups import TWEAK, Dragged, View, WithKeys, view

_RADIUS = 7  # interface units: radius of a handle
_NEAREST = 0.03  # fraction of the picture: least distance between the two handles
_MARK = (1.0, 1.0, 1.0, 0.9)
_RAMP = np.array([(0.25, 0.5), (0.75, 0.5)])  # line of a ramp, in fractions of the picture


class Place(NamedTuple):
    """Where the handles of an effect's region are at the current frame, in pixels of the preview.

    Attributes:
        centre: Point (2,) of the handle that moves the effect's region.
        corner: Point (2,) of the handle that rotates and scales it.
        view: Where the preview shows the picture.
    """

    centre: np.ndarray
    corner: np.ndarray
    view: View


def _strokes_now(scene: Scene, effect: PropertyGroup, strip: Strip) -> list[np.ndarray]:
    """Return the active region's strokes, each (n, 2) in fractions of the picture, without the region's motion.

    The result is cached until something changes. A ramp by place has a constant line; a matte or a luminance ramp has
    no strokes ([]).

    Raises:
        EffectError: A stroke is too far outside the picture, or the strip's transform is not finite.
    """
    index, frame = effect.active_region, scene.frame_float
    region = effect.regions[index]
    if region.kind == "RAMP":
        return [_RAMP] if region.ramp != "LUMINANCE" else []
    key = effect.scene.session_uid, strip.name, index, frame
    return revision.until_change("strokes", key, lambda: snapshot.strokes_at(scene, effect, strip, index, frame))


def place(context: Context) -> Place | None:
    """Return where the handles of the active region are; None: no region is visible, or nothing is drawn in it."""
    seen = selection.in_picture(context)
    region = selection.active_region(seen[1]) if seen else None
    if region is None:
        return None
    scene, effect, strip = seen
    try:
        strokes = _strokes_now(scene, effect, strip)
        validation.check_moving(region)
    except EffectError:  # panels and the live preview show the error
        return None
    if not strokes:
        return None
    seen_as = view(effect, strip, context.region)
    points = np.concatenate(strokes)
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    corner = high if region.kind == "RAMP" else np.maximum(high, middle + _NEAREST)
    # The corner rotates about the middle of these points, so they include its mirror image.
    numbers = region.location, np.degrees(region.rotation), region.scale
    ((_, moved, _),) = scribbles.transform([[2 * middle - corner, corner, middle]], *numbers, seen_as.aspect)
    centre, corner = seen_as.on_region([middle + np.array(region.location), moved])
    return Place(centre, corner, seen_as)


class SHUTTER_GT_region(Dragged, Gizmo):
    """A handle of the active region: it moves the region or, with `turns`, rotates and scales it."""

    seen = staticmethod(place)

    def show(self, context: Context, seen: Place) -> None:
        if self.is_modal:  # else the draw handler shows the keyed place
            scene, effect, strip = selection.active(context)
            region = selection.active_region(effect)
            numbers = region.location, np.degrees(region.rotation), region.scale
            for points in scribbles.transform(_strokes_now(scene, effect, strip), *numbers, seen.view.aspect):
                drawing.lines(seen.view.on_region(points), _MARK, width=2)
        if not self.turns:
            drawing.lines([seen.centre, seen.corner], (1, 1, 1, 0.4))
        x, y = seen.corner if self.turns else seen.centre
        radius = drawing.ui_scale() * _RADIUS * (1.3 if self.is_highlight else 1.0)
        turn = np.linspace(0, 2 * np.pi, 17)[:-1]
        around = np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], axis=1)
        drawing.lines(around, _MARK, closed=True, width=2)
        if not self.turns:
            drawing.lines([(x - radius, y), (x + radius, y)], _MARK)
            drawing.lines([(x, y - radius), (x, y + radius)], _MARK)

    def is_at(self, _context: Context, seen: Place, location: tuple[int, int]) -> bool:
        handle = seen.corner if self.turns else seen.centre
        return bool(np.hypot(*(handle - location)) <= drawing.ui_scale() * _RADIUS * 1.5)

    def grab(self, context: Context, event: Event, seen: Place) -> None:
        effect = selection.active(context)[1]
        region = selection.active_region(effect)
        region_edits.hold_drawings(effect, effect.active_region)
        # During playback, another effect may become active.
        self.target = selection.Target.of(effect, effect.active_region)
        self.before = tuple(region.location), region.rotation, region.scale
        self.grabbed = event.mouse_region_x, event.mouse_region_y
        self.where = seen

    def drag(self, context: Context, event: Event, tweak: set[str]) -> None:
        mouse = event.mouse_region_x, event.mouse_region_y
        fine = 0.1 if "PRECISE" in tweak or event.shift else 1.0
        point = np.array(self.grabbed) + fine * (np.array(mouse) - self.grabbed)
        if (effect := self.target.effect()) is None:
            return
        region = effect.regions[self.target.index]
        (self._turn if self.turns else self._move)(region, point, "SNAP" in tweak or event.ctrl)
        context.area.tag_redraw()

    def _move(self, region: PropertyGroup, point: np.ndarray, snap: bool) -> None:
        moved = self.where.view.on_picture(*point) - self.where.view.on_picture(*self.grabbed)
        if snap:  # along one axis only
            moved[np.abs(moved * (self.where.view.aspect, 1)).argmin()] = 0
        region.location = np.array(self.before[0]) + moved

    def _turn(self, region: PropertyGroup, point: np.ndarray, snap: bool) -> None:
        start, end = np.array(self.grabbed) - self.where.centre, np.array(point) - self.where.centre
        turned = np.arctan2(end[1], end[0]) - np.arctan2(start[1], start[0])
        rotation = self.before[1] + (turned + np.pi) % (2 * np.pi) - np.pi
        region.rotation = np.radians(round(np.degrees(rotation) / 5) * 5) if snap else rotation
        region.scale = self.before[2] * max(np.hypot(*end) / max(np.hypot(*start), 1.0), 0.01)

    def exit(self, context: Context, cancel: bool) -> None:
        if (effect := self.target.effect()) is None:
            return
        index = self.target.index
        region = effect.regions[index]
        if cancel:
            region.location, region.rotation, region.scale = self.before
            return
        if bar_edits.auto_key(context) or motion_keys.MotionKeys(effect, index, region.motion).are_made():
            try:
                motion_keys.insert(effect, index)
            except EffectError as error:  # gizmos have no reports
                render_job.popup(str(error), icon="ERROR")
            context.area.tag_redraw()  # panels show whether it is keyed
        bpy.ops.ed.undo_push(message=iface_("Transform Region", contexts.operator_default))


class SHUTTER_GGT_region(WithKeys, GizmoGroup):
    bl_label = "Shutter Region"
    shortcuts = (TWEAK, ("shutter.region_key", "I", "PRESS", {}))

    @classmethod
    def poll(cls, context: Context) -> bool:
        settings, seen = context.window_manager.virtual_shutter, selection.in_picture(context)
        # A handle would take the pointer from the probe or from the pen.
        tool = context.workspace.tools.from_space_sequencer(context.space_data.view_type)
        if (settings.live and settings.probe) or (tool is not None and tool.idname.startswith("builtin.annotate")):
            return False
        return seen is not None and seen[0].is_editable and selection.active_region(seen[1]) is not None

    def setup(self, _context: Context) -> None:
        for turns in (False, True):
            self.gizmos.new(SHUTTER_GT_region.__name__).turns = turns
