"""Keys of the motion of a region or of the camera: those that tracking has made, among those of the editor, who mends
it by more of them.

What was made has Blender's key type Generated, which editors show in a colour of its own, and the value that it was
made with. All other keys are the editor's: they keep frame and value, and are linear where a made key follows.

A key that the editor sets bends the frames around it, as keys do, until tracking begins at it: then frames that are not
tracked again are where tracking had left them.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene

from ...core.frames import frame_ranges
from ...core.messages import EffectError
from ...core.model import motions, presence
from ...core.model.effect import Camera, Region
from ...core.model.motions import Placement, Placements
from ...core.recipes import region_keys
from ..data import annotations, fcurves, selection, validation

MADE = "GENERATED"
_MADE = bpy.types.Keyframe.bl_rna.properties["type"].enum_items[MADE].value
# What Blender gives each key as the overshoot of the ease Back, which linear keys have no use for: a made key keeps
# there the value that it was made with, so that one which the editor has moved is told from it. Keys that the editor
# has set keep what was tracked there before.
NOTHING_KEPT = float(np.float32(1.70158))
# The channels, and how many of their components a motion has.
_COMPONENTS = (("location", 0), ("location", 1), ("rotation", 0), ("scale", 0))
CHANNELS = ("location", "rotation", "scale")
# What says how much a region counts, and the camera.
ENDS = "opacity", "influence"
_LOCKED = n_('{place}: the F-curve of "{channel}" is locked')
_MUTED = n_('{place}: the F-curve of "{channel}" is muted')
_COUNTS = {"LOCATION": 2, "ROTATION": 3, "SCALE": 4}


@dataclass(frozen=True)
class MotionKeys:
    """The keys of a region, or of the camera (index: see selection.moving), for a motion (properties.MOTIONS); frames
    are timeline frames."""

    effect: bpy.types.PropertyGroup
    index: int | None
    motion: str

    def edited(self, frames: range) -> list[int]:
        """The whole frames, among these, at which the editor has set a key."""
        keys = map(_read, self._curves(_COUNTS[self.motion]))
        keyed = {frame for all_frames, made in keys for frame in all_frames[~made].tolist()}
        return sorted(int(frame) for frame in keyed if frame in frames)

    def are_made(self) -> bool:
        """Whether any key of the location was made."""
        curve = self._curve("location")
        return curve is not None and bool(_read(curve)[1].any())

    def reach(self, frame: int) -> bool:
        """Whether there are keys of a motion, and tracking, if any of them come from it, has come through a frame. With
        a single one the region stands still."""
        tracked = self.confidence()[0]
        are_several = any(len(curve.keyframe_points) > 1 for curve in self._curves(_COUNTS[self.motion]))
        return are_several and (not len(tracked) or frame in tracked)

    def channels(self) -> list[str]:
        """The channels that the motion has, and those that have keys already."""
        count = _COUNTS[self.motion]
        names = (name for k, (name, component) in enumerate(_COMPONENTS) if k < count or self._curve(name, component))
        return list(dict.fromkeys(names))

    def hold(self, first: int, last: int) -> None:
        """Keys what was tracked right before and after these frames where tracking has left it: it stays, whatever
        becomes of the keys between, and wherever the editor has moved the first and the last of them."""
        tracked = self.confidence()[0]
        beside = tracked[np.isin(tracked, (first - 1, last + 1))].tolist()
        for curve in self._curves():
            for frame, value in _as_tracked(curve, (first, last), beside).items():
                _insert(curve, frame, value)

    def begin(self, frame: int) -> None:
        """Makes the scene's current frame, at which it begins, the editor's; what was tracked beside it stays there.
        EffectError: as check_curves says."""
        self.hold(frame, frame)
        insert(self.effect, self.index, self.channels(), begins=True)

    def write(self, placements: Mapping[int, Placement], confidence: Mapping[int, float]) -> None:
        """Makes keys at some of the frames that have a confidence, in place of all that were made at these, of the
        channels that are not keyed as well. Other frames that were tracked stay as they are; those between, which never
        were, have no confidence at all: it is 0.

        confidence: 0 to 1 by frame"""
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
        """The frames whose keys say the motion, within a pixel for a region, as it is drawn at the frame `start`; kept:
        those that stay in any case."""
        size = annotations.picture_size(self.effect)
        if isinstance(shape, Camera):
            return motions.thinned(placements, region_keys.CORNERS, size, kept, region_keys.STEADY)
        return motions.thinned(placements, motions.offsets(shape.drawings.at(start)), size, kept)

    def confidence(self) -> tuple[np.ndarray, np.ndarray]:
        """The frames (n,) that have a confidence, ascending, and what it is, 0 to 1."""
        curve = self._curve("confidence")
        points = curve.points() if curve else np.empty((0, 2))
        return points[:, 0], points[:, 1] / 100

    def fade(self, name: str, keys: Iterable[presence.Key]) -> None:
        """Makes keys of how much it counts, a property from 0 to 1, in place of all that were made: between these it is
        what the editor has it at, keyed or not."""
        curve = self._curve(name, new=True)
        moving, path = selection.moving(self.effect, self.index), curve.data_path
        points, (frames, made) = curve.keyframe_points, _read(curve)
        # What was made has hidden the number that the editor had set.
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
        """Of the first components, those that are keyed."""
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
    """EffectError: an F-curve of where a region or the camera is cannot be keyed, or its keys would do nothing."""
    moving = selection.moving(effect, index)
    for name in (*CHANNELS, "confidence", ENDS[index is None]):
        for curve in fcurves.curves_under(effect.id_data, f"{moving.path_from_id()}.{name}"):
            for part in filter(None, (curve, curve.group)):
                if part.lock or part.mute:
                    sentence = _LOCKED if part.lock else _MUTED
                    label = iface_(moving.bl_rna.properties[name].name)
                    raise EffectError(rpt_(sentence).format(place=validation.place(moving), channel=label))


def insert(
    effect: PropertyGroup, index: int | None, channels: Sequence[str] = CHANNELS, *, begins: bool = False
) -> None:
    """Keys channels of a region or of the camera at the scene's current frame; where tracking has made a key, it is the
    editor's from now on, and sure. EffectError: as check_curves says.

    begins: whether tracking begins there, so that they are read there; of a timeline that is stretched, others lie
    where Blender's own do, and are read elsewhere. Those keep what was tracked there, for the next MotionKeys.hold"""
    check_curves(effect, index)
    scene, moving = effect.id_data, selection.moving(effect, index)
    path, pace, frame = moving.path_from_id(), fcurves.stretched(scene), scene.frame_current
    if not begins and pace != 1:
        frame = round(frame / pace, 3)
    for name in channels:
        tracked = [_tracked_value(curve, frame) for curve in _curves(scene, f"{path}.{name}")]
        # Without a frame Blender takes that of the window's scene, which may be another one.
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
    """What tracking has made of a frame, for a key that the editor sets there; of the editor's key there, what it
    keeps."""
    for key in _keys_at(curve, frame):
        if key.type != MADE:
            return key.back
    return NOTHING_KEPT if curve.is_empty else curve.evaluate(frame)


