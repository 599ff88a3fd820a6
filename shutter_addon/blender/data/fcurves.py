"""F-curves of a scene, evaluated at any frame.

The engine gets the effect scene's depsgraph, which does not contain other scenes' animation.
"""

import re
from collections.abc import Sequence
from itertools import pairwise

import bpy
import numpy as np
from bpy.types import PropertyGroup, bpy_prop_collection
from bpy_extras import anim_utils

from ...core.model.keyframes import Ease
from . import validation

# Keyframe.interpolation as a number.
_EASES: dict[int, Ease] = {0: "constant", 1: "linear", 2: "bezier"}


def stretched(scene) -> float:
    """Return the time stretching of Output Properties: how far F-curves advance in a frame of the timeline."""
    render = getattr(scene, "render", None)  # clips have none
    return render.frame_map_old / render.frame_map_new if render else 1.0


class Timed:
    """An F-curve in frames of a scene's timeline, which may be stretched."""

    def __init__(self, curve, scene):
        self._curve, self._pace = curve, stretched(scene)

    def __getattr__(self, name: str):
        return getattr(self._curve, name)

    def evaluate(self, frame: float) -> float:
        return self._curve.evaluate(frame * self._pace)

    def points(self) -> np.ndarray:
        """Return frames and values (n, 2) of the keys."""
        points = points_of(self._curve)
        if self._pace != 1:  # rounded, so that a key set at a whole frame stays there
            points[:, 0] = np.round(points[:, 0] / self._pace, 3)
        return points

    def insert(self, frame: float, value: float, **how):
        """Insert a key as keyframe_points.insert does."""
        return self._curve.keyframe_points.insert(frame * self._pace, value, **how)


class Curves:
    """The F-curves of a scene by path."""

    def __init__(self, scene):
        self._pace = stretched(scene)
        found = (c for c in curves_under(scene, "") if drives(c))
        self._curves = {(c.data_path, c.array_index): c if self._pace == 1 else Timed(c, scene) for c in found}

    def find(self, path: str, index: int = 0):
        """Return the F-curve of a property, or None; muted and empty ones do not count."""
        return self._curves.get((path, index))

    def of(self, owner, path: str, name: str) -> list:
        """Return the F-curves of a property's components. `path` is the owner's, from the scene."""
        length = getattr(owner.bl_rna.properties[name], "array_length", 0)
        all_curves = (self.find(f"{path}.{name}", index) for index in range(max(length, 1)))
        return [curve for curve in all_curves if curve is not None]

    def keys(self, curves: list) -> tuple[tuple[float, Ease], ...]:
        """Return the frames with a key on any of the curves, ascending, with eases as recipes name them.

        The first curve with a key on a frame gives its ease.
        """
        eases: dict[float, Ease] = {}
        for curve in curves:
            frames = (points_of(curve)[:, 0] / self._pace).tolist()
            if not eases.keys() >= set(frames):
                eases = dict(zip(frames, _eases(curve), strict=True)) | eases
        return tuple(sorted(eases.items()))

    def value(self, owner, path: str, name: str, frame: float):
        """Return a float, or a vector as a list, at a frame. `path` is the owner's, from the scene.

        Raises:
            EffectError: It is out of range.
        """
        value = getattr(owner, name)
        if isinstance(value, float):
            return self._component(owner, path, name, 0, frame, value)
        return [self._component(owner, path, name, i, frame, v) for i, v in enumerate(value)]

    def _component(self, owner, path: str, name: str, index: int, frame: float, value: float):
        curve = self.find(f"{path}.{name}", index)
        if curve is not None:
            prop = owner.bl_rna.properties[name]
            # In this order NaN stays NaN, and is refused.
            value = min(max(curve.evaluate(frame), prop.hard_min), prop.hard_max)
        return validation.number(owner, name, value)


def numbers(items: bpy_prop_collection, name: str, kind: type = np.float32, size: int = 1) -> np.ndarray:
    """Return a property of all items: (n,), or (n, size) for a vector; enums as numbers."""
    values: np.ndarray = np.empty(len(items) * size, kind)
    items.foreach_get(name, values)
    return values if size == 1 else values.reshape(-1, size)


def points_of(curve) -> np.ndarray:
    """Return frames and values (n, 2) of an F-curve's keys."""
    return numbers(curve.keyframe_points, "co", size=2)


def _eases(curve) -> list[Ease]:
    """Return the eases of an F-curve's keys as recipes name them; unknown ones become "bezier"."""
    eases = numbers(curve.keyframe_points, "interpolation", np.int32)
    return [_EASES.get(number, "bezier") for number in eases.tolist()]


