"""Blender's masks as plain data at any of their frames, whatever frame Blender itself is at.

Python's API has neither the shape keys of a mask nor where its parents were when they got their children: both are read
from Blender's memory (struct_dna), and checked against what the API has. Where shape keys cannot be read, a mask is
taken as Blender has it when it is read, at whatever frame that is.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import chain
from typing import NamedTuple

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from numpy.typing import ArrayLike

from ...core.masks import mask_handles, mask_outlines
from ...core.masks.mask import MaskLayer, MaskShape, MaskSpline
from ...core.messages import EffectError
from . import fcurves
from .struct_dna import LayoutError, memory, read, record, text

# Coordinates that are farther off are no mask of any picture.
_FARTHEST = 1e4
# Numbers of a point in a shape key: two handles with the point between them, weight and radius.
_SHAPE_NUMBERS = 8


# Records of Blender's memory with their fields, as struct_dna.record takes them.
_LAYER = "MaskLayer", "char name[64]", "ListBase splines", "ListBase splines_shapes"
_LINKS = "MaskLayerShape *next", "MaskLayerShape *prev"
_SHAPE = "MaskLayerShape", *_LINKS, "float *data", "int tot_vert", "int frame"
# Where the track was (in mask space), or the plane's corners (in the clip).
_PLACES = "float parent_orig[2]", "float parent_corners_orig[4][2]"
_PARENT = "MaskParent", "ID *id", "char parent[64]", "char sub_parent[64]", *_PLACES


class _Shape(NamedTuple):
    """A shape key: its frame, how many points it has, and where their numbers lie."""

    frame: int
    points: int
    address: int

    @property
    def numbers(self) -> np.ndarray:
        """(points, 8) float32."""
        size = self.points * _SHAPE_NUMBERS * np.dtype(np.float32).itemsize
        return np.frombuffer(memory(self.address, size), np.float32).reshape(-1, _SHAPE_NUMBERS)


def mask_at(mask: bpy.types.Mask, frame: float) -> MaskShape:
    """A mask at one of its frames: shape keys, handles, parents and the layers' animated opacity are evaluated.

    EffectError: its points or opacities are no usable numbers, or its parents cannot be read in this Blender.
    """
    layers = [(layer, _shapes(layer)) for layer in mask.layers if not layer.hide_render]
    shown = tuple(_layer_at(mask, layer, shapes or [], frame) for layer, shapes in layers)
    return MaskShape(shown, is_current=any(shapes is None for _layer, shapes in layers))


def motion(mask: bpy.types.Mask) -> Iterator[tuple]:
    """What lets a mask differ from frame to frame, F-curves apart: its shape keys, and the markers of its parents."""
    for layer in mask.layers:
        for shape in _shapes(layer) or ():
            yield shape.frame, shape.numbers.tobytes()
    for track in _tracks(mask):
        place = ("corners", 8) if isinstance(track, bpy.types.MovieTrackingPlaneTrack) else ("co", 2)
        yield tuple(numbers.tobytes() for numbers in _markers(track, *place))


def _tracks(mask: bpy.types.Mask) -> Iterator[bpy.types.MovieTrackingTrack]:
    """The tracks, of points and planes, that are parents of a mask's points."""
    points = [point for layer in mask.layers for spline in layer.splines for point in spline.points]
    for clip, name, track in {(p.parent.id, p.parent.parent, p.parent.sub_parent) for p in points}:
        tracked = clip.tracking.objects.get(name) if isinstance(clip, bpy.types.MovieClip) else None
        for tracks in (tracked.tracks, tracked.plane_tracks) if tracked else ():
            if track in tracks:
                yield tracks[track]


def key_frames(mask: bpy.types.Mask) -> list[float]:
    """The frames of a mask at which something is said of it: shape keys, keys of its F-curves, markers of its parents,
    of these every tenth."""
    keyed = {float(shape.frame) for layer in mask.layers for shape in _shapes(layer) or ()}
    keyed |= set(fcurves.key_frames(fcurves.curves_under(mask, "")))
    for track in _tracks(mask):
        keyed |= {float(marker.frame) for marker in list(track.markers)[::10]}
    return sorted(keyed)


def moves(mask: bpy.types.Mask) -> bool:
    """Whether a mask may differ from frame to frame."""
    return bool(fcurves.curves_under(mask, "")) or next(motion(mask), None) is not None


def _layer_at(mask: bpy.types.Mask, layer: bpy.types.MaskLayer, shapes: list[_Shape], frame: float) -> MaskLayer:
    keyed = _keyed_points(layer, shapes, frame)
    splines, at = [], 0
    for spline in layer.splines:
        count = len(spline.points)
        splines.append(_spline_at(mask, spline, frame, None if keyed is None else keyed[at : at + count]))
        at += count
    return MaskLayer(
        splines=tuple(splines),
        alpha=float(_checked(mask, _alpha_at(mask, layer, frame))),
        holes=layer.use_fill_holes,
        overlap=layer.use_fill_overlap,
        **{name: getattr(layer, name) for name in ("blend", "invert", "falloff", "fill_solver")},
    )


