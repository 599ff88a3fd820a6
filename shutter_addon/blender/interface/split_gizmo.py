"""The handle of the live preview's split view."""

import numpy as np
from bpy.types import Context, Event, Gizmo, GizmoGroup

from ...core.model.scribbles import mapped
from ..data import geometry, preview_areas
from . import drawing
from .gizmo_groups import Dragged, InPreview, on_picture, to_region
from .operator_bases import own_classes

_REACH = 8  # of the pointer, in units of the interface
_COLOR = (1.0, 1.0, 1.0, 0.9)


def _to_region(context: Context) -> np.ndarray | None:
    """Matrix from fractions of the shown picture to the region's pixels; None where no split is shown, or seen."""
    settings = context.window_manager.virtual_shutter
    if not settings.live or settings.view != "SPLIT" or (shown := preview_areas.shown(context)) is None:
        return None
    matrix = to_region(shown.effect, shown.strip, context.region)
    return matrix if geometry.is_invertible(matrix) else None


def _line(context: Context, matrix: np.ndarray) -> np.ndarray:
    at = context.window_manager.virtual_shutter.split
    return mapped(matrix, np.array([(at, 0.0), (at, 1.0)]))


class SHUTTER_GT_split(Dragged, Gizmo):
    def draw(self, context: Context) -> None:
        if (matrix := _to_region(context)) is None:
            return
        line = _line(context, matrix)
        x, y = line.mean(axis=0)
        half = drawing.ui_scale() * _REACH / 2
        drawing.lines(line, _COLOR, width=2 if self.is_highlight else 1)
        drawing.rectangles([(x - half, y - 3 * half, x + half, y + 3 * half)], [_COLOR])

    def test_select(self, context: Context, location: tuple[int, int]) -> int:
        if (matrix := _to_region(context)) is None:
            return -1
        first, second = _line(context, matrix)
        along = (second - first) / max(np.hypot(*(second - first)), 1e-6)
        offset = np.array(location) - first
        apart, place = abs(along[0] * offset[1] - along[1] * offset[0]), along @ offset
        near = apart <= drawing.ui_scale() * _REACH and 0 <= place <= np.hypot(*(second - first))
        return 0 if near else -1

    def invoke(self, context: Context, _event: Event) -> set[str]:
        self.before = context.window_manager.virtual_shutter.split
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event, _tweak: set[str]) -> set[str]:
        if (matrix := _to_region(context)) is not None:
            at = on_picture(matrix, event.mouse_region_x, event.mouse_region_y)
            context.window_manager.virtual_shutter.split = at[0]
        return {"RUNNING_MODAL"}

    def exit(self, context: Context, cancel: bool) -> None:
        if cancel:
            context.window_manager.virtual_shutter.split = self.before


class SHUTTER_GGT_split(InPreview, GizmoGroup):
    bl_label = "Split View"
    gizmo = SHUTTER_GT_split

    @classmethod
    def poll(cls, context: Context) -> bool:
        settings = context.window_manager.virtual_shutter
        return settings.live and settings.view == "SPLIT" and preview_areas.shown(context) is not None


classes = own_classes(globals())
