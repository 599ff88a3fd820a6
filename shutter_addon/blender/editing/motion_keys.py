"""Keys of the motion of a region or of the camera: those that tracking has made, among those of the editor, who mends
it by more of them.

What was made has Blender's key type Generated, which editors show in a colour of its own, and the value that it was
made with. All other keys are the editor's: they keep frame and value, and are linear where a made key follows.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_

from ...core.motions import Placement
from ..data import fcurves, selection, validation
from ..data.validation import EffectError

MADE = "GENERATED"
_MADE = bpy.types.Keyframe.bl_rna.properties["type"].enum_items[MADE].value
# What Blender gives each key as the overshoot of the ease Back, which linear keys have no use for: a made key keeps
# there the value that it was made with, so that one which the editor has moved is told from it.
NOTHING_KEPT = np.float32(1.70158)
# The channels, and how many of their components a motion has.
_COMPONENTS = (("location", 0), ("location", 1), ("rotation", 0), ("scale", 0))
CHANNELS = ("location", "rotation", "scale")
_LOCKED = n_('{place}: the F-curve of "{channel}" is locked')
_MUTED = n_('{place}: the F-curve of "{channel}" is muted')
_COUNTS = {"LOCATION": 2, "ROTATION": 3, "SCALE": 4}


@dataclass(frozen=True)
class MotionKeys:
    """The keys of a region, or of the camera (index as for selection.moving), for a motion (properties.MOTIONS); frames
    are timeline frames of the edit."""

    effect: bpy.types.PropertyGroup
    index: int | None
    motion: str

    def edited(self, frames: range) -> list[int]:
        """The whole frames, among these, at which the editor has set a key."""
        curves = (self._curve(name, component) for name, component in _COMPONENTS[: _COUNTS[self.motion]])
        keys = map(_read, filter(None, curves))
        found = {frame for all_frames, made in keys for frame in all_frames[~made].tolist()}
        return sorted(int(frame) for frame in found if frame in frames)

    def are_made(self) -> bool:
        """Whether any key of the location was made."""
        curve = self._curve("location")
        return curve is not None and bool(_read(curve)[1].any())

    def are_several(self) -> bool:
        """Whether a channel of the motion has keys at more than one frame: with one alone the region stands still."""
        curves = (self._curve(name, component) for name, component in _COMPONENTS[: _COUNTS[self.motion]])
        return any(len(curve.keyframe_points) > 1 for curve in filter(None, curves))

    def channels(self) -> list[str]:
        """The channels that the motion has, and those that have keys already."""
        count = _COUNTS[self.motion]
        found = (name for k, (name, component) in enumerate(_COMPONENTS) if k < count or self._curve(name, component))
        return list(dict.fromkeys(found))

    def hold(self, first: int, last: int) -> None:
        """Keys what was tracked right before and after these frames where it is there: it stays, whatever becomes of
        the keys between."""
        tracked = self.confidence()[0]
        for frame in tracked[np.isin(tracked, (first - 1, last + 1))].tolist():
            for curve in filter(None, (self._curve(name, component) for name, component in _COMPONENTS)):
                if not curve.is_empty and frame not in fcurves.points_of(curve)[:, 0]:
                    _insert(curve, frame, curve.evaluate(frame))

    def write(self, placements: Mapping[int, Placement], confidence: Mapping[int, float]) -> None:
        """Makes keys at these frames, in place of all that were made from the first frame of the confidence to its
        last, of the channels that are not keyed as well. Other frames that were tracked stay as they are.

        confidence: 0 to 1 by frame"""
        within = min(confidence), max(confidence)
        self.hold(*within)
        for k, (name, component) in enumerate(_COMPONENTS):
            is_keyed = k < _COUNTS[self.motion]
            values = {frame: _values(placement)[k] for frame, placement in placements.items()} if is_keyed else {}
            if (curve := self._curve(name, component, new=is_keyed)) is not None:
                _replace(curve, values, *within)
        _replace(self._curve("confidence", new=True), {f: 100 * share for f, share in confidence.items()}, *within)

    def confidence(self) -> tuple[np.ndarray, np.ndarray]:
        """The frames (n,) that have a confidence, ascending, and what it is, 0 to 1."""
        curve = self._curve("confidence")
        points = fcurves.points_of(curve) if curve else np.empty((0, 2))
        return points[:, 0], points[:, 1] / 100

    def _curve(self, name: str, component: int = 0, *, new: bool = False):
        moving = selection.moving(self.effect, self.index)
        edit, path = self.effect.id_data, f"{moving.path_from_id()}.{name}"
        if new:
            return fcurves.ensure_curve(edit, path, component, moving.name)
        return fcurves.find_curve(edit, path, component)


def placement_now(moving) -> Placement:
    """Where a region or the camera is as its properties stand: at the current frame, keyed or not."""
    return Placement(tuple(moving.location), float(np.degrees(moving.rotation)), moving.scale)


def check_curves(effect, index: int | None) -> None:
    """EffectError: an F-curve of where a region or the camera is cannot be keyed, or its keys would do nothing."""
    moving = selection.moving(effect, index)
    for name in (*CHANNELS, "confidence"):
        for curve in fcurves.curves_under(effect.id_data, f"{moving.path_from_id()}.{name}"):
            for part in filter(None, (curve, curve.group)):
                if part.lock or part.mute:
                    sentence = _LOCKED if part.lock else _MUTED
                    label = iface_(moving.bl_rna.properties[name].name)
                    raise EffectError(rpt_(sentence).format(place=validation.place(moving), channel=label))


def insert(effect, index: int | None, channels=CHANNELS) -> None:
    """Keys channels of a region or of the camera at the current frame; where tracking has made a key, it is the
    editor's from now on, and sure. EffectError: as check_curves says."""
    check_curves(effect, index)
    edit, moving = effect.id_data, selection.moving(effect, index)
    path = moving.path_from_id()
    for name in channels:
        edit.keyframe_insert(f"{path}.{name}", group=moving.name)
        for curve in fcurves.curves_under(edit, f"{path}.{name}"):
            for key in curve.keyframe_points:
                if key.co[0] == edit.frame_current_final:
                    key.type, key.back = "KEYFRAME", NOTHING_KEPT
    for curve in fcurves.curves_under(edit, f"{path}.confidence"):
        for key in curve.keyframe_points:
            if key.co[0] == edit.frame_current_final:
                key.co[1] = 100
        curve.update()


