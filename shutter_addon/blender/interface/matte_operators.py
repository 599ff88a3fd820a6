"""Operators for mattes, ramps and time maps."""

from pathlib import Path

import bpy
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy.types import Context, Operator, PropertyGroup
from bpy_extras.io_utils import ImportHelper

from ...core.messages import UserError
from ...core.model.choices import RAMPS
from ...core.model.limits import MAX_CHANNEL
from ..data import matte_content, recipe_import, selection, strips, validation
from ..editing import region_edits, shutter_edits
from ..output import matte_export
from . import needs
from .operator_bases import OfEffect, chosen_file, given, kept, operator


class SHUTTER_OT_matte_add(OfEffect, ImportHelper, Operator):
    """Make a movie, an image sequence or a picture the matte of the active shutter"""

    bl_label = "Matte from File"
    icon = "FILE_MOVIE"
    needs = (needs.room_for_a_region,)

    channel_name: given(StringProperty, "Channel Name", "Channel of an EXR file; empty: luminance", maxlen=MAX_CHANNEL)
    # What the file browser shows
    filter_movie: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_image: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        name = self.channel_name
        image = recipe_import.matte_image(bpy.path.abspath(chosen_file(self)), name or "luminance")
        channel = {"channel": "NAMED", "channel_name": name} if name else {}
        region_edits.add_region(effect, selection.active_shutter(effect), "MATTE", image.name, image=image, **channel)


@kept
def _strips(context: Context) -> list[tuple]:
    scene = selection.scene_of(context)
    all_strips = scene.sequence_editor.strips_all if scene and scene.sequence_editor else ()
    return [(strip.name, strip.name, "") for strip in all_strips if strip.type in strips.SOURCES]


STRIP = EnumProperty(name="Strip", items=_strips, translation_context=contexts.no_translation)


@operator("Matte from Strip", needs.room_for_a_region, icon="SEQUENCE", strip=STRIP)
def matte_strip(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Make a movie, image or clip strip of the edit the matte of the active shutter, even if it is muted"""
    region = region_edits.add_region(effect, selection.active_shutter(effect), "MATTE", self.strip, matte="STRIP")
    matte_content.choose_strip(region, self.strip)


_FORMATS = (("PNG", "PNG", "Grey, 16 bits"), ("EXR", "OpenEXR", "Float, in the channel Y"))


class SHUTTER_OT_matte_export(OfEffect, ImportHelper, Operator):
    """Write the active matte or outline as pictures, one for each frame of its strip, for other programs"""

    bl_label = "Export Matte"
    icon = "EXPORT"
    bl_options = {"REGISTER"}
    needs = (needs.a_cover,)

    directory: StringProperty(name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE"})
    format: EnumProperty(name="Format", description="File format of the pictures", items=_FORMATS)
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        folder = Path(bpy.path.abspath(self.directory or str(Path(self.filepath).parent)))
        region, word = selection.active_region(effect), self.format.lower()
        try:
            count = matte_export.save(self.edit, effect, self.effect_strip, region, folder, word)
        except OSError as error:
            raise UserError(f"{folder}: {error.strerror or error}") from None
        self.report({"INFO"}, rpt_('Saved {count} pictures in "{folder}"').format(count=count, folder=folder))


_RAMP = EnumProperty(name="Ramp", description="Shape of the ramp", items=RAMPS)


@operator("Ramp", needs.room_for_a_region, icon="IPO_EASE_IN_OUT", ramp=_RAMP)
def ramp_add(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Make a ramp across the picture the matte of the active shutter"""
    region_edits.add_region(effect, selection.active_shutter(effect), "RAMP", ramp=self.ramp)


def _why_no_time_map(effect: PropertyGroup) -> str | None:
    return validation.why_full(effect, regions=1, shutters=2)


@operator("Time Map", needs.a_shutter, _why_no_time_map, icon="TIME", ramp=_RAMP)
def time_map(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Show every pixel at its own moment: a ramp from the first frame to the last (slit-scan)"""
    shutter_edits.add_time_map(effect, self.ramp)
