"""A time map: every pixel shows its own moment of the window, as a ramp or a matte says."""

from bpy.app.translations import pgettext_data as data_

from . import region_edits, shutter_edits


def add(effect, ramp: str):
    """Gives an effect two shutters, that show the first and the last frame of its window, the first one everywhere, and
    a ramp from one to the other; the ramp's region, which is the active one then.

    ramp: one of properties.RAMPS. EffectError: the window has no length, and nothing has changed."""
    first = shutter_edits.add_shutter(effect, data_("First"), "FIRST")
    shutter_edits.move_shutter(effect, list(effect.shutters).index(first), 0)
    last = shutter_edits.add_shutter(effect, data_("Last"), "LAST")
    effect.interpolation = "DISPLACEMENT"
    return region_edits.add_matte(effect, last, "RAMP", data_("Time Map"), ramp=ramp)
