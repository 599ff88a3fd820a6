"""The operator that copies a report of an error, and its place in panels."""

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Operator

from ..data import selection
from ..output import error_report
from .operator_bases import Mixin, Named, own_classes, report_error


class SHUTTER_OT_copy_report(Named, Operator):
    """Copy versions, device, kinds and numbers of the edit, and last errors: no names, no paths. Nothing is sent"""

    bl_label = "Copy Report"

    def execute(self, context):
        if bpy.app.background:
            report_error(self, rpt_("Without a window there is no clipboard: use the command check with --report"))
            return {"CANCELLED"}
        context.window_manager.clipboard = error_report.text(selection.scene_of(context))
        self.report({"INFO"}, rpt_("Report copied: paste it into your message, and read it before you send it"))
        return {"FINISHED"}


class Report(Mixin):
    """The last of the tab, whether there is an effect or not."""

    bl_label = "Report"
    bl_options = {"HIDE_HEADER"}

    def draw(self, _context):
        self.layout.operator("shutter.copy_report", icon="COPYDOWN")


classes = own_classes(globals())
