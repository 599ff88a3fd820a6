"""Track a region or the camera through its strip in Blender, and key it; make shutters follow what was tracked.

Functions take an index: that of a region, or None for the camera. Each tracked frame gets a keyframe, so that the
preview shows it. At the end, only keyframes that the motion needs within a pixel remain.
"""

import math
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ....blender.data import selection, snapshot, strips, validation
from ....blender.data.consistency import unique
from ....blender.data.sampled import placement_now
from ....blender.editing import motion_keys
from ....blender.editing.motion_keys import MotionKeys
from ....blender.editing.shutter_edits import apply_preset, as_layer
from ....blender.rendering import effect_source
from ....core import threads
from ....core.frames import frame_ranges
from ....core.messages import EffectError, translated
from ....core.model import limits, presence
from ....core.model.effect import Camera, Region
from ....core.model.frame_state import Options
from ....core.model.keyframes import Samples
from ....media.footage import Footage
from .. import camera_tracking, matte_tracking, tracking
from ..tracking import Tracked


def frames_to_track(scene: Scene, strip: Strip, direction: str, until: int = 0) -> range:
    """Return the timeline frames to track, ascending: the current one, and those in a direction up to the strip's end.

    Args:
        direction: "FORWARD", "BACKWARD" or "BOTH".
        until: Timeline frame that limits the side of the current frame on which it lies. 0: no limit.

    Raises:
        EffectError: The current frame is outside of the strip.
    """
    current, first, last = scene.frame_current, strip.left_handle, strip.right_handle - 1
    if not first <= current <= last:
        raise EffectError(rpt_("the current frame is outside the Shutter strip"))
    if until and until > current:
        last = min(last, until)
    elif until and until < current:
        first = max(first, until)
    return range(current if direction == "FORWARD" else first, (current if direction == "BACKWARD" else last) + 1)


def track(
    scene: Scene, effect: PropertyGroup, strip: Strip, index: int | None, frames: range, patience: float | None = None
) -> Generator[int | None, None, None]:
    """Track a region or the camera from the current frame, and key each frame.

    At the end, keyframes that the motion does not need are removed, unless `track_all_keys` is on. Closing
    the generator early keeps the frames tracked so far. It ends if the region is gone (selection.Target.effect).

    Args:
        index: Of the region; None: the camera.
        frames: Timeline frames, from frames_to_track.
        patience: Seconds after which None is yielded while no frame is ready; None: wait.

    Yields:
        Each timeline frame after it is keyed; mostly twice on the way to a keyframe of the user's own.

    Raises:
        EffectError, MediaError: It cannot be tracked. If no frame has been yielded, nothing has changed.
    """
    moving = selection.moving(effect, index)
    validation.check_moving(moving)
    motion_keys.check_curves(effect, index)
    motion, all_keys = validation.word(moving, "motion"), moving.track_all_keys
    start, keys = scene.frame_current, MotionKeys(effect, index, motion)
    anchors = [frame for frame in keys.edited(frames) if frame != start]
    here = Tracked(frame=start, placement=placement_now(moving), confidence=1.0)
    shape, follow = _subject(scene, effect, strip, index, frames, here)
    tracked, stops = {start: here}, []
    before, after = [anchor for anchor in anchors if anchor < start], [anchor for anchor in anchors if anchor > start]
    reach = max(before, default=frames[0]), min(after, default=frames[-1])
    shown, target = snapshot.take(scene, effect, strip, frames), selection.Target.of(effect, index)
    del scene, effect, strip, keys, moving  # these may become invalid after the first step
    with effect_source.open_source(shown) as source:
        try:
            clip = effect_source.clip_of(shown, source)
            footage = Footage(source, lambda frame: clip.shown(frame).source_frame)
            found = follow(footage, start, frames, motion=motion.lower(), anchors=anchors)
            for step in _followed(found, patience):
                if step is None:
                    yield None
                elif step.fault:
                    stops.append(step)
                elif step.frame != start:
                    if (effect := target.effect()) is None:
                        return
                    keys = MotionKeys(effect, index, motion)
                    if len(tracked) == 1:
                        keys.begin(start)
                    tracked[step.frame] = step
                    beside = tracked.get(step.frame + (-1 if step.frame > start else 1), step)
                    _write(keys, [beside, step], [beside, step])
                    yield step.frame
        finally:
            if len(tracked) > 1 and (effect := target.effect()) is not None:
                keys = MotionKeys(effect, index, motion)
                ends = {frame for run in frame_ranges.runs(tracked) for frame in run}
                placements = {frame: each.placement for frame, each in tracked.items()}
                kept = tracked if all_keys else keys.needed(shape, start, placements, {start, *anchors, *ends})
                _write(keys, [tracked[frame] for frame in kept], tracked.values())
                _mark(effect, index, tracked, stops, reach)
                key_ends(effect, index)
    if len(tracked) == 1:
        raise EffectError(rpt_(stops[0].fault))


