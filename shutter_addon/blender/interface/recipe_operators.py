"""Operators that read an effect from a recipe, and write one."""

from pathlib import Path

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty
from bpy.types import Operator
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ...core.messages import UserError
from ...core.recipes import recipe_file
from ..data import data_format, recipe_import
from ..output import matte_export
from .operator_bases import OfEffect, chosen_file, own_classes, report_warning


class SHUTTER_OT_recipe_import(OfEffect, ImportHelper, Operator):
    """Replace the shutters, regions, keyframes and options of the effect with those of a recipe file"""

    bl_label = "Import Recipe"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def change(self, _context, effect):
        path = Path(chosen_file(self))
        recipe_import.apply(self.edit, effect, self.effect_strip, recipe_file.load(path), path.parent)


class SHUTTER_OT_recipe_export(OfEffect, ExportHelper, Operator):
    """Save the shutters, regions, keyframes and options of the effect as a recipe file"""

    bl_label = "Export Recipe"
    bl_options = {"REGISTER"}
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def change(self, _context, effect):
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


classes = own_classes(globals())
