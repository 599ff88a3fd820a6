"""Operators that give an effect to another clip, its shutters and regions to another effect or a recipe, and a report
to whoever helps."""

from pathlib import Path

import bpy
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty, StringProperty
from bpy.types import Context, Operator, PropertyGroup
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ...core.messages import UserError
from ...core.recipes import recipe_file
from ..data import data_format, recipe_import, selection
from ..editing import add_effect, undelete
from ..output import error_report, matte_export
from .matte_operators import strip_items
from .operator_bases import Named, OfEffect, chosen_file, operator, report_error, report_warning
from .operators import MakesEffect

_STRIP = EnumProperty(name="Strip", items=strip_items, translation_context=contexts.no_translation)


@operator("Choose Source", strip=_STRIP)
def source(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Give the effect another clip: the movie, image or clip strip whose frames it exposes"""
    add_effect.choose_source(effect, self.effect_strip, self.edit.sequence_editor.strips_all[self.strip])


@operator("Copy Effect", options={"REGISTER"})
def effect_copy(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Copy the shutters, regions, keyframes and options of the effect, for other strips and scenes of this file"""
    undelete.copy(effect, self.effect_strip)
    if data_format.is_newer(self.edit):
        report_warning(self, rpt_("Copied, without what a newer version of Virtual Shutter has added"))


class SHUTTER_OT_effect_paste(MakesEffect, OfEffect, Operator):
    """Give the active strip the copied effect; where it has one, that is replaced"""

    bl_label = "Paste Effect"

    @classmethod
    def refusal(cls, context: Context) -> str | None:
        return super().refusal(context) if undelete.has_copy() else rpt_("Copy an effect first")

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        undelete.paste(effect, self.effect_strip)


class SHUTTER_OT_recipe_import(OfEffect, ImportHelper, Operator):
    """Replace the shutters, regions, keyframes and options of the effect with those of a recipe file"""

    bl_label = "Import Recipe"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        path = Path(chosen_file(self))
        found = recipe_file.load(path)
        recipe_import.apply(self.edit, effect, self.effect_strip, found, path.parent)
        if found.lost is not None:
            self.report({"WARNING"}, rpt_(found.lost.template).format(**found.lost.words))


class SHUTTER_OT_recipe_export(OfEffect, ExportHelper, Operator):
    """Save the shutters, regions, keyframes and options of the effect as a recipe file"""

    bl_label = "Export Recipe"
    bl_options = {"REGISTER"}
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        path = chosen_file(self)
        try:
            recipe_file.save(matte_export.recipe_for(self.edit, effect, self.effect_strip, Path(path)), path)
        except OSError as error:
            raise UserError(f"{path}: {error.strerror or error}") from None
        if data_format.is_newer(self.edit):
            words = rpt_('Saved "{path}", without what a newer version of Virtual Shutter has added')
            report_warning(self, words.format(path=path))
        else:
            self.report({"INFO"}, rpt_('Saved "{path}"').format(path=path))


class SHUTTER_OT_copy_report(Named, Operator):
    """Copy versions, device, kinds and numbers of the edit, and last errors: no names, no paths. Nothing is sent"""

    bl_label = "Copy Report"

    def execute(self, context: Context) -> set[str]:
        if bpy.app.background:
            report_error(self, rpt_("Without a window there is no clipboard: use the command check with --report"))
            return {"CANCELLED"}
        context.window_manager.clipboard = error_report.text(selection.scene_of(context))
        self.report({"INFO"}, rpt_("Report copied: paste it into your message, and read it before you send it"))
        return {"FINISHED"}