def stops(effect: PropertyGroup, index: int | None) -> list[tuple[int, str, bool]]:
    """Return where tracking of a region (None: the camera) stopped, in ascending order.

    Returns:
        For each stop: the first timeline frame not reached, the reason in the user's language, and whether it is a
        fault. False: the footage has a cut there.
    """
    return sorted((frame, rpt_(stop.fault), stop.fault != tracking.SHOT_ENDS) for frame, stop in _stops(effect, index))


def _stops(effect: PropertyGroup, index: int | None) -> list[tuple[int, PropertyGroup]]:
    """Return the stored stops of tracking (data.properties.TrackStop), each with its timeline frame."""
    known = [(effect.start + stop.frame, stop) for stop in selection.moving(effect, index).stops]
    return [(round(frame), stop) for frame, stop in known if math.isfinite(frame)]


def key_ends(effect: PropertyGroup, index: int | None) -> None:
    """Insert opacity keyframes that fade out a region where tracking stopped (index None: the camera's influence).

    They replace those that an earlier call inserted; the user's own stay. If the option `track_ends` is off, or the
    region is a matte, such as an outline, the earlier ones are only removed.
    """
    keys, fades = MotionKeys(effect, index, "SCALE"), []
    frames, confidence = keys.confidence()
    seen = np.round(frames[confidence > 0]).astype(int).tolist()
    ends = [presence.Stop(at, stop.forward, stop.fault == tracking.SHOT_ENDS) for at, stop in _stops(effect, index)]
    has_matte = index is not None and effect.regions[index].kind in strips.LAID
    if selection.moving(effect, index).track_ends and seen and not has_matte:
        if index is None:
            # No exposure reaches frames with unknown motion.
            window, position = validation.number(effect, "window"), validation.word(effect, "position").lower()
            reach = max(Options(window=window, position=position).reach, presence.FADE)
            fades = presence.keys(seen, ends, (), reach, beside=1)
        else:
            fades = presence.keys(seen, ends, keys.edited(range(min(seen), max(seen) + 1)))
    keys.fade(motion_keys.ENDS[index is None], fades)


def confidence_at(effect: PropertyGroup, index: int | None, frame: float) -> float | None:
    """Return how sure tracking was at a timeline frame, 0 to 1; None: it was not tracked."""
    frames, confidence = MotionKeys(effect, index, "LOCATION").confidence()
    return next(iter(confidence[frames == frame].tolist()), None)


def next_unsure(effect: PropertyGroup, index: int | None, frame: float) -> int | None:
    """Return the least sure timeline frame of the next unsure stretch of tracking after a frame; None: none is left."""
    frames, confidence = MotionKeys(effect, index, "LOCATION").confidence()
    unsure = (frames <= limits.MAX_FRAME) & (confidence < tracking.SURE)
    begins = np.flatnonzero(unsure & ~np.append(False, unsure[:-1]) & (frames > frame))
    if not len(begins):
        return None
    stretch = np.flatnonzero(~np.append(unsure[begins[0] :], False))[0]
    return int(frames[begins[0] + confidence[begins[0] : begins[0] + stretch].argmin()])


