"""Operators that give an effect to another clip, and its shutters and regions to another effect."""

from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Operator

from ..data import data_format
from ..editing import add_effect, undelete
from .matte_operators import strip_items
from .operator_bases import OfEffect, own_classes, report_warning
from .operators import MakesEffect


class SHUTTER_OT_source(OfEffect, Operator):
    """Give the effect another clip: the movie, image or clip strip whose frames it exposes"""

    bl_label = "Choose Source"

    strip: EnumProperty(name="Strip", items=strip_items, translation_context=contexts.no_translation)

    def change(self, _context, effect):
        add_effect.choose_source(effect, self.effect_strip, self.edit.sequence_editor.strips_all[self.strip])


class SHUTTER_OT_effect_copy(OfEffect, Operator):
    """Copy the shutters, regions, keyframes and options of the effect, for other strips and scenes of this file"""

    bl_label = "Copy Effect"
    bl_options = {"REGISTER"}

    def change(self, _context, effect):
        undelete.copy(effect, self.effect_strip)
        if data_format.is_newer(self.edit):
            report_warning(self, rpt_("Copied, without what a newer version of Virtual Shutter has added"))


class SHUTTER_OT_effect_paste(MakesEffect, OfEffect, Operator):
    """Give the active strip the copied effect; where it has one, that is replaced"""

    bl_label = "Paste Effect"

    @classmethod
    def refusal(cls, context):
        return super().refusal(context) if undelete.has_copy() else rpt_("Copy an effect first")

    def change(self, _context, effect):
        undelete.paste(effect, self.effect_strip)


classes = own_classes(globals())
