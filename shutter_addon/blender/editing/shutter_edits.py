"""Edit an effect's shutters: add, duplicate and remove them, apply presets, add time maps, and make regions layers."""

import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.types import PropertyGroup

from ...core.model import shutters
from ...media import opencv
from ..data import fcurves, property_copy, validation
from ..data.consistency import unique
from . import bar_edits
from .region_edits import add_region, assign_region, move, remove_region

# Distinct for color-blind people: seven by Okabe and Ito (https://jfly.uni-koeln.de/color), and the three farthest from
# them for all eyes.
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


def start(effect: PropertyGroup) -> None:
    """Set up a new effect: a shutter *Long* for the whole picture, a shutter *Sharp* for strokes, and some options.

    *Border* is on: the first stroke is sharp only around itself instead of everywhere. Streaks keep their length at the
    ends of the clip, and are smooth if OpenCV is installed. These are not the properties' defaults, on which recipes
    and older files rely.
    """
    effect.border, effect.edges = True, "SLIDE"
    effect.inbetween = "1" if opencv.cv2 is None else "AUTO"
    add_shutter(effect, data_("Long"))
    add_shutter(effect, data_("Sharp"), "STILL")


def add_shutter(effect: PropertyGroup, name: str = "", preset: str = "ANGLE_360") -> PropertyGroup:
    """Add a shutter with the bars of a preset at the end of the list, make it active and return it.

    Args:
        name: The shutter's name, made unique by a number; "": "Shutter".
        preset: A key of shutters.PRESETS.

    Raises:
        EffectError: The window's length is out of range. Nothing has changed.
    """
    color = _free_color(effect)
    validation.number(effect, "window")
    shutter = effect.shutters.add()
    shutter.name, shutter.color = name or data_("Shutter"), color
    effect.active_shutter = len(effect.shutters) - 1
    apply_preset(effect, effect.active_shutter, preset)
    return shutter


def apply_preset(effect: PropertyGroup, index: int, preset: str, key: bool = False) -> None:
    """Give a shutter the bars of a preset. They adapt to a new window or position until they are edited or keyed.

    Args:
        index: Index of the shutter.
        preset: A key of shutters.PRESETS.
        key: Also insert keyframes for the bars at the current frame.

    Raises:
        EffectError: The window's length is out of range. Nothing has changed.
    """
    shutter, window = effect.shutters[index], validation.number(effect, "window")
    shutter.preset, shutter.preset_position = preset, effect.position
    bar_edits.paint(effect, index, shutters.preset_bars(preset, window, effect.position.lower()), key)


def _free_color(effect: PropertyGroup) -> tuple[float, float, float]:
    """Return an RGB color for a new shutter: the first of COLORS that no shutter has. If all are taken, they repeat."""
    used = np.array([shutter.color for shutter in effect.shutters]).reshape(-1, 3)
    free = [color for color in COLORS if not np.isclose(used, color, atol=1e-3).all(axis=1).any()]
    return free[0] if free else COLORS[len(used) % len(COLORS)]


def duplicate_shutter(effect: PropertyGroup, index: int) -> PropertyGroup:
    """Add a copy of a shutter, with its keyframes but no regions, right after it. Make it active and return it.

    Args:
        index: Index of the shutter.
    """
    scene, path, color = effect.id_data, f"{effect.path_from_id()}.shutters", _free_color(effect)
    last, new = len(effect.shutters), effect.shutters.add()
    property_copy.copy_properties(effect.shutters[index], new)
    new.name, new.color = new.name, color  # setting a used name adds a number
    fcurves.copy_curves(scene, f"{path}[{index}].", scene, f"{path}[{last}].")
    move(effect, "shutter", last, index + 1)
    return effect.shutters[index + 1]


def remove_shutter(effect: PropertyGroup, index: int) -> None:
    """Remove the shutter with this index, its keyframes and its regions. The first remaining shutter is the default."""
    name = effect.shutters[index].name
    for i in reversed([i for i, region in enumerate(effect.regions) if region.shutter == name]):
        remove_region(effect, i)
    fcurves.remove_item(effect, "shutters", index)
    effect.active_shutter = min(effect.active_shutter, max(len(effect.shutters) - 1, 0))


def add_time_map(effect: PropertyGroup, ramp: str) -> PropertyGroup:
    """Add a shutter for the window's first frame, one for its last, and a ramp region between them. Return the region.

    The picture then shows the first frame where the ramp begins, later frames along it, and the last frame where it
    ends, as with a rolling shutter. For this, the effect's interpolation becomes "DISPLACEMENT".

    Args:
        ramp: The ramp's kind, an item of choices.RAMPS.

    Raises:
        EffectError: The window's length is out of range. Nothing has changed.
    """
    region = ramp_between(effect, (data_("First"), "FIRST"), (data_("Last"), "LAST"), data_("Time Map"), ramp)
    effect.interpolation = "DISPLACEMENT"
    return region


def ramp_between(
    effect: PropertyGroup, first: tuple[str, str], last: tuple[str, str], name: str, ramp: str
) -> PropertyGroup:
    """Add two shutters and a ramp region, along which the first gives way to the second. Return the region.

    The first shutter becomes the default, which exposes what no region covers. The region uses the second.

    Args:
        first: Name and preset (a key of shutters.PRESETS) of the first shutter.
        last: Name and preset of the second shutter.
        name: Name of the region.
        ramp: The ramp's kind, an item of choices.RAMPS.

    Raises:
        EffectError: The window's length is out of range. Nothing has changed.
    """
    add_shutter(effect, *first)
    move(effect, "shutter", effect.active_shutter, 0)
    return add_region(effect, add_shutter(effect, *last), "RAMP", name, ramp=ramp)


def as_layer(effect: PropertyGroup, index: int, own: str, rest: str, key: bool = False) -> None:
    """Make a region a layer in front of the rest of the picture, exposed by a shutter that no other region uses.

    If its shutter is the default, or other regions use it, it gets a new one. The layer's shutter and the default,
    which exposes the rest, get presets. They no longer follow a motion, and their exposure has a fixed number of
    frames. The window is centered on the shown frame.

    Args:
        index: Index of the region.
        own: Preset (a key of shutters.PRESETS) of the layer's shutter.
        rest: Preset of the default shutter.
        key: Also insert keyframes for the bars of both at the current frame.

    Raises:
        EffectError: The window's length is out of range.
    """
    region = effect.regions[index]
    place = effect.shutters.find(region.shutter)
    if place <= 0 or any(other.shutter == region.shutter for other in effect.regions if other != region):
        shutter = add_shutter(effect, unique(data_("Subject"), {shutter.name for shutter in effect.shutters}))
        assign_region(effect, index, shutter)
        place = len(effect.shutters) - 1
    effect.regions[index].is_layer = True
    effect.position = "CENTER"
    effect.active_shutter = place
    for i, preset in ((place, own), (0, rest)):
        effect.shutters[i].follow, effect.shutters[i].length = "NOTHING", "FRAMES"
        apply_preset(effect, i, preset, key)
