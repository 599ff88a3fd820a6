"""Read and write the F-curves of a scene: find, evaluate at any timeline frame, key, copy and remove.

F-curves are evaluated here because the engine gets the effect scene's depsgraph, which does not contain the animation
of the scene that has the effect.
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
    """Return how many frames F-curves advance in one timeline frame: *Time Stretching* of Output Properties."""
    render = getattr(scene, "render", None)  # clips have none
    return render.frame_map_old / render.frame_map_new if render else 1.0


class Timed:
    """An F-curve whose `evaluate`, `points` and `insert` use timeline frames, for scenes with *Time Stretching*.

    Keys of F-curves count unstretched frames, which then differ from timeline frames. All other attributes are the
    F-curve's own.
    """

    def __init__(self, curve, scene):
        self._curve, self._pace = curve, stretched(scene)

    def __getattr__(self, name: str):
        return getattr(self._curve, name)

    def evaluate(self, frame: float) -> float:
        return self._curve.evaluate(frame * self._pace)

    def points(self) -> np.ndarray:
        """Return timeline frame and value of each key, (n, 2)."""
        points = points_of(self._curve)
        if self._pace != 1:  # rounded, so that a key set at a whole frame stays there
            points[:, 0] = np.round(points[:, 0] / self._pace, 3)
        return points

    def insert(self, frame: float, value: float, **how):
        """Insert a key at a timeline frame, with the keyword arguments of Blender's keyframe_points.insert."""
        return self._curve.keyframe_points.insert(frame * self._pace, value, **how)


class Curves:
    """The F-curves of a scene, found by data path, in timeline frames. Muted and empty ones are left out."""

    def __init__(self, scene):
        self._pace = stretched(scene)
        found = (c for c in curves_under(scene, "") if drives(c))
        self._curves = {(c.data_path, c.array_index): c if self._pace == 1 else Timed(c, scene) for c in found}

    def find(self, path: str, index: int = 0):
        """Return the F-curve of a property, or None if it has none that is in effect.

        Args:
            path: Data path of the property from the scene.
            index: Component of a vector; 0 for a single number.

        Returns:
            Blender's F-curve, or with *Time Stretching* a Timed that wraps it.
        """
        return self._curves.get((path, index))

    def of(self, owner, path: str, name: str) -> list:
        """Return the F-curves of a property: at most one for a number, one for each keyed component of a vector.

        Args:
            owner: The struct that has the property.
            path: Data path of `owner` from the scene.
            name: Name of the property.
        """
        length = getattr(owner.bl_rna.properties[name], "array_length", 0)
        all_curves = (self.find(f"{path}.{name}", index) for index in range(max(length, 1)))
        return [curve for curve in all_curves if curve is not None]

    def keys(self, curves: list) -> tuple[tuple[float, Ease], ...]:
        """Return (timeline frame, ease) of all keys of some F-curves, frames ascending.

        The ease is the interpolation up to the next key: "constant", "linear" or "bezier". If several curves have a key
        on the same frame, the first curve in the list decides.

        Args:
            curves: F-curves that `find` or `of` returned.
        """
        eases: dict[float, Ease] = {}
        for curve in curves:
            frames = (points_of(curve)[:, 0] / self._pace).tolist()
            if not eases.keys() >= set(frames):
                eases = dict(zip(frames, _eases(curve), strict=True)) | eases
        return tuple(sorted(eases.items()))

    def value(self, owner, path: str, name: str, frame: float):
        """Return the value of a float property, or of a vector as a list, at a timeline frame.

        Where there is an F-curve, its value counts, clamped to the property's range; otherwise the stored value.

        Args:
            owner: The struct that has the property.
            path: Data path of `owner` from the scene.
            name: Name of the property.
            frame: The timeline frame.

        Raises:
            EffectError: A stored value is out of the property's range, or a value is not a number.
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
    """Return a property of all items of a collection: (n,), or (n, size) for a vector; enums as their numbers."""
    values: np.ndarray = np.empty(len(items) * size, kind)
    items.foreach_get(name, values)
    return values if size == 1 else values.reshape(-1, size)


def points_of(curve) -> np.ndarray:
    """Return frame and value of each key of an F-curve, (n, 2), in its own frames: not stretched."""
    return numbers(curve.keyframe_points, "co", size=2)


def _eases(curve) -> list[Ease]:
    """Return how values go on from each key of an F-curve, in the words of recipes; unknown ones become "bezier"."""
    eases = numbers(curve.keyframe_points, "interpolation", np.int32)
    return [_EASES.get(number, "bezier") for number in eases.tolist()]


def progress(curve, first: float, last: float, frame: float) -> float:
    """Return how far an F-curve has come at a frame, 0 to 1, on the way from the value `first` to the value `last`."""
    if abs(last - first) < 1e-9:
        return 0.0
    return min(max((curve.evaluate(frame) - first) / (last - first), 0.0), 1.0)


def set_keys(scene, path: str, index: int, keys: Sequence[tuple[float, float, Ease]], group: str = "") -> None:
    """Give a property an F-curve with these keys, in place of any that it has.

    Args:
        scene: The scene that has the property.
        path: Data path of the property from the scene.
        index: Component of a vector; 0 for a single number.
        keys: For each key, at least one, by ascending frames: its timeline frame, its value, and the ease, which is
            the interpolation up to the next key.
        group: Name of the channel group that Blender's animation editors show it in; "": in none.
    """
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
    """Return a new, empty F-curve for a property. An F-curve that it had is removed."""
    bag = _channelbag(scene)
    if (old := bag.fcurves.find(path, index=index)) is not None:
        bag.fcurves.remove(old)
    return bag.fcurves.new(path, index=index, group_name=group)


def ensure_curve(scene, path: str, index: int = 0, group: str = ""):
    """Return the F-curve of a property. Make an empty one if there is none."""
    return _channelbag(scene).fcurves.ensure(path, index=index, group_name=group)


def find_curve(scene, path: str, index: int = 0):
    """Return the F-curve of a property, muted or not; None: there is none."""
    return next((c for c in curves_under(scene, path) if (c.data_path, c.array_index) == (path, index)), None)


def _channelbag(scene):
    animation = scene.animation_data_create()
    if animation.action is None:
        animation.action = bpy.data.actions.new(f"{scene.name}Action")
    if animation.action_slot is None:
        animation.action_slot = animation.action.slots.new(scene.id_type, scene.name)
    return anim_utils.action_ensure_channelbag_for_slot(animation.action, animation.action_slot)


def remove_curves(scene, path: str) -> None:
    """Remove the scene's F-curves whose data path starts with `path`."""
    for curve in curves_under(scene, path):
        _channelbag(scene).fcurves.remove(curve)


