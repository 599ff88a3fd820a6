"""A panning shot, like a camera's that pans with its subject: that is sharp, and all that stands still streaks."""

from bpy.app.translations import pgettext_rpt as rpt_

from ...core.messages import EffectError
from ..data import consistency, snapshot
from . import shutter_edits
from .motion_keys import MotionKeys

SMOOTHNESS = 6  # frames before and after each: half a second in all


def is_ready(scene, effect, strip, index: int) -> bool:
    """Whether a region has keys of motion, and those that were tracked reach the current frame; without, it has to be
    tracked first. EffectError: it has keys, and no strokes that could be followed."""
    if not MotionKeys(effect, index, "SCALE").reach(scene.frame_current):
        return False
    if not snapshot.strokes_at(scene, effect, strip, index, scene.frame_current):
        raise EffectError(rpt_("the region has no strokes to follow"))
    return True


def set_up(effect, index: int, key: bool = False) -> None:
    """Has a region's shutter follow it, open for a whole window that lies around the frame. The shutter becomes the
    default, so that it holds wherever no other one has a region.

    key: keys the bars at the current frame. EffectError: the window has no length, and nothing has changed."""
    region = effect.regions[index]
    place = effect.shutters.find(region.shutter)
    shutter_edits.follow(effect, place, "REGION", key)
    region.name = consistency.unique(region.name, {other.name for other in effect.regions if other != region})
    shutter = effect.shutters[place]
    shutter.follow_region = region.name
    # Turns and scales of a small subject are unsure, and whirl what is far from it; and a camera on its head has mass.
    shutter.follow_motion, shutter.follow_smooth = "LOCATION", SMOOTHNESS
    shutter_edits.move_shutter(effect, place, 0)
