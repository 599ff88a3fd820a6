"""Exposures of one click that follow a tracked region or the camera."""

from bpy.types import PropertyGroup, Scene, Strip

from ....blender.data import snapshot
from ....blender.data.consistency import unique
from ....blender.editing.motion_keys import MotionKeys
from ....blender.editing.shutter_edits import apply_preset, as_layer
from . import track_region

SMOOTHNESS = 6  # frames before and after each: half a second


def follow(effect: PropertyGroup, index: int, subject: str, key: bool) -> None:
    """Make a shutter follow its region ("REGION") or the camera ("CAMERA"), fully open around the frame.

    Args:
        key: insert keyframes for its bars.

    Raises:
        EffectError: the window has no length. Nothing has changed.
    """
    apply_preset(effect, index, "ANGLE_360", key)
    shutter = effect.shutters[index]
    shutter.follow, shutter.length, effect.position = subject, "FRAMES", "CENTER"
    shutter.follow_motion, shutter.follow_smooth = "SCALE", 0


def panning_shot(effect: PropertyGroup, index: int, key: bool = False) -> None:
    """Make a region a sharp layer, and make the other exposure move with it, like a panning camera.

    Args:
        key: insert keyframes for the bars.
    """
    as_layer(effect, index, "STILL", "ANGLE_360", key)
    region = effect.regions[index]
    region.name = unique(region.name, {other.name for other in effect.regions if other != region})
    follow(effect, 0, "REGION", key)
    default = effect.shutters[0]
    default.follow_region = region.name
    # Rotation and scale of a small subject are uncertain and would whirl distant pixels. A real camera pans smoothly.
    default.follow_motion, default.follow_smooth = "LOCATION", SMOOTHNESS


def is_tracked(scene: Scene, effect: PropertyGroup, strip: Strip, index: int | None) -> bool:
    """Return whether a region or the camera has a motion that reaches the current frame, which may be in another shot.

    Otherwise *Panning Shot* and *Stabilize Exposure* track it first.
    """
    frame = scene.frame_current
    has_motion = MotionKeys(effect, index, "SCALE").reach(frame)
    return has_motion and (index is None or bool(snapshot.strokes_at(scene, effect, strip, index, frame)))


def tripod(effect: PropertyGroup, key: bool = False) -> None:
    """Make the active shutter follow the camera, fully open around the frame.

    Without a region it covers nothing, so the default shutter is used instead.

    Args:
        key: insert keyframes for the bars.

    Raises:
        EffectError: the window has no length. Nothing has changed.
    """
    index, name = effect.active_shutter, effect.shutters[effect.active_shutter].name
    if not any(region.shutter == name for region in effect.regions):
        index = 0
    follow(effect, index, "CAMERA", key)
    effect.active_shutter = index
    track_region.key_ends(effect, None)  # the window has moved