def _alpha_at(mask: bpy.types.Mask, layer: bpy.types.MaskLayer, frame: float) -> float:
    path = f'layers["{bpy.utils.escape_identifier(layer.name)}"].alpha'
    curve = fcurves.find_curve(mask, path)
    return layer.alpha if curve is None or curve.mute or curve.is_empty else curve.evaluate(frame)


def _spline_at(
    mask: bpy.types.Mask, spline: bpy.types.MaskSpline, frame: float, keyed: np.ndarray | None
) -> MaskSpline:
    """keyed: its points by shape keys, as `_keyed_points` has them; None: as they stand."""
    points, weights = _standing_points(spline) if keyed is None else (keyed[:, :6].reshape(-1, 3, 2), keyed[:, 6])
    types = np.stack([_numbers(spline, f"handle_{side}_type", np.int32) for side in ("left", "right")], axis=1)
    selected = _numbers(spline, "select_left_handle", bool)
    points = mask_handles.with_handles(points, types, selected, spline.use_cyclic)
    longest = 0.0
    if families := _families(mask, spline):
        longest = mask_outlines.longest_segment(points, spline.use_cyclic)
        for parent, raw, here in families:
            points[here] = mask_handles.moved(points[here], _parent_matrix(parent, raw, frame))
        is_computed = np.isin(types[:, 0], (mask_handles.AUTO, mask_handles.VECTOR))
        computed = mask_handles.with_handles(points, types, selected, spline.use_cyclic)
        points = np.where(is_computed[:, None, None], computed, points)
    feathers = tuple(tuple((f.u, f.weight) for f in point.feather_points) for point in spline.points)
    _checked(mask, [*points.flat, *weights, *chain(*chain(*feathers))])
    return MaskSpline(
        points=tuple(tuple(map(tuple, point)) for point in points.tolist()),
        weights=tuple(weights.tolist()),
        feathers=feathers,
        cyclic=spline.use_cyclic,
        fill=spline.use_fill,
        offset_mode=spline.offset_mode,
        weight_interpolation=spline.weight_interpolation,
        collapse=spline.use_self_intersection_check,
        longest=longest,
    )


def _standing_points(spline: bpy.types.MaskSpline) -> tuple[np.ndarray, np.ndarray]:
    places = [_numbers(spline, name, np.float32, 2) for name in ("handle_left", "co", "handle_right")]
    return np.stack(places, axis=1).astype(np.float64), _numbers(spline, "weight", np.float32).astype(np.float64)


def _numbers(spline: bpy.types.MaskSpline, name: str, kind: type, size: int = 1) -> np.ndarray:
    """A property of all points of a spline: (n,), or (n, size)."""
    numbers: np.ndarray = np.empty(len(spline.points) * size, kind)
    spline.points.foreach_get(name, numbers)
    return numbers if size == 1 else numbers.reshape(-1, size)


def _checked(mask: bpy.types.Mask, numbers: ArrayLike) -> np.ndarray:
    """Numbers of a mask. EffectError: one is none, or too far off."""
    numbers = np.asarray(numbers, np.float64)
    if not (np.abs(numbers) <= _FARTHEST).all():
        sentence = rpt_('mask "{mask}": a point, a feather or an opacity is not a usable number')
        raise EffectError(sentence.format(mask=mask.name))
    return numbers


def _keyed_points(layer: bpy.types.MaskLayer, shapes: list[_Shape], frame: float) -> np.ndarray | None:
    """The points of all splines of a layer (n, 8) by its shape keys, which are held before the first and behind the
    last; None where it has none that fit."""
    if not shapes:
        return None
    place = bisect_right([shape.frame for shape in shapes], frame)
    before, after = shapes[max(place - 1, 0)], shapes[min(place, len(shapes) - 1)]
    count = sum(len(spline.points) for spline in layer.splines)
    if before.points != count or after.points != count:
        return None
    first, last = (shape.numbers.astype(np.float64) for shape in (before, after))
    share = (frame - before.frame) / max(after.frame - before.frame, 1) if frame > before.frame else 0.0
    return first + (last - first) * share


def _shapes(layer: bpy.types.MaskLayer) -> list[_Shape] | None:
    """The shape keys of a layer, in order, from Blender's memory; None: they cannot be read in this Blender. No address
    is followed before the record that has it was found to be what the API says, or what leads there."""
    if not layer.splines:
        return []
    try:
        kind, raw = record(*_SHAPE), read(record(*_LAYER), layer.as_pointer())
    except LayoutError:
        return None
    ends = layer.splines[0].as_pointer(), layer.splines[-1].as_pointer()
    if text(raw["name"]) != layer.name.encode() or tuple(raw["splines"].tolist()) != ends:
        return None
    shapes: list[_Shape] = []
    (address, last), before = raw["splines_shapes"].tolist(), 0
    while address:
        following, previous, data, points, frame = read(kind, address).tolist()
        ascends = not shapes or shapes[-1].frame < frame
        if previous != before or points < 0 or not data or not ascends:
            return None
        shapes.append(_Shape(frame, points, data))
        before, address = address, following
    return shapes if last == before else None


