"""Keyframes of a region's or the camera's motion: those that tracking made, and the user's, which correct them.

Tracking makes keyframes of Blender's type Generated, which has its own color, and stores their value in them. All
others are the user's: they keep frame and value, and become linear before a generated one.

A keyframe that the user inserts bends its surroundings until tracking begins at it. Then frames that are not tracked
again get their tracked place back.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene

from ...core.frames import frame_ranges
from ...core.messages import EffectError
from ...core.model import motions, presence
from ...core.model.effect import Camera, Region
from ...core.model.motions import Placement, Placements
from ..data import annotations, fcurves, selection, validation

MADE = "GENERATED"
_MADE = bpy.types.Keyframe.bl_rna.properties["type"].enum_items[MADE].value
# Blender's default overshoot of the ease Back, which linear keyframes do not use. A generated keyframe stores its value
# there, which shows whether the user has moved it. A user's keyframe stores what tracking had found at its frame.
NOTHING_KEPT = float(np.float32(1.70158))
# The channels, and how many of their components each motion has.
_COMPONENTS = (("location", 0), ("location", 1), ("rotation", 0), ("scale", 0))
CHANNELS = ("location", "rotation", "scale")
# Influence of a region and of the camera.
ENDS = "opacity", "influence"
_COUNTS = {"LOCATION": 2, "ROTATION": 3, "SCALE": 4}
_DIGITS = 6  # of measured numbers: far below a pixel, but above errors that depend on the number of threads
_STEADY = 0.25  # pixels by which keyframes of the camera may be off, since it moves the whole picture


@dataclass(frozen=True)
class MotionKeys:
    """The keyframes of a motion (choices.MOTIONS) of a region or the camera. Frames are timeline frames.

    Attributes:
        index: see selection.moving.
    """

    effect: bpy.types.PropertyGroup
    index: int | None
    motion: str

    def edited(self, frames: range) -> list[int]:
        """Return the whole frames, among these, with a user's keyframe."""
        keys = map(_read, self._curves(_COUNTS[self.motion]))
        keyed = {frame for all_frames, made in keys for frame in all_frames[~made].tolist()}
        return sorted(int(frame) for frame in keyed if frame in frames)

    def are_made(self) -> bool:
        """Return whether tracking made any keyframe of the location."""
        curve = self._curve("location")
        return curve is not None and bool(_read(curve)[1].any())

    def reach(self, frame: int) -> bool:
        """Return whether the motion has keyframes, and tracking, if it made any, reached a frame.

        A single keyframe does not count, because nothing moves.
        """
        tracked = self.confidence()[0]
        are_several = any(len(curve.keyframe_points) > 1 for curve in self._curves(_COUNTS[self.motion]))
        return are_several and (not len(tracked) or frame in tracked)

    def channels(self) -> list[str]:
        """Return the channels of the motion, and those that have keyframes already."""
        count = _COUNTS[self.motion]
        names = (name for k, (name, component) in enumerate(_COMPONENTS) if k < count or self._curve(name, component))
        return list(dict.fromkeys(names))

    def hold(self, first: int, last: int) -> None:
        """Key what was tracked right before and after these frames, so that changes between do not move it.

        It does not matter if the user has moved the first and last frame since.
        """
        tracked = self.confidence()[0]
        beside = tracked[np.isin(tracked, (first - 1, last + 1))].tolist()
        for curve in self._curves():
            for frame, value in _as_tracked(curve, (first, last), beside).items():
                _insert(curve, frame, value)

    def begin(self, frame: int) -> None:
        """Make the scene's current frame, where tracking begins, a user's keyframe, and keep what was tracked beside
        it.

        Raises:
            EffectError: see check_curves.
        """
        self.hold(frame, frame)
        insert(self.effect, self.index, self.channels(), begins=True)

    def write(self, placements: Mapping[int, Placement], confidence: Mapping[int, float]) -> None:
        """Replace the keyframes that tracking made at the frames that have a confidence.

        Other tracked frames stay. Frames between them that were never tracked get a confidence of 0.

        Args:
            placements: the new keyframes, at some of these frames.
            confidence: 0 to 1, by frame.
        """
        for first, last in frame_ranges.runs(confidence):
            self.hold(first, last)
        for k, (name, component) in enumerate(_COMPONENTS):
            is_keyed = k < _COUNTS[self.motion]
            values = {frame: _values(placement)[k] for frame, placement in placements.items()} if is_keyed else {}
            if (curve := self._curve(name, component, new=is_keyed)) is not None:
                _replace(curve, values, confidence)
        known = {*confidence, *self.confidence()[0].tolist()}
        between = dict.fromkeys(set(range(min(confidence), max(confidence))) - known, 0.0)
        every = between | {frame: 100 * share for frame, share in confidence.items()}
        _replace(self._curve("confidence", new=True), every, every)

    def needed(self, shape: Region | Camera, start: int, placements: Placements, kept: Collection[int]) -> list[int]:
        """Return the frames whose keyframes reproduce the motion within a pixel, or _STEADY.

        Args:
            start: frame whose drawing of a region counts.
            kept: frames to return in any case.
        """
        size = annotations.picture_size(self.effect)
        if isinstance(shape, Camera):
            return motions.thinned(placements, motions.offsets([motions.PICTURE]), size, kept, _STEADY)
        return motions.thinned(placements, motions.offsets(shape.drawings.at(start)), size, kept)

    def confidence(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the frames (n,) with a confidence, ascending, and the confidence (n,), 0 to 1."""
        curve = self._curve("confidence")
        points = curve.points() if curve else np.empty((0, 2))
        return points[:, 0], points[:, 1] / 100

    def fade(self, name: str, keys: Iterable[presence.Key]) -> None:
        """Replace the keyframes that tracking made for a property from 0 to 1. Between them the user's value counts."""
        curve = self._curve(name, new=True)
        moving, path = selection.moving(self.effect, self.index), curve.data_path
        points, (frames, made) = curve.keyframe_points, _read(curve)
        # The generated keyframes have hidden the user's value.
        whole = max((points[i].co[1] for i in np.flatnonzero(made).tolist()), default=getattr(moving, name))
        for i in np.flatnonzero(made)[::-1].tolist():
            points.remove(points[i], fast=True)
        curve.update()
        own = set(frames[~made].tolist())
        values = [(key, key.value * (curve.evaluate(key.frame) if own else whole)) for key in keys]
        for key, value in values:
            if key.frame not in own:
                _insert(curve, key.frame, value, key.ease.upper())
        curve.update()
        if curve.is_empty:
            fcurves.remove_curves(self.effect.id_data, path)
            setattr(moving, name, whole)

    def _curves(self, count: int = len(_COMPONENTS)) -> list[fcurves.Timed]:
        """Return the F-curves of the first components that have one."""
        found = (self._curve(name, component) for name, component in _COMPONENTS[:count])
        return [curve for curve in found if curve is not None]

    def _curve(self, name: str, component: int = 0, *, new: bool = False):
        moving = selection.moving(self.effect, self.index)
        scene, path = self.effect.id_data, f"{moving.path_from_id()}.{name}"
        if new:
            return fcurves.Timed(fcurves.ensure_curve(scene, path, component, moving.name), scene)
        curve = fcurves.find_curve(scene, path, component)
        return curve and fcurves.Timed(curve, scene)


def check_curves(effect: PropertyGroup, index: int | None) -> None:
    """Check that a region or the camera can be keyed.

    Raises:
        EffectError: an F-curve is locked or muted.
    """
    moving = selection.moving(effect, index)
    for name in (*CHANNELS, "confidence", ENDS[index is None]):
        for curve in fcurves.curves_under(effect.id_data, f"{moving.path_from_id()}.{name}"):
            for part in filter(None, (curve, curve.group)):
                if part.lock or part.mute:
                    sentence = rpt_('{place}: the F-curve of "{channel}" is locked or muted')
                    label = iface_(moving.bl_rna.properties[name].name)
                    raise EffectError(sentence.format(place=validation.place(moving), channel=label))


def insert(effect: PropertyGroup, index: int | None, names: Sequence[str] = CHANNELS, *, begins: bool = False) -> None:
    """Key channels of a region or the camera at the scene's current frame, as the user's keyframes with full
    confidence.

    Args:
        begins: tracking begins here, so that its frame counts. Other keyframes on a stretched timeline lie where
            Blender's own do. They store what was tracked there for MotionKeys.hold.

    Raises:
        EffectError: see check_curves.
    """
    check_curves(effect, index)
    scene, moving = effect.id_data, selection.moving(effect, index)
    path, pace, frame = moving.path_from_id(), fcurves.stretched(scene), scene.frame_current
    if not begins and pace != 1:
        frame = round(frame / pace, 3)
    for name in names:
        tracked = [_tracked_value(curve, frame) for curve in _curves(scene, f"{path}.{name}")]
        # Without a frame, Blender would use the one of the window's scene, which may be another one.
        scene.keyframe_insert(f"{path}.{name}", group=moving.name, frame=frame * pace)
        tracked += [NOTHING_KEPT] * len(_COMPONENTS)
        for curve, value in zip(_curves(scene, f"{path}.{name}"), tracked, strict=False):
            for key in _keys_at(curve, frame):
                key.type, key.back = "KEYFRAME", NOTHING_KEPT if begins else value
    for curve in _curves(scene, f"{path}.confidence"):
        for key in _keys_at(curve, frame):
            key.back = key.co[1] = 100
        curve.update()


def _curves(scene: Scene, path: str) -> list[fcurves.Timed]:
    return [fcurves.Timed(curve, scene) for curve in fcurves.curves_under(scene, path)]


def _keys_at(curve: fcurves.Timed, frame: float) -> list:
    return [curve.keyframe_points[i] for i in np.flatnonzero(curve.points()[:, 0] == frame).tolist()]


def _tracked_value(curve: fcurves.Timed, frame: float) -> float:
    """Return what tracking found at a frame, for a user's keyframe there."""
    for key in _keys_at(curve, frame):
        if key.type != MADE:
            return key.back
    return NOTHING_KEPT if curve.is_empty else curve.evaluate(frame)


def _as_tracked(curve: fcurves.Timed, edited: tuple[int, int], frames: list[float]) -> dict[float, float]:
    """Return tracked values at frames without a keyframe, interpolated linearly.

    The two edited frames count as tracked once more, and then forget it.
    """
    points = curve.points()
    for i in np.flatnonzero(np.isin(points[:, 0], edited)).tolist():
        key = curve.keyframe_points[i]
        if key.type != MADE and key.back != NOTHING_KEPT:
            points[i, 1], key.back = key.back, NOTHING_KEPT
    without = [frame for frame in frames if len(points) and frame not in points[:, 0]]
    return dict(zip(without, np.interp(without, *points.T).tolist(), strict=True)) if without else {}


def _values(placement: Placement) -> tuple[float, ...]:
    """Return a placement in the order of _COMPONENTS and in Blender's units, rounded to _DIGITS of a recipe's."""
    x, y, rotation, scale = np.round(motions.as_array([placement])[0], _DIGITS).tolist()
    return x, y, math.radians(rotation), scale


def _replace(curve: fcurves.Timed, values: dict[int, float], tracked: Iterable[int]) -> None:
    """Replace the generated keyframes of the tracked frames with these values by frame."""
    points, (frames, made) = curve.keyframe_points, _read(curve)
    within = np.isin(frames, list(tracked))
    edited = within & ~made
    if values:
        for i in np.flatnonzero(edited & (frames < max(tracked))).tolist():
            points[i].interpolation = "LINEAR"
    for i in np.flatnonzero(within & made)[::-1].tolist():
        points.remove(points[i], fast=True)
    for frame in sorted(values.keys() - set(frames[edited].tolist())):
        _insert(curve, frame, values[frame])
    curve.update()


def _insert(curve: fcurves.Timed, frame: float, value: float, ease: str = "LINEAR") -> None:
    key = curve.insert(frame, value, options={"FAST"}, keyframe_type=MADE)
    key.interpolation, key.back = ease, key.co[1]


def _read(curve: fcurves.Timed) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames (n,) of an F-curve's keyframes, and which of them are generated and unchanged."""
    points = curve.points()
    types = fcurves.numbers(curve.keyframe_points, "type", np.int32)
    kept = fcurves.numbers(curve.keyframe_points, "back")
    return points[:, 0], (types == _MADE) & ((kept == points[:, 1]) | (kept == NOTHING_KEPT))
