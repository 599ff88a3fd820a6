"""Read Blender's masks as plain data at any of their frames.

Python's API has a mask only at Blender's current frame. So its shape keys are read from Blender's memory (struct_dna),
and checked against the API. Points with parents are refused.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from itertools import accumulate, chain

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from numpy.typing import ArrayLike

from ...core.messages import EffectError
from ...core.model.masks import MaskLayer, MaskShape, MaskSpline
from . import fcurves
from .struct_dna import LayoutError, memory, read, record, text

_FARTHEST = 1e4  # of coordinates, in pictures
_SHAPE_NUMBERS = 8  # float32 of a point in a shape key: left handle, point, right handle, weight, radius

# Records of Blender's memory, for struct_dna.record.
_LAYER = ("char name[64]", "S64"), ("ListBase splines", "2u8"), ("ListBase splines_shapes", "2u8")
_SHAPE = (
    *(("MaskLayerShape *next", "u8"), ("MaskLayerShape *prev", "u8"), ("float *data", "u8")),
    *(("int tot_vert", "i4"), ("int frame", "i4")),
)

Shapes = dict[int, np.ndarray]  # shape keys by frame, ascending: (points, 8) float32


def mask_at(mask: bpy.types.Mask, frame: float) -> MaskShape:
    """Return a mask at one of its frames, with shape keys and the layers' animated opacity.

    Raises:
        EffectError: A number is not usable, shape keys cannot be read, or a point has a parent.
    """
    return MaskShape(tuple(_layer_at(mask, layer, frame) for layer in mask.layers if not layer.hide_render))


def motion(mask: bpy.types.Mask) -> Iterator[tuple]:
    """Yield the shape keys of a mask, for comparisons. EffectError: they cannot be read."""
    for layer in mask.layers:
        for frame, points in _shapes(mask, layer).items():
            yield frame, points.tobytes()


def key_frames(mask: bpy.types.Mask) -> list[float]:
    """Return the frames with shape keys or keys of F-curves; without any, the mask never changes.

    Raises:
        EffectError: Shape keys cannot be read.
    """
    keyed = {float(frame) for layer in mask.layers for frame in _shapes(mask, layer)}
    return sorted(keyed.union(fcurves.key_frames(fcurves.curves_under(mask, ""))))


def _layer_at(mask: bpy.types.Mask, layer: bpy.types.MaskLayer, frame: float) -> MaskLayer:
    points = _keyed_points(layer, _shapes(mask, layer), frame)
    if points is None:
        points = np.concatenate([np.empty((0, 7)), *map(_points, layer.splines)])
    ends = accumulate(len(spline.points) for spline in layer.splines)
    splines = zip(layer.splines, np.split(points, list(ends)), strict=False)
    return MaskLayer(
        splines=tuple(_spline(mask, spline, own) for spline, own in splines),
        alpha=float(_checked(mask, _alpha_at(mask, layer, frame))),
        holes=layer.use_fill_holes,
        **{name: getattr(layer, name) for name in ("blend", "invert", "falloff", "fill_solver")},
    )


def _alpha_at(mask: bpy.types.Mask, layer: bpy.types.MaskLayer, frame: float) -> float:
    path = f'layers["{bpy.utils.escape_identifier(layer.name)}"].alpha'
    curve = fcurves.find_curve(mask, path)
    return layer.alpha if curve is None or curve.mute or curve.is_empty else curve.evaluate(frame)


def _spline(mask: bpy.types.Mask, spline: bpy.types.MaskSpline, numbers: np.ndarray) -> MaskSpline:
    """Return a spline with these points (n, 7 or more): left handle, point, right handle, weight."""
    if any(point.parent.id is not None for point in spline.points):
        sentence = rpt_(
            'mask "{mask}": parents of its points are not followed, but a film of its Mask strip can be the matte'
        )
        raise EffectError(sentence.format(mask=mask.name))
    points, weights = numbers[:, :6].reshape(-1, 3, 2), numbers[:, 6]
    feathers = tuple(tuple((f.u, f.weight) for f in point.feather_points) for point in spline.points)
    _checked(mask, [*points.flat, *weights, *chain(*chain(*feathers))])
    return MaskSpline(
        points=tuple(tuple(map(tuple, point)) for point in points.tolist()),
        weights=tuple(weights.tolist()),
        feathers=feathers,
        cyclic=spline.use_cyclic,
        fill=spline.use_fill,
        weight_interpolation=spline.weight_interpolation,
    )


def _points(spline: bpy.types.MaskSpline) -> np.ndarray:
    places = [fcurves.numbers(spline.points, name, size=2) for name in ("handle_left", "co", "handle_right")]
    return np.column_stack([*places, fcurves.numbers(spline.points, "weight")]).astype(np.float64)


def _checked(mask: bpy.types.Mask, values: ArrayLike) -> np.ndarray:
    """Return numbers of a mask as an array. EffectError: one is not finite, or too far away."""
    values = np.asarray(values, np.float64)
    if not (np.abs(values) <= _FARTHEST).all():
        sentence = rpt_('mask "{mask}": a point, a feather or an opacity is not a usable number')
        raise EffectError(sentence.format(mask=mask.name))
    return values


def _keyed_points(layer: bpy.types.MaskLayer, shapes: Shapes, frame: float) -> np.ndarray | None:
    """Return the points (n, 8) of all splines of a layer by its shape keys; None: it has none that fit.

    Before the first and after the last shape key, that one holds.
    """
    if not shapes:
        return None
    frames, count = list(shapes), sum(len(spline.points) for spline in layer.splines)
    place = bisect_right(frames, frame)
    before, after = frames[max(place - 1, 0)], frames[min(place, len(frames) - 1)]
    if any(len(shapes[each]) != count for each in (before, after)):
        return None
    first, last = shapes[before].astype(np.float64), shapes[after].astype(np.float64)
    share = (frame - before) / max(after - before, 1) if frame > before else 0.0
    return first + (last - first) * share


def _shapes(mask: bpy.types.Mask, layer: bpy.types.MaskLayer) -> Shapes:
    """Return the shape keys of a layer. EffectError: this Blender stores them differently."""
    try:
        return _shapes_in_memory(layer) if layer.splines else {}
    except LayoutError:
        sentence = rpt_(
            'mask "{mask}": its shape keys cannot be read in this version of Blender, but a film of its Mask strip can'
            " be the matte"
        )
        raise EffectError(sentence.format(mask=mask.name)) from None


def _shapes_in_memory(layer: bpy.types.MaskLayer) -> Shapes:
    """Read the shape keys of a layer. LayoutError: they are not stored as expected.

    Every record is compared with the API, or with the record before it, before its pointers are followed.
    """
    kind = record("MaskLayerShape", *_SHAPE)
    name, splines, (address, last) = read(record("MaskLayer", *_LAYER), layer.as_pointer())
    ends = [layer.splines[0].as_pointer(), layer.splines[-1].as_pointer()]
    if text(name) != layer.name.encode() or splines != ends:
        raise LayoutError("MaskLayer")
    shapes: Shapes = {}
    before = 0
    while address:
        following, previous, data, points, frame = read(kind, address)
        if previous != before or points < 0 or not data or (shapes and frame <= next(reversed(shapes))):
            raise LayoutError("MaskLayerShape")
        shapes[frame] = np.frombuffer(memory(data, 4 * _SHAPE_NUMBERS * points), np.float32).reshape(-1, _SHAPE_NUMBERS)
        before, address = address, following
    if last != before:
        raise LayoutError("MaskLayerShape")
    return shapes
