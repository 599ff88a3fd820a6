"""Move a region by what Blender has tracked in a movie clip: a track, a plane track, or all tracks of an object.

Markers are at frames of the clip, which begin at 1, in fractions of its picture. The region moves with them from the
current frame and from the user's other keyframes.
"""

from bisect import bisect_left, bisect_right

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import MovieClip, MovieTrackingObject, MovieTrackingTrack, PropertyGroup, Scene, Strip

from ....blender.data import annotations, external_files, fcurves, snapshot, source_media, strips, validation
from ....blender.editing import motion_keys
from ....blender.editing.motion_keys import MotionKeys
from ....blender.rendering import effect_source
from ....core.messages import EffectError, translated
from ....core.model import motions
from ....core.model.effect import Region
from ....core.model.motions import Placement, Similarity
from .. import registration

Motions = dict[int, Similarity]  # motion of the picture to each frame
Points = dict[str, complex]  # positions of markers in pixels, as in motions.Similarity
Point = tuple[str, np.ndarray, np.ndarray]  # see _markers


def follow(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> None:
    """Make a region follow a movie clip's track: insert the keyframes that its motion needs where the track is known.

    The region's place at the current frame and at keyframes that the user made stays; between these, motion from both
    is blended. Notes of where an earlier tracking of the region stopped are removed.

    Args:
        index: Index of the region.

    Raises:
        EffectError, MediaError: The region cannot follow the track. Nothing has changed.
    """
    start, region = scene.frame_current, effect.regions[index]
    points = _points(scene, effect, strip, index, start)
    frames, size = sorted(points), annotations.picture_size(effect)
    keys = MotionKeys(effect, index, "LOCATION" if region.follow_kind == "TRACK" else region.motion)
    keys.begin(start)
    shape = snapshot.region_at(scene, effect, strip, index, frames)
    known = {start, *(frame for frame in keys.edited(range(frames[0], frames[-1] + 1)) if frame in points)}
    placements = _followed(shape, frames, {frame: _motions(points, frame) for frame in known}, start, size)
    kept = keys.needed(shape, start, placements, known)
    between = range(min(placements), max(placements) + 1)
    keys.write({frame: placements[frame] for frame in kept}, {frame: float(frame in placements) for frame in between})
    region.stops.clear()


def holder_of(region: PropertyGroup) -> MovieTrackingObject | None:
    """Return the tracking object whose tracks a region can follow.

    Args:
        region: The region. It must have a clip.

    Returns:
        The object of the clip that is named in `follow_object`; if no name is given, the clip's first one, which is the
        camera. None: the clip has no object of this name.
    """
    objects = region.follow_clip.tracking.objects
    return objects.get(region.follow_object) if region.follow_object else objects[0]


def _markers(region: PropertyGroup) -> list[Point]:
    """Return the points of a movie clip that a region follows.

    These are one track, all tracks of an object, or the four corners of a plane track.

    Returns:
        For each point: its name; the clip's frames where it has a marker that is not muted, (n,), ascending; and the
        marker's places there, (n, 2), in fractions of the picture.

    Raises:
        EffectError: No clip is chosen, or it has no such track or object.
    """
    clip = region.follow_clip
    if clip is None:
        raise EffectError(rpt_("Choose a clip first"))
    if (holder := holder_of(region)) is None:
        raise _missing(clip, region.follow_object)
    if region.follow_kind == "OBJECT":
        return [_track_markers(track) for track in holder.tracks]
    named = (holder.plane_tracks if region.follow_kind == "PLANE" else holder.tracks).get(region.follow_track)
    if named is None:
        raise _missing(clip, region.follow_track)
    return _corners(named) if region.follow_kind == "PLANE" else [_track_markers(named)]


def _missing(clip: MovieClip, name: str) -> EffectError:
    return EffectError(rpt_('clip "{clip}" has no track "{track}"').format(clip=clip.name, track=name))


def _track_markers(track: MovieTrackingTrack) -> Point:
    places = fcurves.numbers(track.markers, "co", size=2) + np.array(track.offset, np.float32)
    return _shown(track.name, track.markers, places)


def _corners(plane: bpy.types.MovieTrackingPlaneTrack) -> list[Point]:
    places = np.array([[tuple(corner) for corner in marker.corners] for marker in plane.markers], np.float32)
    return [_shown(str(k), plane.markers, places[:, k]) for k in range(4)]


def _shown(name: str, markers: bpy.types.bpy_prop_collection, places: np.ndarray) -> Point:
    """Return a point (name, frames, places) as `_markers` does, without its muted markers."""
    is_shown = ~fcurves.numbers(markers, "mute", bool)
    return name, fcurves.numbers(markers, "frame", np.int32)[is_shown], places[is_shown]


def _points(scene: Scene, effect: PropertyGroup, strip: Strip, index: int, start: int) -> dict[int, Points]:
    """Return where the points that a region follows are, at each timeline frame of the strip.

    Args:
        index: Index of the region.
        start: Timeline frame from which the region will move.

    Returns:
        By timeline frame, then by the point's name: its place in pixels, x + iy. Frames without any point are left out.

    Raises:
        EffectError, MediaError: There is no such clip or track, or none of its points at `start`; the region's motion
            cannot be keyed; it lacks strokes at one of the frames; or the strip does not show the clip's footage.
    """
    region = effect.regions[index]
    validation.check_moving(region)
    motion_keys.check_curves(effect, index)
    validation.word(region, "motion")
    tracks, size = _markers(region), annotations.picture_size(effect)
    by_frame: dict[int, Points] = {}
    for frame, time in _clip_times(scene, effect, strip, region.follow_clip).items():
        at_time = {name: _place_at(frames, places, time) for name, frames, places in tracks}
        if points := {name: motions.pixel(place, size) for name, place in at_time.items() if place is not None}:
            by_frame[frame] = points
    if start not in by_frame:
        name = region.follow_object if region.follow_kind == "OBJECT" else region.follow_track
        sentence = rpt_('"{track}" of clip "{clip}" has no marker at frame {frame}')
        raise EffectError(sentence.format(track=name, clip=region.follow_clip.name, frame=start))
    with translated(rpt_):
        shape = snapshot.region_at(scene, effect, strip, index, by_frame)
        if not all(shape.drawings.at(frame) for frame in by_frame):
            raise EffectError(rpt_('region "{name}" has no strokes').format(name=region.name))
    return by_frame


def _clip_times(scene: Scene, effect: PropertyGroup, strip: Strip, clip: MovieClip) -> dict[int, float]:
    """Return which frame of the movie clip each timeline frame of the strip shows.

    Returns:
        By timeline frame, the frame of the clip, which counts as Blender does, from 1. It is not a whole number if the
        strip shows a moment between two frames.

    Raises:
        EffectError, MediaError: The strip does not show the clip's footage, or that cannot be read.
    """
    frames = range(strip.left_handle, strip.right_handle)
    source = strips.source_of(scene, effect, strip)
    _check_footage(source, clip)
    begins_as_clip = source.type == "MOVIECLIP" and not source_media.first_frame(source)
    first = 1 if begins_as_clip else 1 - clip.frame_offset  # the clip's frame that is the first one of the medium
    shown = snapshot.take(scene, effect, strip, frames)
    with effect_source.open_source(shown) as source:
        clip = effect_source.clip_of(shown, source)
        return {frame: clip.shown(frame).source_frame / clip.step + first for frame in frames}


def _check_footage(source: Strip, clip: MovieClip) -> None:
    """Check that a clip and a source strip begin with the same file.

    Raises:
        EffectError: They do not.
        MediaError: The strip has no files.
    """
    own = source.clip if source.type == "MOVIECLIP" else None
    first = external_files.absolute(own, own.filepath) if own else source_media.spec(source).path
    if first.resolve() != external_files.absolute(clip, clip.filepath).resolve():
        sentence = rpt_('clip "{clip}" does not begin with the same file as strip "{strip}"')
        raise EffectError(sentence.format(clip=clip.name, strip=source.name))


def _place_at(frames: np.ndarray, places: np.ndarray, time: float) -> np.ndarray | None:
    """Return a point's place at some time of a clip, interpolated between the markers at the frames before and after.

    Args:
        frames: The clip's frames where the point has markers, (n,).
        places: The markers' places, (n, 2).
        time: Frame of the clip, not always a whole number.

    Returns:
        The place, (2,). None: the point has no marker at one of the two frames.
    """
    ends = [np.flatnonzero(frames == end) for end in (np.floor(time), np.ceil(time))]
    if not all(map(len, ends)):
        return None
    before, after = (places[end[0]].astype(np.float64) for end in ends)
    return before + (time - np.floor(time)) * (after - before)


def _followed(
    subject: Region, frames: list[int], moves: dict[int, Motions], start: int, size: tuple[int, int]
) -> dict[int, Placement]:
    """Return the placement of a region at each frame, moved along with the picture from the frames where it is known.

    Between two frames with a known placement, motion from both is blended.

    Args:
        subject: The region as plain data.
        frames: Timeline frames, ascending.
        moves: For each frame with a known placement, `start` included, the picture's motion from there to other frames.
        start: Timeline frame from which the region is followed in both directions of time.
        size: Width and height of the picture in pixels.

    Returns:
        By timeline frame, ascending, the placement. Frames to which no motion is known are left out.
    """
    known, placed = sorted(moves), ((frame, subject.centre(frame)) for frame in frames)
    centres = {frame: centre for frame, centre in placed if centre is not None}
    result = {start: subject.placement(start)}

    def carried(origin: int, frame: int, near: Placement) -> Placement | None:
        """Return the region's placement at a frame, moved along from the frame `origin`; None: motion is not known.

        Args:
            origin: A timeline frame where the placement is known.
            frame: The timeline frame.
            near: The placement found last. The result's rotation continues it without a jump by whole turns.
        """
        if (motion := moves[origin].get(frame)) is None:
            return None
        moved = motions.carried(subject.placement(origin), motion, centres[origin], centres[frame], size)
        return motions.unwound(moved, near)

    for way in _ways(frames, start):
        near = result[start]
        for frame in way:
            before = known[max(bisect_right(known, frame) - 1, 0)]
            after = known[min(bisect_left(known, frame), len(known) - 1)]
            first, second = carried(before, frame, near), carried(after, frame, near)
            placement = first or second
            if first and second and before != after:  # blend both
                placement = motions.between(first, second, (frame - before) / (after - before))
            if placement is not None:
                near = result[frame] = placement
    return dict(sorted(result.items()))


def _ways(frames: list[int], start: int) -> tuple[list[int], list[int]]:
    """Return the frames after `start`, ascending, and those before it, descending."""
    return [frame for frame in frames if frame > start], [frame for frame in reversed(frames) if frame < start]


def _motions(points: dict[int, Points], origin: int) -> Motions:
    """Return the picture's motion from one frame to each other frame, by the points that both have.

    If they have too few points in common (fewer than two, or one if `origin` has only one), the motion goes by way of
    the last frame before it, seen from `origin`, whose motion is known.

    Args:
        points: The points in pixels, by timeline frame and name.
        origin: The timeline frame at which motion begins.

    Returns:
        The motion by timeline frame, `origin` included. Frames to which none is found are left out.
    """
    by_frame = {origin: Similarity()}
    enough = min(2, len(points[origin]))
    for way in _ways(sorted(points), origin):
        before = origin
        for frame in way:
            for base in (origin, before):
                shared = sorted(points[base].keys() & points[frame].keys())
                if len(shared) >= enough:
                    there, here = (np.array([points[end][name] for name in shared]) for end in (base, frame))
                    moved = registration.least_squares(there, here, np.ones(len(shared)), "scale")
                    by_frame[frame] = moved.after(by_frame[base])
                    before = frame
                    break
    return by_frame
