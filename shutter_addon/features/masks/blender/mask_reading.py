"""Read Blender's masks as plain data: those that stand still, or at frames of a scene.

Python's API has a mask only at a scene's frame. So a mask that moves is no matte, but can become an outline.
"""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from numpy.typing import ArrayLike

from ....blender.data import fcurves
from ....blender.data.struct_dna import LayoutError, read, record
from ....core.messages import EffectError
from ....core.model.masks import MaskLayer, MaskShape, MaskSpline

_FARTHEST = 1e4  # of coordinates, in pictures


def still_mask(mask: bpy.types.Mask) -> MaskShape:
    """Return a mask that does not move. EffectError: it does, or a number is not usable."""
    points = (point for layer in mask.layers for spline in layer.splines for point in spline.points)
    is_keyed = fcurves.curves_under(mask, "") or any(map(_has_shape_keys, mask.layers))
    if is_keyed or any(point.parent.id is not None for point in points):
        sentence = rpt_('mask "{mask}" moves: use "Outline from Mask", or take a film of its Mask strip for the matte')
        raise EffectError(sentence.format(mask=mask.name))
    return _shape(mask)


def at_frames(mask: bpy.types.Mask, frames: Iterable[int]) -> Iterator[MaskShape]:
    """Yield a mask at its frames, as Blender evaluates it. EffectError: a number is not usable."""
    scene = bpy.data.scenes.new("mask")
    try:
        for frame in frames:
            scene.frame_set(frame)
            yield _shape(mask.evaluated_get(scene.view_layers[0].depsgraph))
    finally:
        bpy.data.scenes.remove(scene)


def _has_shape_keys(layer: bpy.types.MaskLayer) -> bool:
    """Tell whether a layer has shape keys. The API lacks them; False also where its memory cannot be read."""
    with suppress(LayoutError):
        (ends,) = read(record("MaskLayer", ("ListBase splines_shapes", "2u8")), layer.as_pointer())
        return any(ends)
    return False


def _shape(mask: bpy.types.Mask) -> MaskShape:
    return MaskShape(tuple(_layer(mask, layer) for layer in mask.layers if not layer.hide_render))


def _layer(mask: bpy.types.Mask, layer: bpy.types.MaskLayer) -> MaskLayer:
    _check(mask, layer.alpha)
    return MaskLayer(
        splines=tuple(_spline(mask, spline) for spline in layer.splines if spline.use_fill),
        alpha=layer.alpha,
        holes=layer.use_fill_holes,
        **{name: getattr(layer, name) for name in ("blend", "invert", "falloff", "fill_solver")},
    )


def _spline(mask: bpy.types.Mask, spline: bpy.types.MaskSpline) -> MaskSpline:
    places = [fcurves.numbers(spline.points, name, size=2) for name in ("handle_left", "co", "handle_right")]
    points, weights = np.stack(places, axis=1), fcurves.numbers(spline.points, "weight")
    feathers = tuple(tuple((f.u, f.weight) for f in point.feather_points) for point in spline.points)
    _check(mask, [*points.flat, *weights, *chain(*chain(*feathers))])
    return MaskSpline(
        points=tuple(tuple(map(tuple, point)) for point in points.tolist()),
        weights=tuple(weights.tolist()),
        feathers=feathers,
        cyclic=spline.use_cyclic,
        weight_interpolation=spline.weight_interpolation,
    )


def _check(mask: bpy.types.Mask, values: ArrayLike) -> None:
    """Raise EffectError for a number of a mask that is not finite, or too far away."""
    if not (np.abs(np.asarray(values, np.float64)) <= _FARTHEST).all():
        sentence = rpt_('mask "{mask}": a point, a feather or an opacity is not a usable number')
        raise EffectError(sentence.format(mask=mask.name))
