"""An effect's shutters: added, duplicated, removed, moved; and time maps, of which every pixel shows its own moment of
the window, as a ramp or a matte says."""

import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.types import PropertyGroup

from ...core.model import presets
from ...media import opencv
from ..data import fcurves, property_copy, validation
from . import bar_edits
from .region_edits import add_region, remove_region

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
    weights = presets.bars(preset, window, effect.position.lower())
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
