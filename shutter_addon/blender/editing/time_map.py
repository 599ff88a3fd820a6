"""A time map: every pixel shows its own moment of the window, as a ramp or a matte says."""

from bpy.app.translations import pgettext_data as data_
from bpy.types import PropertyGroup

from . import region_edits, shutter_edits


def add(effect: PropertyGroup, ramp: str) -> PropertyGroup:
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
    shutter_edits.add_shutter(effect, *first)
    shutter_edits.move_shutter(effect, effect.active_shutter, 0)
    return region_edits.add_region(effect, shutter_edits.add_shutter(effect, *last), "RAMP", name, ramp=ramp)
