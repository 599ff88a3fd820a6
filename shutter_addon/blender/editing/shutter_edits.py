"""An effect's shutters: added, duplicated, removed, moved; and time maps, of which every pixel shows its own moment of
the window, as a ramp or a matte says.

What one click makes of a subject that is drawn, or has a matte: it becomes a layer, which leaves no ghost. And of
footage that was held in the hand: an exposure for which the camera stands still.
"""

import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core.messages import EffectError
from ...core.model import shutters
from ...media import opencv
from ..data import fcurves, property_copy, snapshot, validation
from ..data.consistency import unique
from . import bar_edits, track_region
from .motion_keys import MotionKeys
from .region_edits import add_region, assign_region, remove_region

SMOOTHNESS = 6  # frames before and after each: half a second in all

# Told apart by eyes that lack red, green or blue cones: seven by Okabe and Ito (https://jfly.uni-koeln.de/color), then
# three that lie farthest from these to all eyes.
COLORS = (
    (0.337, 0.706, 0.914),
    (0.902, 0.624, 0.0),
    (0.0, 0.62, 0.451),
    (0.8, 0.475, 0.655),
    (0.941, 0.894, 0.259),
    (0.835, 0.369, 0.0),
    (0.0, 0.447, 0.698),
    (0.647, 1.0, 0.765),
    (0.529, 0.294, 0.176),
    (0.529, 0.471, 1.0),
)


# Shutters


def start(effect: PropertyGroup) -> None:
    """What a new effect begins with: a long shutter everywhere, and a sharp one to scribble with.

    With the border, the first scribble is sharp around itself; without, it would be the only one, and hold everywhere.
    Streaks keep their length up to the clip's ends, and are smooth where OpenCV finds moments between frames. A recipe
    says so itself, and older files have another default.
    """
    effect.border, effect.edges = True, "SLIDE"
    effect.inbetween = "1" if opencv.cv2 is None else "AUTO"
    add_shutter(effect, data_("Long"))
    add_shutter(effect, data_("Sharp"), "STILL")


def add_shutter(effect: PropertyGroup, name: str = "", preset: str = "ANGLE_360") -> PropertyGroup:
    """Appends a shutter, fully open unless another preset is given, and makes it the active one. EffectError: the
    window has no length, and nothing has changed."""
    color = _free_color(effect)
    validation.number(effect, "window")
    shutter = effect.shutters.add()
    shutter.name, shutter.color = name or data_("Shutter"), color
    effect.active_shutter = len(effect.shutters) - 1
    apply_preset(effect, effect.active_shutter, preset)
    return shutter


def apply_preset(effect: PropertyGroup, index: int, preset: str, key: bool = False) -> None:
    """Gives a shutter the bars of a preset, which it keeps to (consistency.preset_of); key: keys them at the current
    frame. EffectError: the window has no length, and nothing has changed."""
    shutter, window = effect.shutters[index], validation.number(effect, "window")
    shutter.preset, shutter.preset_position = preset, effect.position
    weights = shutters.preset_bars(preset, window, effect.position.lower())
    bar_edits.paint(effect, index, weights, key)


def _free_color(effect: PropertyGroup) -> tuple[float, float, float]:
    """The first colour that no shutter has; where all are taken, they begin anew."""
    used = np.array([shutter.color for shutter in effect.shutters]).reshape(-1, 3)
    free = [color for color in COLORS if not np.isclose(used, color, atol=1e-3).all(axis=1).any()]
    return free[0] if free else COLORS[len(used) % len(COLORS)]


def duplicate_shutter(effect: PropertyGroup, index: int) -> PropertyGroup:
    """A copy of a shutter, with its keys, behind it; regions stay with the original."""
    scene, path, color = effect.id_data, f"{effect.path_from_id()}.shutters", _free_color(effect)
    last, new = len(effect.shutters), effect.shutters.add()
    property_copy.copy_properties(effect.shutters[index], new)
    new.name, new.color = new.name, color  # a name that is taken gets a number as it is set
    fcurves.copy_curves(scene, f"{path}[{index}].", scene, f"{path}[{last}].")
    move_shutter(effect, last, index + 1)
    effect.active_shutter = index + 1
    return effect.shutters[index + 1]