def progress(curve, first: float, last: float, frame: float) -> float:
    """Return the share 0 to 1 of the way from one value to another that an F-curve has gone at a frame."""
    if abs(last - first) < 1e-9:
        return 0.0
    return min(max((curve.evaluate(frame) - first) / (last - first), 0.0), 1.0)


def set_keys(scene, path: str, index: int, keys: Sequence[tuple[float, float, Ease]], group: str = "") -> None:
    """Replace a property's F-curve by keys: frame, value, and ease of the span that follows."""
    pace = stretched(scene)
    keys = [(frame * pace, value, ease) for frame, value, ease in keys]
    points = new_curve(scene, path, index, group).keyframe_points
    points.add(len(keys))
    points.foreach_set("co", [number for frame, value, _ in keys for number in (frame, value)])
    # Flat handles of a third of the span give u²(3 − 2u), as core.model.keyframes.eased.
    reach = [(b[0] - a[0]) / 3 for a, b in pairwise(keys)]
    for point, (_, _, ease), before, after in zip(points, keys, [1.0, *reach], [*reach, 1.0], strict=True):
        point.interpolation = ease.upper()
        point.handle_left_type = point.handle_right_type = "FREE"
        point.handle_left = point.co[0] - before, point.co[1]
        point.handle_right = point.co[0] + after, point.co[1]


def new_curve(scene, path: str, index: int = 0, group: str = ""):
    """Return a new, empty F-curve for a property, which replaces an old one."""
    bag = _channelbag(scene)
    if (old := bag.fcurves.find(path, index=index)) is not None:
        bag.fcurves.remove(old)
    return bag.fcurves.new(path, index=index, group_name=group)


def ensure_curve(scene, path: str, index: int = 0, group: str = ""):
    """Return the F-curve of a property, made if there is none."""
    return _channelbag(scene).fcurves.ensure(path, index=index, group_name=group)


def find_curve(scene, path: str, index: int = 0):
    """Return the F-curve of a property, muted or not, or None."""
    return next((c for c in curves_under(scene, path) if (c.data_path, c.array_index) == (path, index)), None)


def _channelbag(scene):
    animation = scene.animation_data_create()
    if animation.action is None:
        animation.action = bpy.data.actions.new(f"{scene.name}Action")
    if animation.action_slot is None:
        animation.action_slot = animation.action.slots.new(scene.id_type, scene.name)
    return anim_utils.action_ensure_channelbag_for_slot(animation.action, animation.action_slot)


def remove_curves(scene, path: str) -> None:
    """Remove the F-curves whose path starts with `path`."""
    for curve in curves_under(scene, path):
        _channelbag(scene).fcurves.remove(curve)


def move_curves(scene, path: str, frames: float) -> None:
    """Move the keys of the F-curves whose path starts with `path` in time."""
    frames *= stretched(scene)
    for curve in curves_under(scene, path):
        for point in curve.keyframe_points:
            point.co_ui[0] += frames  # moves the handles, too
        curve.update()


def copy_curves(scene, path: str, new_scene, new_path: str) -> None:
    """Copy the F-curves whose path starts with `path` to the same properties under `new_path`."""
    for curve in curves_under(scene, path):
        new = new_path + curve.data_path.removeprefix(path)
        copy = _channelbag(new_scene).fcurves.new_from_fcurve(curve, data_path=new)
        copy.array_index = curve.array_index


def remove_item(owner: PropertyGroup, collection: str, index: int) -> None:
    """Remove an item of a collection in a scene's property group, with its F-curves."""
    last = len(getattr(owner, collection)) - 1
    move_item(owner, collection, index, last)
    remove_curves(owner.id_data, f"{owner.path_from_id()}.{collection}[{last}]")
    getattr(owner, collection).remove(last)


def move_item(owner: PropertyGroup, collection: str, index: int, to: int) -> None:
    """Move an item of a collection in a scene's property group, with its F-curves."""
    items, path = getattr(owner, collection), f"{owner.path_from_id()}.{collection}"
    order = list(range(len(items)))
    order.insert(to, order.pop(index))
    items.move(index, to)
    item = re.compile(re.escape(path) + r"\[(\d+)\]")
    for curve in curves_under(owner.id_data, f"{path}["):
        match = item.match(curve.data_path)
        if match and int(match[1]) in order:  # else a script made it
            curve.data_path = f"{path}[{order.index(int(match[1]))}]{curve.data_path[match.end() :]}"


def drives(curve) -> bool:
    """Tell whether an F-curve drives its property."""
    return not (curve.mute or curve.is_empty)


def curves_under(scene, path: str) -> list:
    """Return the scene's F-curves whose path starts with `path`."""
    bag = anim_utils.animdata_get_channelbag_for_assigned_slot(scene.animation_data)
    return [curve for curve in bag.fcurves if curve.data_path.startswith(path)] if bag else []
