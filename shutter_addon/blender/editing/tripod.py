"""A tripod, for footage that was held in the hand: an exposure for which the camera stands still."""

from . import shutter_edits, track_region
from .motion_keys import MotionKeys


def is_ready(effect) -> bool:
    """Whether the camera has keys of motion, and those that were tracked reach the current frame, whose shot may be
    another one; without, it has to be tracked first."""
    return MotionKeys(effect, None, "SCALE").reach(effect.id_data.frame_current)


def set_up(effect, key: bool = False) -> None:
    """Has the active shutter follow the camera, open for a whole window that lies around the frame. Where it has no
    region, and so holds nowhere, the default one takes its place.

    key: keys the bars at the current frame. EffectError: the window has no length, and nothing has changed."""
    index, name = effect.active_shutter, effect.shutters[effect.active_shutter].name
    if not any(region.shutter == name for region in effect.regions):
        index = 0
    shutter_edits.follow(effect, index, "CAMERA", key)
    effect.active_shutter = index
    track_region.key_ends(effect, None)  # the window lies elsewhere now
