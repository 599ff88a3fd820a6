"""What one click makes of a subject that is drawn, or has a matte: it becomes a layer, which leaves no ghost; and of
footage that was held in the hand: an exposure for which the camera stands still."""

from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core.messages import EffectError
from ..data import consistency, snapshot
from . import region_edits, shutter_edits, track_region
from .motion_keys import MotionKeys

SMOOTHNESS = 6  # frames before and after each: half a second in all


def sharp_subject(effect: PropertyGroup, index: int, key: bool = False) -> None:
    """A region is sharp before all else, which is exposed for a whole window around the frame. key: keys the bars."""
    place = _as_layer(effect, index)
    shutter_edits.apply_preset(effect, place, "STILL", key)
    shutter_edits.apply_preset(effect, 0, "ANGLE_360", key)


def clean_trail(effect: PropertyGroup, index: int, key: bool = False) -> None:
    """A region leaves a trail, over a whole window around the frame, before all else, which is sharp. key: keys the
    bars."""
    place = _as_layer(effect, index)
    shutter_edits.apply_preset(effect, place, "ANGLE_360", key)
    shutter_edits.apply_preset(effect, 0, "STILL", key)


def panning_shot(effect: PropertyGroup, index: int, key: bool = False) -> None:
    """As sharp_subject; and the exposure of all else moves with the region, as a camera's that pans with it. key: keys
    the bars."""
    sharp_subject(effect, index, key)
    region = effect.regions[index]
    region.name = consistency.unique(region.name, {other.name for other in effect.regions if other != region})
    shutter_edits.follow(effect, 0, "REGION", key)
    default = effect.shutters[0]
    default.follow_region = region.name
    # Turns and scales of a small subject are unsure, and whirl what is far from it; and a camera on its head has mass.
    default.follow_motion, default.follow_smooth = "LOCATION", SMOOTHNESS


def can_pan(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Whether a region has keys of motion, and those that were tracked reach the current frame; without, it has to be
    tracked before its panning shot. EffectError: it has keys, and no strokes that could be followed."""
    if not MotionKeys(effect, index, "SCALE").reach(scene.frame_current):
        return False
    if not snapshot.strokes_at(scene, effect, strip, index, scene.frame_current):
        raise EffectError(rpt_("the region has no strokes to follow"))
    return True


def can_stand(effect: PropertyGroup) -> bool:
    """Whether the camera has keys of motion, and those that were tracked reach the current frame, whose shot may be
    another one; without, it has to be tracked before it stands still."""
    return MotionKeys(effect, None, "SCALE").reach(effect.id_data.frame_current)


def tripod(effect: PropertyGroup, key: bool = False) -> None:
    """Has the active shutter follow the camera, open for a whole window that lies around the frame. Where it has no
    region, and so holds nowhere, the default one takes its place.

    key: keys the bars at the current frame. EffectError: the window has no length, and nothing has changed."""
    index, name = effect.active_shutter, effect.shutters[effect.active_shutter].name
    if not any(region.shutter == name for region in effect.regions):
        index = 0
    shutter_edits.follow(effect, index, "CAMERA", key)
    effect.active_shutter = index
    track_region.key_ends(effect, None)  # the window lies elsewhere now


def _as_layer(effect: PropertyGroup, index: int) -> int:
    """Makes a region a layer of a shutter of its own, which moves with nothing, as the default one; the place of that
    shutter."""
    region = effect.regions[index]
    place = effect.shutters.find(region.shutter)
    if place <= 0 or any(other.shutter == region.shutter for other in effect.regions if other != region):
        names = {shutter.name for shutter in effect.shutters}
        shutter = shutter_edits.add_shutter(effect, consistency.unique(data_("Subject"), names))
        region_edits.assign_region(effect, index, shutter)
        place = len(effect.shutters) - 1
    for shutter in (effect.shutters[0], effect.shutters[place]):
        shutter.follow, shutter.length = "NOTHING", "FRAMES"
    effect.regions[index].is_layer = True
    effect.position = "CENTER"
    effect.active_shutter = place
    return place