def follow(effect: PropertyGroup, index: int, subject: str, key: bool) -> None:
    """Has a shutter follow its region ("REGION") or the camera ("CAMERA"), open for a whole window that lies around the
    frame; key: keys the bars at the current frame. EffectError: the window has no length, and nothing has changed."""
    apply_preset(effect, index, "ANGLE_360", key)
    shutter = effect.shutters[index]
    shutter.follow, shutter.length, effect.position = subject, "FRAMES", "CENTER"
    shutter.follow_motion, shutter.follow_smooth = "SCALE", 0


def remove_shutter(effect: PropertyGroup, index: int) -> None:
    """Removes a shutter, its keys and its regions. The first of those that remain is the default."""
    name = effect.shutters[index].name
    for i in reversed([i for i, region in enumerate(effect.regions) if region.shutter == name]):
        remove_region(effect, i)
    fcurves.remove_item(effect, "shutters", index)
    effect.active_shutter = min(effect.active_shutter, max(len(effect.shutters) - 1, 0))


def move_shutter(effect: PropertyGroup, index: int, to: int) -> None:
    """Moves a shutter in the list; whichever comes first is the default."""
    fcurves.move_item(effect, "shutters", index, to)
    effect.active_shutter = to


def add_time_map(effect: PropertyGroup, ramp: str) -> PropertyGroup:
    """Gives an effect two shutters, that show the first and the last frame of its window, the first one everywhere, and
    a ramp from one to the other; the ramp's region, which is the active one then.

    ramp: one of properties.RAMPS. EffectError: the window has no length, and nothing has changed."""
    region = ramp_between(effect, (data_("First"), "FIRST"), (data_("Last"), "LAST"), data_("Time Map"), ramp)
    effect.interpolation = "DISPLACEMENT"
    return region


def ramp_between(
    effect: PropertyGroup, first: tuple[str, str], last: tuple[str, str], name: str, ramp: str
) -> PropertyGroup:
    """Adds two shutters, by name and preset, the first of which is the default, and the ramp between them."""
    add_shutter(effect, *first)
    move_shutter(effect, effect.active_shutter, 0)
    return add_region(effect, add_shutter(effect, *last), "RAMP", name, ramp=ramp)


# Layers, and a camera that stands still


def sharp_subject(effect: PropertyGroup, index: int, key: bool = False) -> None:
    """A region is sharp before all else, which is exposed for a whole window around the frame. key: keys the bars."""
    place = _as_layer(effect, index)
    apply_preset(effect, place, "STILL", key)
    apply_preset(effect, 0, "ANGLE_360", key)


def clean_trail(effect: PropertyGroup, index: int, key: bool = False) -> None:
    """A region leaves a trail, over a whole window around the frame, before all else, which is sharp. key: keys the
    bars."""
    place = _as_layer(effect, index)
    apply_preset(effect, place, "ANGLE_360", key)
    apply_preset(effect, 0, "STILL", key)


def panning_shot(effect: PropertyGroup, index: int, key: bool = False) -> None:
    """As sharp_subject; and the exposure of all else moves with the region, as a camera's that pans with it. key: keys
    the bars."""
    sharp_subject(effect, index, key)
    region = effect.regions[index]
    region.name = unique(region.name, {other.name for other in effect.regions if other != region})
    follow(effect, 0, "REGION", key)
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
    follow(effect, index, "CAMERA", key)
    effect.active_shutter = index
    track_region.key_ends(effect, None)  # the window lies elsewhere now


def _as_layer(effect: PropertyGroup, index: int) -> int:
    """Makes a region a layer of a shutter of its own, which moves with nothing, as the default one; the place of that
    shutter."""
    region = effect.regions[index]
    place = effect.shutters.find(region.shutter)
    if place <= 0 or any(other.shutter == region.shutter for other in effect.regions if other != region):
        names = {shutter.name for shutter in effect.shutters}
        shutter = add_shutter(effect, unique(data_("Subject"), names))
        assign_region(effect, index, shutter)
        place = len(effect.shutters) - 1
    for shutter in (effect.shutters[0], effect.shutters[place]):
        shutter.follow, shutter.length = "NOTHING", "FRAMES"
    effect.regions[index].is_layer = True
    effect.position = "CENTER"
    effect.active_shutter = place
    return place