def move_curves(scene, path: str, frames: float) -> None:
    """Move the keys and handles of the F-curves whose data path starts with `path` by some timeline frames."""
    frames *= stretched(scene)
    for curve in curves_under(scene, path):
        for point in curve.keyframe_points:
            point.co_ui[0] += frames  # moves the handles, too
        curve.update()


def copy_curves(scene, path: str, new_scene, new_path: str) -> None:
    """Copy the F-curves whose data path starts with `path` to a scene, with `new_path` in place of `path`."""
    for curve in curves_under(scene, path):
        new = new_path + curve.data_path.removeprefix(path)
        copy = _channelbag(new_scene).fcurves.new_from_fcurve(curve, data_path=new)
        copy.array_index = curve.array_index


def remove_item(owner: PropertyGroup, collection: str, index: int) -> None:
    """Remove an item from a collection property, together with its F-curves.

    Data paths contain an item's index. So the F-curves of later items are changed to their new indices.

    Args:
        owner: The property group that has the collection. It is stored on a scene, which has the F-curves.
        collection: Name of the collection property.
        index: The item's index.
    """
    last = len(getattr(owner, collection)) - 1
    move_item(owner, collection, index, last)
    remove_curves(owner.id_data, f"{owner.path_from_id()}.{collection}[{last}]")
    getattr(owner, collection).remove(last)


def move_item(owner: PropertyGroup, collection: str, index: int, to: int) -> None:
    """Move an item within a collection of a scene's property group to the index `to`. F-curves follow their items."""
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
    """Tell whether an F-curve determines its property's value: it is neither muted nor empty."""
    return not (curve.mute or curve.is_empty)


def curves_under(scene, path: str) -> list:
    """Return the scene's F-curves whose data path starts with `path`; "" gives all."""
    bag = anim_utils.animdata_get_channelbag_for_assigned_slot(scene.animation_data)
    return [curve for curve in bag.fcurves if curve.data_path.startswith(path)] if bag else []
