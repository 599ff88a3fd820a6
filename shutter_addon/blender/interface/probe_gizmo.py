"""Gizmos of the probe, which shows the shutter of the pixel under the pointer, and of the split view's handle."""

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np
from bpy.types import Context, Event, Gizmo, GizmoGroup, PropertyGroup, Region

from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core.pixels import compositor
from ..data import annotations, preview_areas
from ..devices import blender_gpu
from ..rendering import effect_source, previews, sessions
from . import drawing
from .drawing import Box
from .gizmo_groups import Dragged, InPreview, View, view

_WIDTH, _HEIGHT, _LINE, _PAD, _APART = 180, 64, 17, 8, 14  # interface units
_REACH = 8  # interface units from the pointer to the split's handle
_MARK = (1.0, 1.0, 1.0, 0.9)


def probed_at(renderer: Renderer, request: Request, point: Sequence[float]) -> tuple[np.ndarray, np.ndarray] | None:
    """Return how a pixel is exposed: its share of each shutter, and the weight of each frame that results.

    Call this only while Blender draws, because one texel is read from its GPU. The shares are computed again only if
    something changed since they were drawn. Layers are ignored.

    Args:
        point: (x, y) in fractions of the picture, y up.

    Returns:
        The share of each of N shutters (N,), with the sum 1, and the weight of each of the L frames of the window (L,).
        None: the point is outside the picture.
    """
    source = renderer.source
    column, row = int(np.floor(point[0] * source.width)), int(np.floor((1 - point[1]) * source.height))
    if not (0 <= column < source.width and 0 <= row < source.height):
        return None
    texture, block = renderer.drawn_coefficients(replace(request, quick=True))
    values = blender_gpu.texel(texture, column // block, row // block)[: len(request.state.bars)]
    values = np.maximum(values, 0).astype(np.float64)
    coefficients = values / values.sum()
    return coefficients, compositor.mixed_shutter(renderer.slid(request, known=True).state, coefficients)


def layout(point: Sequence[float], size: tuple[int, int], count: int, unit: float) -> tuple[Box, Box, list[float]]:
    """Return where the probe and its parts are drawn, in pixels of the preview's region, y up.

    The box lies at the lower right of the point, or on the other side if there is no room.

    Args:
        point: The point that is probed, in the same pixels.
        size: Width and height of the region.
        count: Number of lines of text.
        unit: Pixels per interface unit.

    Returns:
        The box around everything, the box of the bars, and the y of the bottom of each line of text.
    """
    width, height = (_WIDTH + 2 * _PAD) * unit, (_HEIGHT + count * _LINE + 3 * _PAD) * unit
    x, y = point
    apart, pad = _APART * unit, _PAD * unit
    left = x + apart if x + apart + width <= size[0] else x - apart - width
    top = y - apart if y - apart - height >= 0 else y + apart + height
    left, top = max(left, 0.0), max(min(top, size[1]), height)
    bars = left + pad, top - pad - _HEIGHT * unit, left + width - pad, top - pad
    lines = [bars[1] - pad - (i + 1) * _LINE * unit for i in range(count)]
    return (left, top - height, left + width, top), bars, lines


def _view(context: Context) -> View | None:
    """Return where the preview shows the effect's picture. None: it shows no effect, or View.matrix has no inverse."""
    if (shown := preview_areas.shown(context)) is None:
        return None
    seen = view(shown.effect, shown.strip, context.region)
    return seen if annotations.is_invertible(seen.matrix) else None


class SHUTTER_GT_probe(Gizmo):
    """The probe: bars and shares of the pixel under the pointer. It lets clicks through."""

    def draw(self, context: Context) -> None:
        shown, at = preview_areas.shown(context), tuple(context.window_manager.virtual_shutter.probe_at)
        if shown is None or (seen := _view(context)) is None:
            return
        try:
            request = previews.request_of(context, shown)
            probed = probed_at(sessions.of_drawing().renderer(request), request, at)
        except effect_source.FAULTS:  # the live preview shows the error
            return
        if probed is not None:
            (point,) = seen.on_region([at])
            _draw(context.region, point, shown.effect.shutters, *probed)

    def test_select(self, context: Context, location: tuple[int, int]) -> int:
        """Store the pointer's position as the probe's, and return -1: the pointer is not over this gizmo.

        Blender calls this whenever the pointer moves. Callbacks that handle events would take clicks from other tools.
        """
        if (seen := _view(context)) is not None:
            x, y = location
            context.window_manager.virtual_shutter.probe_at = seen.on_picture(x + 0.5, y + 0.5)
        return -1


def _draw(region: Region, point: Sequence, shutters: Sequence, shares: np.ndarray, mixed: np.ndarray) -> None:
    """Draw the probe: a cross at the pixel, and a box with its mixed shutter as bars and a line for each share.

    Args:
        region: The preview's region.
        point: The probed point, in pixels of the region.
        shutters: The effect's N shutters.
        shares: The pixel's share of each shutter (N,), with the sum 1.
        mixed: The weight of each frame of the window for the pixel (L,), one bar each.
    """
    unit = drawing.ui_scale()
    frame, bars, lines = layout(point, (region.width, region.height), len(shutters), unit)
    colors = np.array([shutter.color for shutter in shutters])
    (x, y), arm = point, 6 * unit
    drawing.lines([(x - arm, y), (x + arm, y)], _MARK, width=1)
    drawing.lines([(x, y - arm), (x, y + arm)], _MARK, width=1)
    drawing.rectangles([frame], [drawing.BACK])
    drawing.bars(bars, mixed / max(1.0, mixed.max()), (*(shares @ colors), 0.95))
    left = bars[0]
    for i, (bottom, shutter, share) in enumerate(zip(lines, shutters, shares, strict=True)):
        drawing.swatch(left, bottom - unit, 12 * unit, shutter, i)
        drawing.text(left + 18 * unit, bottom, f"{share:.1%}  {shutter.name}", until=bars[2])


class SHUTTER_GGT_probe(InPreview, GizmoGroup):
    bl_label = "Probe"
    gizmo = SHUTTER_GT_probe

    @classmethod
    def is_wanted(cls, live: PropertyGroup) -> bool:
        return live.probe and not bpy.app.is_job_running("RENDER")


class SHUTTER_GT_split(Dragged, Gizmo):
    seen = staticmethod(_view)

    def show(self, context: Context, seen: View) -> None:
        at = context.window_manager.virtual_shutter.split
        first, (x, y), last = seen.on_region([(at, 0.0), (at, 0.5), (at, 1.0)])
        half = drawing.ui_scale() * _REACH / 2
        drawing.lines([first, last], _MARK, width=2 if self.is_highlight else 1)
        drawing.rectangles([(x - half, y - 3 * half, x + half, y + 3 * half)], [_MARK])

    def is_at(self, context: Context, seen: View, location: tuple[int, int]) -> bool:
        x, y = seen.on_picture(*location)
        apart = abs(x - context.window_manager.virtual_shutter.split) * np.hypot(*seen.matrix[:2, 0])
        return bool(apart <= drawing.ui_scale() * _REACH and 0 <= y <= 1)

    def grab(self, context: Context, _event: Event, _seen: View) -> None:
        self.before = context.window_manager.virtual_shutter.split

    def drag(self, context: Context, event: Event, _tweak: set[str]) -> None:
        if (seen := _view(context)) is not None:
            x, _y = seen.on_picture(event.mouse_region_x, event.mouse_region_y)
            context.window_manager.virtual_shutter.split = x

    def exit(self, context: Context, cancel: bool) -> None:
        if cancel:
            context.window_manager.virtual_shutter.split = self.before


class SHUTTER_GGT_split(InPreview, GizmoGroup):
    bl_label = "Split View"
    gizmo = SHUTTER_GT_split

    @classmethod
    def is_wanted(cls, live: PropertyGroup) -> bool:
        return live.view == "SPLIT"
