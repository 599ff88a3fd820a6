"""What one click makes of a subject that is drawn, or has a matte: it becomes a layer, which leaves no ghost."""

import numpy as np
from bpy.app.translations import pgettext_data as data_

from ...core.model import presets
from ...core.model.frame_state import Options
from ..data import consistency, inbetween_settings, validation
from . import bar_edits, region_edits, shutter_edits

SMOOTHNESS = 6  # frames before and after each: half a second in all


def sharp_subject(effect, index: int, key: bool = False) -> None:
    """A region is sharp before all else, which is exposed for a whole window around the frame. key: keys the bars."""
    place = _as_layer(effect, index)
    bar_edits.paint(effect, place, still(effect), key)
    bar_edits.paint(effect, 0, _long(effect), key)


def clean_trail(effect, index: int, key: bool = False) -> None:
    """A region leaves a trail, over a whole window around the frame, before all else, which is sharp. key: keys the
    bars."""
    place = _as_layer(effect, index)
    bar_edits.paint(effect, place, _long(effect), key)
    bar_edits.paint(effect, 0, still(effect), key)


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


def still(effect) -> np.ndarray:
    """Bars (L,) that are open for the shown frame alone, with the in-between frames that belong to it."""
    window, step = validation.number(effect, "window"), inbetween_settings.factor(effect)
    first = Options(window, position=validation.word(effect, "position").lower(), step=step).before
    bars = np.zeros(window)
    bars[first : first + step] = 1
    return bars


def _long(effect) -> np.ndarray:
    return presets.bars("ANGLE_360", validation.number(effect, "window"))


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
