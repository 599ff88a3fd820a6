"""Operators that give an effect to another clip, and its shutters and regions to another effect."""

from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Operator

from ..data import data_format, selection
from ..editing import add_effect, undelete
from .matte_operators import strip_items
from .operator_bases import OfEffect, refused, report_warning
from .operators import MakesEffect


class SHUTTER_OT_source(OfEffect, Operator):
    """Give the effect another clip: the movie, image or clip strip whose frames it exposes"""

    bl_idname = "shutter.source"
    bl_label = "Choose Source"

    strip: EnumProperty(name="Strip", items=strip_items, translation_context=contexts.no_translation)

    def change(self, context, effect):
        scene, _effect, strip = selection.active(context)
        add_effect.choose_source(effect, strip, scene.sequence_editor.strips_all[self.strip])


class SHUTTER_OT_effect_copy(OfEffect, Operator):
    """Copy the shutters, regions, keyframes and options of the effect, for other strips and scenes of this file"""

    bl_idname = "shutter.effect_copy"
    bl_label = "Copy Effect"
    bl_options = {"REGISTER"}

    def change(self, context, effect):
        scene, _effect, strip = selection.active(context)
        undelete.copy(effect, strip)
        if data_format.is_newer(scene):
            report_warning(self, rpt_("Copied, without what a newer version of Virtual Shutter has added"))


class SHUTTER_OT_effect_paste(MakesEffect, OfEffect, Operator):
    """Give the active strip the copied effect; where it has one, that is replaced"""

    bl_idname = "shutter.effect_paste"
    bl_label = "Paste Effect"

    @classmethod
    def poll(cls, context):
        return super().poll(context) if undelete.has_copy() else refused(cls, rpt_("Copy an effect first"))

    def change(self, context, effect):
        undelete.paste(effect, selection.active(context)[2])


classes = SHUTTER_OT_source, SHUTTER_OT_effect_copy, SHUTTER_OT_effect_paste