def faults(effect: PropertyGroup, index: int | None) -> list[tuple[int, str, bool]]:
    """Return what the interface lists about tracking: the result of `lost`, if any, then those of `stops`.

    Returns:
        For each: the timeline frame, the reason in the user's language, and whether it is a fault. The subject is lost
        where confidence stays low, although tracking may have gone on. A stop at a cut is no fault.
    """
    where = lost(effect, index)
    return [*([(*where, True)] if where else []), *stops(effect, index)]


def lost(effect: PropertyGroup, index: int | None) -> tuple[int, str] | None:
    """Return the timeline frame where tracking lost the subject, and a note for the user; None: it did not."""
    frame = tracking.lost(*MotionKeys(effect, index, "LOCATION").confidence())
    if frame is None:
        return None
    words = rpt_(
        "Tracking lost the subject at frame {frame}: move the region back onto it, there or later, or outline it"
    )
    if index is None:
        words = rpt_(
            "From frame {frame} on, near and far move differently or too little is visible: not all can be stabilized"
        )
    return frame, words.format(frame=frame)


def _subject(
    scene: Scene, effect: PropertyGroup, strip: Strip, index: int | None, frames: Sequence[int], here: Tracked
) -> tuple[Region | Camera, Callable]:
    """Return the region or camera to track as plain data, and the function that tracks it.

    Args:
        index: Of the region; None: the camera.
        frames: Timeline frames to track.
        here: The frame where tracking starts, and the subject's placement there.

    Returns:
        The region or camera with that placement, and a function with the arguments of tracking.Track.follow.
    """
    if index is None:
        camera = _standing(snapshot.camera_at(scene, effect, frames), here)
        drawn = [i for i, region in enumerate(effect.regions) if region.kind not in strips.MATTES]
        left_out = [snapshot.region_at(scene, effect, strip, i, frames) for i in drawn]
        return camera, camera_tracking.CameraTrack(camera, left_out).follow
    shape = _standing(snapshot.region_at(scene, effect, strip, index, frames), here)
    if strips.is_carried(effect.regions[index]):
        carried = snapshot.carried_outline(scene, effect, strip, index, frames)
        return shape, partial(matte_tracking.follow_carried, shape, *carried)
    if effect.regions[index].kind == "OUTLINE":
        cover = matte_tracking.cover_within(shape.drawings.at)
        return shape, matte_tracking.MatteTrack(shape, cover).follow
    return shape, tracking.RegionTrack(shape).follow


def _standing(moving: Any, here: Tracked) -> Any:
    """Return a copy of a region or the camera (plain data) in which the placement at one frame is replaced.

    The user may have changed it without inserting a keyframe.

    Args:
        moving: The region or camera.
        here: The frame and its new placement.
    """
    sampled = {
        name: replace(channel, values=channel.values | {here.frame: getattr(here.placement, name)})
        for name, channel in vars(moving.moves).items()
        if isinstance(channel, Samples)
    }
    return replace(moving, moves=replace(moving.moves, **sampled))


def _followed(found: Iterator[Tracked], patience: float | None) -> Iterator[Tracked | None]:
    """Run tracking on a thread, and yield what it finds. Its errors are raised in the user's language.

    Args:
        patience: As in `track`.
    """
    with translated(rpt_):
        try:
            with closing(threads.beside(found, patience)) as steps:
                yield from steps
        except tracking.TrackingError as error:
            raise EffectError(rpt_(str(error))) from None


def _write(keys: MotionKeys, kept: Iterable[Tracked], tracked: Iterable[Tracked]) -> None:
    keys.write({t.frame: t.placement for t in kept}, {t.frame: t.confidence for t in tracked})


