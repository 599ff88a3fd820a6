"""Where the active region lies, and handles to move, turn and scale it in the sequencer's preview."""

import bpy
import numpy as np
from bpy.types import Gizmo, GizmoGroup

from ..core import scribbles
from . import drawing, editing, effects, geometry, strips

_RADIUS = 7  # of a handle, in units of the interface
_MARK = (1.0, 1.0, 1.0, 0.9)


class Place:
    """A region as the picture at the current frame has it, in pixels of the preview's region.

    strokes: lists of points (n, 2); centre and corner: the handles that move, and that turn and scale."""

    def __init__(self, context, found, region):
        edit, effect, strip = found
        index = list(effect.regions).index(region)
        size = effects.picture_size(effect)
        self.matrix = geometry.picture_to_image(strip, size)
        self.aspect = size[0] / size[1]
        self.view = context.region.view2d
        path = f"{effect.path_from_id()}.regions[{index}]"
        strokes = effects.strokes_at(edit, effect, strip, index, edit.frame_current_final)
        moved = scribbles.transform(strokes, region.location, np.degrees(region.rotation), region.scale, self.aspect)
        self.path = path
        self.is_moved = any(region.location) or region.rotation or region.scale != 1
        self.strokes = [self.to_region(points) for points in moved]
        points = np.concatenate(strokes)
        low, high = points.min(axis=0), points.max(axis=0)
        anchor = np.stack([(low + high) / 2, np.maximum(high, (low + high) / 2 + 0.03)])
        around = scribbles.transform(
            [anchor - anchor[0], anchor[0] - anchor], (0, 0), np.degrees(region.rotation), region.scale, self.aspect
        )
        self.centre, self.corner = self.to_region(anchor[0] + np.asarray(region.location) + around[0])

    def to_region(self, points) -> np.ndarray:
        image = geometry.mapped(self.matrix, np.asarray(points))
        return np.array([self.view.view_to_region(x, y, clip=False) for x, y in image], dtype=np.float64)

    def to_picture(self, x: float, y: float) -> np.ndarray:
        image = np.array([self.view.region_to_view(x, y)])
        return geometry.mapped(np.linalg.inv(self.matrix), image)[0]


def place(context) -> Place | None:
    """The active region's place, or None where there is none or nothing is drawn."""
    found = strips.active(context)
    region = editing.active_region(found[1]) if found else None
    if region is None:
        return None
    layer = editing.layer_of(found[1], region)
    if layer is None or not any(stroke.points for drawing_ in layer.frames for stroke in drawing_.strokes):
        return None
    edit, effect, strip = found
    index = list(effect.regions).index(region)
    if not effects.strokes_at(edit, effect, strip, index, edit.frame_current_final):
        return None
    return Place(context, found, region)


class SHUTTER_GT_region(Gizmo):
    """One handle; `turns`: turns and scales, or moves."""

    bl_idname = "SHUTTER_GT_region"

    def setup(self):
        self.use_draw_modal = True

    def draw(self, context):
        if (where := place(context)) is None:
            return
        if not self.turns:
            color = (*editing.active_shutter(strips.active(context)[1]).color, 0.9)
            for points in where.strokes if where.is_moved else ():
                drawing.lines(points, color, width=1.5)
            drawing.lines([where.centre, where.corner], (1, 1, 1, 0.4))
        x, y = where.corner if self.turns else where.centre
        radius = drawing.ui_scale() * _RADIUS * (1.3 if self.is_highlight else 1.0)
        turn = np.linspace(0, 2 * np.pi, 17)[:-1]
        around = np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], axis=1)
        drawing.lines(around, _MARK, closed=True, width=2)
        if not self.turns:
            drawing.lines([(x - radius, y), (x + radius, y)], _MARK)
            drawing.lines([(x, y - radius), (x, y + radius)], _MARK)

    def test_select(self, context, location):
        if (where := place(context)) is None:
            return -1
        handle = where.corner if self.turns else where.centre
        return 0 if np.hypot(*(handle - location)) <= drawing.ui_scale() * _RADIUS * 1.5 else -1

    def invoke(self, context, event):
        region = editing.active_region(strips.active(context)[1])
        self.before = tuple(region.location), region.rotation, region.scale
        self.grabbed = event.mouse_region_x, event.mouse_region_y
        self.where = place(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event, tweak):
        mouse = event.mouse_region_x, event.mouse_region_y
        fine = 0.1 if "PRECISE" in tweak else 1.0
        point = np.array(self.grabbed) + fine * (np.array(mouse) - self.grabbed)
        region = editing.active_region(strips.active(context)[1])
        (self._turn if self.turns else self._move)(region, point, "SNAP" in tweak)
        context.area.tag_redraw()
        return {"RUNNING_MODAL"}

    def _move(self, region, point, snap: bool):
        moved = self.where.to_picture(*point) - self.where.to_picture(*self.grabbed)
        if snap:  # along one axis
            moved[np.abs(moved * (self.where.aspect, 1)).argmin()] = 0
        region.location = np.array(self.before[0]) + moved

    def _turn(self, region, point, snap: bool):
        start, end = np.array(self.grabbed) - self.where.centre, np.array(point) - self.where.centre
        turned = np.arctan2(end[1], end[0]) - np.arctan2(start[1], start[0])
        rotation = self.before[1] + (turned + np.pi) % (2 * np.pi) - np.pi
        region.rotation = np.radians(round(np.degrees(rotation) / 5) * 5) if snap else rotation
        region.scale = self.before[2] * max(np.hypot(*end) / max(np.hypot(*start), 1.0), 0.01)

    def exit(self, context, cancel):
        found = strips.active(context)
        region = editing.active_region(found[1]) if found else None
        if region is None:
            return
        if cancel:
            region.location, region.rotation, region.scale = self.before
            return
        if context.scene.tool_settings.use_keyframe_insert_auto:
            editing.key_region(found[1], found[1].active_region)
        bpy.ops.ed.undo_push(message="Transform Region")


class SHUTTER_GGT_region(GizmoGroup):
    bl_idname = "SHUTTER_GGT_region"
    bl_label = "Shutter Region"
    bl_space_type = "SEQUENCE_EDITOR"
    bl_region_type = "PREVIEW"
    bl_options = {"PERSISTENT"}

    @classmethod
    def poll(cls, context):
        found = strips.active(context)
        return found is not None and found[0].is_editable and editing.active_region(found[1]) is not None

    @classmethod
    def setup_keymap(cls, keyconfig):
        keymap = keyconfig.keymaps.new(cls.bl_idname, space_type=cls.bl_space_type, region_type="WINDOW")
        keymap.keymap_items.new("gizmogroup.gizmo_tweak", "LEFTMOUSE", "PRESS", any=True)
        keymap.keymap_items.new("shutter.region_key", "I", "PRESS")
        return keymap

    def setup(self, _context):
        for turns in (False, True):
            self.gizmos.new(SHUTTER_GT_region.bl_idname).turns = turns


classes = (SHUTTER_GT_region, SHUTTER_GGT_region)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
