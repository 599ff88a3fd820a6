"""Keyframes of the motion of a region or the camera: those that tracking made, and the user's, which correct them.

Tracking makes keyframes of Blender's type Generated, which has its own color, and stores their value in them. All
others are the user's: they keep frame and value, and become linear before a generated one.

A keyframe that the user inserts bends its surroundings until tracking begins at it. Then the frames that are not
tracked again get the position back that tracking had found there.
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
    """Reads and writes the keyframes of the motion of a region or the camera. Frames are timeline frames.

    Generated keyframes were made by tracking and not changed since. All others are the user's.

    Attributes:
        effect: The effect that has the region or camera.
        index: Index of the region; None: the camera.
        motion: What tracking keys, an item of choices.MOTIONS: "LOCATION"; "ROTATION": location and rotation; "SCALE":
            location, rotation and scale.
    """

    effect: bpy.types.PropertyGroup
    index: int | None
    motion: str

    def edited(self, frames: range) -> list[int]:
        """Return which of some frames have a keyframe that the user made or changed, ascending."""
        keys = map(_read, self._curves(_COUNTS[self.motion]))
        keyed = {frame for all_frames, made in keys for frame in all_frames[~made].tolist()}
        return sorted(int(frame) for frame in keyed if frame in frames)

    def are_made(self) -> bool:
        """Tell whether any keyframe of the location was made by tracking and not changed by the user since."""
        curve = self._curve("location")
        return curve is not None and bool(_read(curve)[1].any())

    def reach(self, frame: int) -> bool:
        """Tell whether the keyframes say how the region or camera moves at a frame.

        An F-curve of the motion must have several keyframes: with one, nothing moves. If tracking was used, it must
        also have stored a confidence for the frame.
        """
        tracked = self.confidence()[0]
        are_several = any(len(curve.keyframe_points) > 1 for curve in self._curves(_COUNTS[self.motion]))
        return are_several and (not len(tracked) or frame in tracked)

    def channels(self) -> list[str]:
        """Return the names of the properties to key: those that `motion` names, and those that have F-curves."""
        count = _COUNTS[self.motion]
        names = (name for k, (name, component) in enumerate(_COMPONENTS) if k < count or self._curve(name, component))
        return list(dict.fromkeys(names))

    def hold(self, first: int, last: int) -> None:
        """Insert generated keyframes right before and after a range, so that changes within it move nothing outside.

        They have the motion that tracking found there, even if the user has since inserted keyframes at the range's
        first or last frame, which bend the F-curves. Do nothing beside the range where a frame was not tracked or has a
        keyframe.

        Args:
            first: First frame of the range, which will change.
            last: Last frame of the range.
        """
        tracked = self.confidence()[0]
        beside = tracked[np.isin(tracked, (first - 1, last + 1))].tolist()
        for curve in self._curves():
            for frame, value in _as_tracked(curve, (first, last), beside).items():
                _insert(curve, frame, value)

    def begin(self, frame: int) -> None:
        """Insert keyframes of the user's at the scene's current frame, from which tracking will start.

        First insert generated keyframes at the frames right before and after it, to keep the motion tracked there
        (`hold`).

        Args:
            frame: The scene's current frame.

        Raises:
            EffectError: As in check_curves.
        """
        self.hold(frame, frame)
        insert(self.effect, self.index, self.channels(), begins=True)

    def write(self, placements: Mapping[int, Placement], confidence: Mapping[int, float]) -> None:
        """Store a result of tracking: replace the generated keyframes at the tracked frames, and store the confidence.

        The user's keyframes stay, and so does the motion at frames that were not tracked this time (`hold`). A frame
        between the first and last one of `confidence` that was never tracked gets a confidence of 0.

        Args:
            placements: Location, rotation and scale for each new keyframe, by frame. Only some tracked frames need one.
            confidence: How sure tracking is, 0 to 1, by frame, for every frame that was tracked this time.
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
        """Return a few frames whose keyframes suffice to reproduce a tracked motion by interpolation.

        The region may be off by up to 1 pixel of the picture, the camera by up to _STEADY pixels. The first and the
        last frame always need a keyframe.

        Args:
            shape: The region or camera as plain data. The error is measured at the points of the region's strokes or,
                for the camera, at the picture's corners.
            start: Timeline frame at which the region's strokes are taken.
            placements: The tracked motion: the placement at each timeline frame.
            kept: Frames to return in any case, if they have a placement.
        """
        size = annotations.picture_size(self.effect)
        if isinstance(shape, Camera):
            return motions.thinned(placements, motions.offsets([motions.PICTURE]), size, kept, _STEADY)
        return motions.thinned(placements, motions.offsets(shape.drawings.at(start)), size, kept)

    def confidence(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the tracked frames (n,), ascending, and how sure tracking was at each (n,), 0 to 1."""
        curve = self._curve("confidence")
        points = curve.points() if curve else np.empty((0, 2))
        return points[:, 0], points[:, 1] / 100

    def fade(self, name: str, keys: Iterable[presence.Key]) -> None:
        """Replace the generated keyframes that fade a region's opacity or the camera's influence where its track ends.

        The user's keyframes stay. If no keyframes are left, remove the F-curve and restore the value from before
        fading.

        Args:
            name: "opacity" (region) or "influence" (camera), as in ENDS.
            keys: The new keyframes. Their values, 0 to 1, are multiplied by the user's: at that frame if the user has
                keyframes, otherwise the property's value before fading.
        """
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
        """Return the F-curves of the first `count` of _COMPONENTS, in order. Components without one are left out."""
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
    """Check that F-curves of a region's or the camera's motion can be changed.

    These are the F-curves of location, rotation, scale, tracking's confidence, and opacity (camera: influence).

    Args:
        index: Index of the region; None: the camera.

    Raises:
        EffectError: One of the F-curves or of their groups is locked or muted.
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
    """Insert keyframes of the user's for the motion of a region or the camera, at the scene's current frame.

    If tracking has stored a confidence for this frame, it becomes full (1).

    Args:
        index: Index of the region; None: the camera.
        names: Properties to key, some of CHANNELS.
        begins: True: tracking will start at these keyframes, so they lie on a frame that can be tracked. False: they
            also store the values that tracking had found there, for a later `hold`. On a timeline with *Time
            Stretching*, they then lie where Blender's own keyframes would.

    Raises:
        EffectError: As in check_curves.
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
    """Return the value that tracking found at a frame, which a user's keyframe stores when it is inserted there.

    If a user's keyframe is there already, it is what that stores; otherwise, it is the F-curve's value.

    Returns:
        NOTHING_KEPT if that keyframe stores nothing, or if the F-curve has no keyframes.
    """
    for key in _keys_at(curve, frame):
        if key.type != MADE:
            return key.back
    return NOTHING_KEPT if curve.is_empty else curve.evaluate(frame)


def _as_tracked(curve: fcurves.Timed, edited: tuple[int, int], frames: list[float]) -> dict[float, float]:
    """Return the values that tracking found at frames without a keyframe, interpolated linearly between keyframes.

    Args:
        curve: F-curve of one component of the motion.
        edited: Two frames that may have keyframes of the user's. Where such a keyframe stores a value that tracking
            found, that value is interpolated instead of the user's, and the keyframe stores it no longer.
        frames: The frames to return values for.

    Returns:
        Values by frame. Frames that have a keyframe are left out; {} if the F-curve has no keyframes.
    """
    points = curve.points()
    for i in np.flatnonzero(np.isin(points[:, 0], edited)).tolist():
        key = curve.keyframe_points[i]
        if key.type != MADE and key.back != NOTHING_KEPT:
            points[i, 1], key.back = key.back, NOTHING_KEPT
    without = [frame for frame in frames if len(points) and frame not in points[:, 0]]
    return dict(zip(without, np.interp(without, *points.T).tolist(), strict=True)) if without else {}


def _values(placement: Placement) -> tuple[float, ...]:
    """Return a placement as rounded numbers (x, y, rotation in radians, scale), the order of _COMPONENTS."""
    x, y, rotation, scale = np.round(motions.as_array([placement])[0], _DIGITS).tolist()
    return x, y, math.radians(rotation), scale


def _replace(curve: fcurves.Timed, values: dict[int, float], tracked: Iterable[int]) -> None:
    """Replace the generated keyframes of an F-curve at the tracked frames.

    The user's keyframes stay, and no new ones are inserted at their frames. If there are new ones, the user's at
    tracked frames before the last become linear, as new ones may follow.

    Args:
        values: The new keyframes' values by frame; {}: only remove the old ones.
        tracked: All frames that were tracked. Keyframes at other frames stay.
    """
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
    """Return the frames of an F-curve's keyframes (n,), and whether each is tracking's and unchanged since (n,)."""
    points = curve.points()
    types = fcurves.numbers(curve.keyframe_points, "type", np.int32)
    kept = fcurves.numbers(curve.keyframe_points, "back")
    return points[:, 0], (types == _MADE) & ((kept == points[:, 1]) | (kept == NOTHING_KEPT))
