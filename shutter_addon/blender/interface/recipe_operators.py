"""Operators that read an effect from a recipe, and write one."""

from pathlib import Path

from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import StringProperty
from bpy.types import Operator
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ...core.recipes import recipe, recipe_file
from ..data import data_format, recipe_import, selection
from ..output import matte_export
from ..rendering.effect_source import FAULTS
from .operator_bases import OfEffect, chosen_file, report_error, report_warning


class SHUTTER_OT_recipe_import(OfEffect, ImportHelper, Operator):
    """Replace the shutters, regions, keyframes and options of the effect with those of a recipe file"""

    bl_idname = "shutter.recipe_import"
    bl_label = "Import Recipe"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def change(self, context, effect):
        scene, _effect, strip = selection.active(context)
        try:
            path = Path(chosen_file(self))
            recipe_import.apply(scene, effect, strip, recipe_file.load(path), path.parent)
        except (recipe.RecipeError, *FAULTS) as error:
            report_error(self, str(error))
            return {"CANCELLED"}
        return None


class SHUTTER_OT_recipe_export(OfEffect, ExportHelper, Operator):
    """Save the shutters, regions, keyframes and options of the effect as a recipe file"""

    bl_idname = "shutter.recipe_export"
    bl_label = "Export Recipe"
    bl_options = {"REGISTER"}
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def change(self, context, effect):
        scene, _effect, strip = selection.active(context)
        try:
            path = chosen_file(self)
            recipe_file.save(matte_export.recipe_for(scene, effect, strip, Path(path)), path)
        except (recipe.RecipeError, *FAULTS) as error:
            report_error(self, str(error))
            return {"CANCELLED"}
        except OSError as error:
            sentence = f"{self.filepath}: {error.strerror or error}"
            report_error(self, sentence)
            return {"CANCELLED"}
        if data_format.is_newer(scene):
            words = rpt_('Saved "{path}", without what a newer version of Virtual Shutter has added')
            report_warning(self, words.format(path=path))
            return None
        self.report({"INFO"}, rpt_('Saved "{path}"').format(path=path))
        return None


classes = SHUTTER_OT_recipe_import, SHUTTER_OT_recipe_export
