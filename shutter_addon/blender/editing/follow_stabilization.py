"""The camera's motion from the 2D stabilization of a movie clip: what that takes back, shutters can follow.

Blender's Python does not tell how it lays the picture; core/model/stabilization.py computes that from the clip's
tracks and settings, as Blender does.
"""

import math
from collections.abc import Callable
from functools import partial

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import MovieClip, MovieTrackingStabilization, PropertyGroup, Scene, Strip, bpy_struct

from ...core.messages import EffectError
from ...core.model import motions
from ...core.model.motions import Similarity
from ...core.model.stabilization import Settings, Stabilization, Track, laid
from ...core.recipes import region_keys
from ..data import annotations, fcurves, snapshot, validation
from . import follow_track, motion_keys
from .motion_keys import MotionKeys


def follow(scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    """Keys the camera by the stabilization of its clip, from where it is now, at the current frame. EffectError,
    MediaError: there is nothing to follow, and nothing has changed."""
    camera, start, size = effect.camera, scene.frame_current, annotations.picture_size(effect)
    validation.check_placement(camera)
    motion_keys.check_curves(effect, None)
    if camera.follow_clip is None:
        raise EffectError(rpt_("Choose a clip first"))
    times = follow_track.clip_times(scene, effect, strip, camera.follow_clip)
    if start not in times:
        raise EffectError(rpt_("the current frame is outside of the Shutter strip"))
    shifted = unstabilized(camera.follow_clip, size)
    seen = {frame: shifted(time) for frame, time in times.items()}
    keys = MotionKeys(effect, None, _motion(camera.follow_clip.tracking.stabilization))
    keys.begin(start)
    frames = sorted(times)
    known = {start, *keys.edited(range(frames[0], frames[-1] + 1))}
    moves = {origin: {frame: seen[frame].after(seen[origin].inverse()) for frame in frames} for origin in known}
    placements = follow_track.followed(snapshot.camera_at(scene, effect, frames), frames, moves, start, size)
    kept = motions.thinned(placements, region_keys.CORNERS, size, known, region_keys.STEADY)
    keys.write({frame: placements[frame] for frame in kept}, dict.fromkeys(frames, 1.0))
    camera.stops.clear()


def _motion(settings: MovieTrackingStabilization) -> str:
    if not settings.use_stabilize_rotation:
        return "LOCATION"
    return "SCALE" if settings.use_stabilize_scale else "ROTATION"


def unstabilized(clip: MovieClip, size: tuple[int, int]) -> Callable[[float], Similarity]:
    """The motion of the picture from where stabilization lays it to where the clip has it, at a time in the clip's
    frames. EffectError: the clip is not stabilized."""
    settings = clip.tracking.stabilization
    stabilization = _stabilization(clip, size[0] / size[1])
    if not settings.use_2d_stabilization or not stabilization.frames:
        raise EffectError(rpt_('clip "{clip}" has no 2D stabilization').format(clip=clip.name))
    value = _values(clip)

    def at(frame: int) -> Similarity:
        x, y = (value(settings, "target_position", frame, axis) for axis in (0, 1))
        taken = {name: value(settings, f"influence_{name}", frame) for name in ("location", "rotation", "scale")}
        target = complex(x * size[0] / size[1], y)
        angle, scale = value(settings, "target_rotation", frame), value(settings, "target_scale", frame)
        wanted = Settings(**taken, target=target, target_angle=angle, target_scale=scale)
        measured = stabilization.at(frame)
        assert measured is not None  # as there are frames
        return _in_pixels(laid(measured, wanted), size).inverse()

    def between(time: float) -> Similarity:
        first, second, share = at(math.floor(time)), at(math.ceil(time)), time - math.floor(time)
        turn = (1 - share) * first.turn + share * second.turn
        return Similarity(turn, (1 - share) * first.shift + share * second.shift)

    return between


def _stabilization(clip: MovieClip, aspect: float) -> Stabilization:
    settings, value, tracks = clip.tracking.stabilization, _values(clip), []
    used = [{track.name for track in each} for each in (settings.tracks, settings.rotation_tracks)]
    for track in clip.tracking.objects[0].tracks:
        frames, places = follow_track.markers_of(track)
        markers = dict(zip(frames.tolist(), (places * (aspect, 1) @ (1, 1j)).tolist(), strict=True))
        location, turn = (track.name in names for names in used)
        if location or turn:
            weight = partial(value, track, "weight_stab")
            tracks.append(Track(markers=markers, weight=weight, location=location, turn=turn))
    turned = settings.use_stabilize_rotation
    return Stabilization(tracks, settings.anchor_frame, turned=turned, scaled=turned and settings.use_stabilize_scale)


def _values(clip: MovieClip) -> Callable:
    """What a number of a clip is at one of its frames."""
    curves = fcurves.Curves(clip)

    def at(owner: bpy_struct, name: str, frame: int, axis: int | None = None) -> float:
        curve = curves.find(f"{owner.path_from_id()}.{name}", axis or 0)
        if curve is not None:
            return curve.evaluate(frame + clip.frame_start - 1)
        return getattr(owner, name) if axis is None else getattr(owner, name)[axis]

    return at


def _in_pixels(motion: Similarity, size: tuple[int, int]) -> Similarity:
    """A motion in heights of the picture, y up, as one in pixels, y down."""
    turn, origin = motion.turn.conjugate(), motions.pixel((0, 0), size)
    return Similarity(turn, origin - turn * origin + size[1] * motion.shift.conjugate())