def _as_tracked(curve: fcurves.Timed, edited: tuple[int, int], frames: list[float]) -> dict[float, float]:
    """The values of an F-curve at frames without a key, straight between its keys, with what tracking said of two
    frames that the editor may have keyed since; it is forgotten after this."""
    points = curve.points()
    for i in np.flatnonzero(np.isin(points[:, 0], edited)).tolist():
        key = curve.keyframe_points[i]
        if key.type != MADE and key.back != NOTHING_KEPT:
            points[i, 1], key.back = key.back, NOTHING_KEPT
    without = [frame for frame in frames if len(points) and frame not in points[:, 0]]
    return dict(zip(without, np.interp(without, *points.T).tolist(), strict=True)) if without else {}


def _values(placement: Placement) -> tuple[float, ...]:
    """In the order of _COMPONENTS, as Blender has them."""
    return *placement.location, np.radians(placement.rotation), placement.scale


def _replace(curve: fcurves.Timed, values: dict[int, float], tracked: Iterable[int]) -> None:
    """Makes keys of these values by frame, in place of those that were made at the frames that were tracked."""
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
    """The frames (n,) of an F-curve's keys, and which of them were made and are as they were made."""
    points = curve.points()
    types = fcurves.numbers(curve.keyframe_points, "type", np.int32)
    kept = fcurves.numbers(curve.keyframe_points, "back")
    return points[:, 0], (types == _MADE) & ((kept == points[:, 1]) | (kept == NOTHING_KEPT))
