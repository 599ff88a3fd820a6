"""What one click makes of a subject that is drawn, or has a matte: it becomes a layer, which leaves no ghost."""

from bpy.app.translations import pgettext_data as data_

from ..data import consistency
from . import region_edits, shutter_edits

SMOOTHNESS = 6  # frames before and after each: half a second in all


def sharp_subject(effect, index: int, key: bool = False) -> None:
    """A region is sharp before all else, which is exposed for a whole window around the frame. key: keys the bars."""
    place = _as_layer(effect, index)
    shutter_edits.apply_preset(effect, place, "STILL", key)
    shutter_edits.apply_preset(effect, 0, "ANGLE_360", key)


def clean_trail(effect, index: int, key: bool = False) -> None:
    """A region leaves a trail, over a whole window around the frame, before all else, which is sharp. key: keys the
    bars."""
    place = _as_layer(effect, index)
    shutter_edits.apply_preset(effect, place, "ANGLE_360", key)
    shutter_edits.apply_preset(effect, 0, "STILL", key)


def panning_shot(effect, index: int, key: bool = False) -> None:
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


def _as_layer(effect, index: int) -> int:
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