def _families(
    mask: bpy.types.Mask, spline: bpy.types.MaskSpline
) -> list[tuple[bpy.types.MaskParent, np.void, list[int]]]:
    """The tracks of clips that are parents of a spline's points: each as Python has it, as it lies in memory, and the
    indices of its children. EffectError: not in this Blender."""
    children: dict = {}
    for index, point in enumerate(spline.points):
        if point.parent.id is not None and point.parent.id_type == "MOVIECLIP":
            raw = _parent_of(mask, point.parent)
            children.setdefault(raw.tobytes(), (point.parent, raw, []))[2].append(index)
    return list(children.values())


def _parent_of(mask: bpy.types.Mask, parent: bpy.types.MaskParent) -> np.void:
    """EffectError: it cannot be read in this Blender."""
    with suppress(LayoutError):
        raw = read(record(*_PARENT), parent.as_pointer())
        names = parent.parent.encode(), parent.sub_parent.encode()
        if raw["id"] == parent.id.as_pointer() and (text(raw["parent"]), text(raw["sub_parent"])) == names:
            return raw
    sentence = rpt_(
        'mask "{mask}": the parents of its points cannot be read in this version of Blender, but a film of its Mask'
        " strip can be the matte"
    )
    raise EffectError(sentence.format(mask=mask.name))


def _parent_matrix(parent: bpy.types.MaskParent, raw: np.void, frame: float) -> np.ndarray:
    """How a track (3, 3) has moved its children since they got it, in mask space; no motion where there is none."""
    clip, matrix = parent.id, np.eye(3)
    tracked = clip.tracking.objects.get(parent.parent)
    if tracked is None:
        return matrix
    to_mask = _mask_from_clip(clip)
    if parent.type == "POINT_TRACK":
        track = tracked.tracks.get(parent.sub_parent)
        if track is not None and len(track.markers):
            at = _between_markers(track, "co", 2, frame - clip.frame_start + 1, _halved) + track.offset
            matrix[:2, 2] = mask_handles.moved(at, to_mask) - raw["parent_orig"]
        return matrix
    track = tracked.plane_tracks.get(parent.sub_parent)
    if track is None or not len(track.markers):
        return matrix
    # Here Blender does not ask on which frame the clip starts.
    now = _between_markers(track, "corners", 8, frame, _last_until).reshape(4, 2)
    if clip.size[0] and to_mask[0, 0] < 1:
        # Blender takes the inverse for pictures higher than wide, where planes move their children less than they do.
        to_mask = np.linalg.inv(to_mask)
    return to_mask @ mask_handles.homography(raw["parent_corners_orig"], now) @ np.linalg.inv(to_mask)


def _between_markers(
    track: bpy.types.MovieTrackingTrack, name: str, size: int, frame: float, find: Callable
) -> np.ndarray:
    """A property (size,) of a track's marker at a frame of the clip: what lies between those of two consecutive frames,
    elsewhere that of the one which `find` finds."""
    frames, values = _markers(track, name, size)
    values = values.astype(np.float64)
    whole = int(frame)
    index = min(max(find(frames.tolist(), whole), 0), len(frames) - 1)
    if index + 1 < len(frames) and frames[index + 1] == frames[index] + 1:
        return values[index] + (values[index + 1] - values[index]) * (frame - whole)
    return values[index]


def _markers(track: bpy.types.MovieTrackingTrack, name: str, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Of a track's markers the frames (n,), and a property (n, size)."""
    frames, values = np.empty(len(track.markers), np.int32), np.empty((len(track.markers), size), np.float32)
    track.markers.foreach_get("frame", frames)
    track.markers.foreach_get(name, values.reshape(-1))
    return frames, values


def _last_until(frames: list[int], frame: int) -> int:
    return bisect_right(frames, frame) - 1


def _halved(frames: list[int], frame: int) -> int:
    """The search of Blender for a track's marker: in gaps it ends on either side of them, by the number of markers."""
    left, right = 0, len(frames)
    while left < right:
        middle = (left + right) // 2
        if frames[middle] == frame:
            return middle
        left, right = (middle + 1, right) if frames[middle] < frame else (left, middle - 1)
    return right


def _mask_from_clip(clip: bpy.types.MovieClip) -> np.ndarray:
    """The matrix (3, 3) from fractions of a clip's picture to mask space."""
    width, height = clip.size
    height *= clip.display_aspect[1] / clip.display_aspect[0] / clip.tracking.camera.pixel_aspect
    x, y = np.array((width, height)) / (max(width, height) or 1) if width and height else (1.0, 1.0)
    return np.array([[x, 0, (1 - x) / 2], [0, y, (1 - y) / 2], [0, 0, 1]])