def _mark(
    effect: PropertyGroup, index: int | None, tracked: dict[int, Tracked], stops: list[Tracked], reach: tuple[int, int]
) -> None:
    """Store where tracking stopped, and remove outdated stops of earlier tracking.

    Those at tracked frames are removed and, in a direction in which it stopped now, those up to the end of `reach`.

    Args:
        tracked: Results by timeline frame. The first item is the frame where tracking started.
        stops: Where and why tracking stopped (Tracked with a fault).
        reach: First and last timeline frame that were to be tracked.
    """
    moving, start = selection.moving(effect, index), next(iter(tracked))
    ways = {stop.frame > start for stop in stops}
    first, last = reach[0] if False in ways else min(tracked), reach[1] if True in ways else max(tracked)
    for i in reversed(range(len(moving.stops))):
        if first <= effect.start + moving.stops[i].frame <= last:
            moving.stops.remove(i)
    for stop in stops:
        new = moving.stops.add()
        new.frame, new.forward, new.fault = stop.frame - effect.start, stop.frame > start, stop.fault


SMOOTHNESS = 6  # frames before and after each: half a second


def make_follow(effect: PropertyGroup, index: int, subject: str, key: bool) -> None:
    """Make a shutter's exposure move with a region or the camera, fully open and centered on the shown frame.

    Args:
        index: Of the shutter.
        subject: "REGION" (the one that the shutter's `follow_region` names) or "CAMERA".
        key: Insert keyframes for the shutter's bars.

    Raises:
        EffectError: The window's length is out of range. Nothing has changed.
    """
    apply_preset(effect, index, "ANGLE_360", key)
    shutter = effect.shutters[index]
    shutter.follow, shutter.length, effect.position = subject, "FRAMES", "CENTER"
    shutter.follow_motion, shutter.follow_smooth = "SCALE", 0


def panning_shot(effect: PropertyGroup, index: int, key: bool = False) -> None:
    """Make a region a sharp layer, and blur all else along its motion, as a camera does that pans with it.

    Args:
        index: Of the region.
        key: Insert keyframes for the bars.

    Raises:
        EffectError: The window's length is out of range.
    """
    as_layer(effect, index, "STILL", "ANGLE_360", key)
    region = effect.regions[index]
    region.name = unique(region.name, {other.name for other in effect.regions if other != region})
    make_follow(effect, 0, "REGION", key)
    default = effect.shutters[0]
    default.follow_region = region.name
    # Rotation and scale of a small subject are uncertain and would whirl distant pixels. A real camera pans smoothly.
    default.follow_motion, default.follow_smooth = "LOCATION", SMOOTHNESS


def is_tracked(scene: Scene, effect: PropertyGroup, strip: Strip, index: int | None) -> bool:
    """Tell whether keyframes say how a region or the camera moves at the current frame.

    A region must also have strokes there. If False, *Panning Shot* and *Stabilize Exposure* track it first.

    Args:
        index: Of the region; None: the camera.
    """
    frame = scene.frame_current
    has_motion = MotionKeys(effect, index, "SCALE").reach(frame)
    return has_motion and (index is None or bool(snapshot.strokes_at(scene, effect, strip, index, frame)))


def tripod(effect: PropertyGroup, key: bool = False) -> None:
    """Make the active shutter's exposure move with the camera, so that only what moves by itself is blurred.

    The shutter is fully open, centered on the shown frame. If no region uses it, the default shutter takes its place.

    Args:
        key: Insert keyframes for the bars.

    Raises:
        EffectError: The window's length is out of range. Nothing has changed.
    """
    index, name = effect.active_shutter, effect.shutters[effect.active_shutter].name
    if not any(region.shutter == name for region in effect.regions):
        index = 0
    make_follow(effect, index, "CAMERA", key)
    effect.active_shutter = index
    key_ends(effect, None)  # the window has moved
