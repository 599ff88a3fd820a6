"""Operators that make layers of regions."""

from bpy.types import Operator

from ..editing import bar_edits, layer_presets
from .operator_bases import OfRegion, own_classes


class SHUTTER_OT_sharp_subject(OfRegion, Operator):
    """Keep the active region sharp before all else, which is exposed for long and without it"""

    bl_label = "Sharp Subject"

    def change(self, context, effect):
        layer_presets.sharp_subject(effect, effect.active_region, bar_edits.auto_key(context))


class SHUTTER_OT_clean_trail(OfRegion, Operator):
    """Have the active region leave a trail before all else, which stays sharp"""

    bl_label = "Trail"

    def change(self, context, effect):
        layer_presets.clean_trail(effect, effect.active_region, bar_edits.auto_key(context))


classes = own_classes(globals())
