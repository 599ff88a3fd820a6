"""The probe: a pixel's shutter as bars, and its coefficients as shares, beside it in the preview."""

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, Gizmo, GizmoGroup, PropertyGroup, Region, Strip

from ...compute import plates
from ...core.model.scribbles import mapped
from ..data import annotations, geometry, preview_areas
from ..rendering import effect_source, previews, probe, sessions
from . import drawing
from .gizmo_groups import InPreview, on_picture, to_region
from .operator_bases import own_classes

_WIDTH, _HEIGHT, _LINE, _PAD, _APART = 180, 64, 17, 8, 14  # in units of the interface
_MARK = (1.0, 1.0, 1.0, 0.9)


@dataclass(frozen=True)
class Layout:
    """Where the probe's box, its bars and its lines of text lie, in pixels of the region.

    frame, bars: left, bottom, right, top; lines: the bottoms of the lines, from the first on"""

    frame: tuple[float, float, float, float]
    bars: tuple[float, float, float, float]
    lines: tuple[float, ...]


def layout(point: Sequence[float], size: tuple[int, int], count: int, unit: float) -> Layout:
    """The layout for a point of a region of this size with `count` shutters; unit: of the interface, in pixels.

    The box lies at the right of the point and below it, or on the other side where the region ends."""
    width, height = (_WIDTH + 2 * _PAD) * unit, (_HEIGHT + count * _LINE + 3 * _PAD) * unit
    x, y = point
    apart, pad = _APART * unit, _PAD * unit
    left = x + apart if x + apart + width <= size[0] else x - apart - width
    top = y - apart if y - apart - height >= 0 else y + apart + height
    left, top = max(left, 0.0), max(min(top, size[1]), height)
    bars = left + pad, top - pad - _HEIGHT * unit, left + width - pad, top - pad
    lines = tuple(bars[1] - pad - (i + 1) * _LINE * unit for i in range(count))
    return Layout((left, top - height, left + width, top), bars, lines)


def _to_region(context: Context, shown: preview_areas.Shown) -> np.ndarray | None:
    """Matrix from fractions of the shown picture to the region's pixels; None: nothing is seen of it."""
    matrix = to_region(shown.effect, shown.strip, context.region)
    return matrix if geometry.is_invertible(matrix) else None


def _is_cropped(strip: Strip, size: tuple[int, int], point: Sequence[float]) -> bool:
    crop, (x, y) = strip.crop, np.asarray(point) * size
    return not (crop.min_x <= x < size[0] - crop.max_x and crop.min_y <= y < size[1] - crop.max_y)


class SHUTTER_GT_probe(Gizmo):
    """It follows the pointer, and is never hit: clicks go to whatever lies there."""

    def draw(self, context: Context) -> None:
        shown, at = preview_areas.shown(context), tuple(context.window_manager.virtual_shutter.probe_at)
        if shown is None or (matrix := _to_region(context, shown)) is None:
            return
        if _is_cropped(shown.strip, annotations.picture_size(shown.effect), at):
            return
        try:
            render = sessions.of_drawing()
            request = previews.request_of(context, shown)
            probed = probe.at(render.renderer(request), request, at)
        except effect_source.FAULTS:  # which the live preview tells
            return
        if probed is not None:
            point = mapped(matrix, np.array([at]))[0]
            _draw(context.region, point, shown.effect.shutters, probed, _of_layers(shown, probed))

    def test_select(self, context: Context, location: tuple[int, int]) -> int:
        """Blender asks whenever the pointer moves: nothing else tells of it without taking events from others."""
        shown = preview_areas.shown(context)
        if shown is not None and (matrix := _to_region(context, shown)) is not None:
            x, y = location
            context.window_manager.virtual_shutter.probe_at = on_picture(matrix, x + 0.5, y + 0.5)
        return -1


def _of_layers(shown: preview_areas.Shown, probed: probe.Probed) -> list[tuple[str, str]]:
    """Of each layer its name and how much of it covers the pixel; and what takes the place of what lies behind."""
    regions = [region for region in shown.effect.regions if region.is_layer and region.opacity > 0]
    lines = [(region.name, f"{share:.1%}") for region, share in zip(regions, probed.layers, strict=False)]
    words = {plates.TAKEN: iface_("Behind: another frame"), plates.FILLED: iface_("Behind: filled")}
    return [*lines, (words[probed.hole], "")] if probed.hole in words else lines


def _draw(
    region: Region,
    point: Sequence[float],
    shutters: Sequence[PropertyGroup],
    probed: probe.Probed,
    of_layers: list[tuple[str, str]],
) -> None:
    unit = drawing.ui_scale()
    place = layout(point, (region.width, region.height), len(shutters) + len(of_layers), unit)
    colors = np.array([shutter.color for shutter in shutters])
    (x, y), arm = point, 6 * unit
    drawing.lines([(x - arm, y), (x + arm, y)], _MARK, width=1)
    drawing.lines([(x, y - arm), (x, y + arm)], _MARK, width=1)
    drawing.rectangles([place.frame], [drawing.BACK])
    shares = probed.bars / max(1.0, probed.bars.max())
    drawing.bars(place.bars, shares, (*(probed.coefficients @ colors), 0.95))
    left, _, right, _ = place.bars
    for bottom, (name, share) in zip(place.lines[len(shutters) :], of_layers, strict=True):
        drawing.text(left, bottom, name, until=right - 44 * unit)
        drawing.text(right - 38 * unit, bottom, share)
    for i, (bottom, shutter, share) in enumerate(zip(place.lines, shutters, probed.coefficients, strict=False)):
        drawing.swatch(left, bottom - unit, 12 * unit, shutter, i)
        drawing.text(left + 18 * unit, bottom, shutter.name, until=right - 44 * unit)
        drawing.text(right - 38 * unit, bottom, f"{share:.1%}")


class SHUTTER_GGT_probe(InPreview, GizmoGroup):
    bl_label = "Probe"
    gizmo = SHUTTER_GT_probe

    @classmethod
    def poll(cls, context: Context) -> bool:
        settings = context.window_manager.virtual_shutter
        if not (settings.live and settings.probe) or bpy.app.is_job_running("RENDER"):
            return False
        return preview_areas.shown(context) is not None


classes = own_classes(globals())