def _values(placement: Placement) -> tuple[float, ...]:
    """In the order of _COMPONENTS, as Blender has them."""
    return *placement.location, np.radians(placement.rotation), placement.scale


def _replace(curve, values: dict[int, float], first: int, last: int) -> None:
    """Makes keys of these values by frame, in place of those that were made from the first frame to the last."""
    points, (frames, made) = curve.keyframe_points, _read(curve)
    within = (frames >= first) & (frames <= last)
    edited = within & ~made
    if values:
        for i in np.flatnonzero(edited & (frames < last)).tolist():
            points[i].interpolation = "LINEAR"
    for i in np.flatnonzero(within & made)[::-1].tolist():
        points.remove(points[i], fast=True)
    for frame in sorted(values.keys() - set(frames[edited].tolist())):
        _insert(curve, frame, values[frame])
    curve.update()


def _insert(curve, frame: int, value: float) -> None:
    key = curve.keyframe_points.insert(frame, value, options={"FAST"}, keyframe_type=MADE)
    key.interpolation, key.back = "LINEAR", key.co[1]


def _read(curve) -> tuple[np.ndarray, np.ndarray]:
    """The frames (n,) of an F-curve's keys, and which of them were made and are as they were made."""
    points, count = fcurves.points_of(curve), len(curve.keyframe_points)
    types, kept = np.empty(count, np.int32), np.empty(count, np.float32)
    curve.keyframe_points.foreach_get("type", types)
    curve.keyframe_points.foreach_get("back", kept)
    return points[:, 0], (types == _MADE) & ((kept == points[:, 1]) | (kept == NOTHING_KEPT))
