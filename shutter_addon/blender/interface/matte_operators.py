"""Operators that make regions of mattes, ramps and time maps."""

from pathlib import Path

import bpy
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy.types import Context, Mask, Operator, PropertyGroup
from bpy_extras.io_utils import ImportHelper

from ...core.messages import UserError
from ...core.model.choices import RAMPS
from ...core.model.limits import MAX_CHANNEL
from ..data import matte_strips, recipe_import, selection, strips
from ..editing import outline_masks, region_edits, time_map
from ..output import matte_export
from .operator_bases import Adds, OfRegion, chosen_file, kept, own_classes


class SHUTTER_OT_matte_add(Adds, ImportHelper, Operator):
    """Make a movie, an image sequence or a picture the matte of the active shutter"""

    bl_label = "Matte from File"

    channel_name: StringProperty(
        name="Channel Name",
        description="Name of a channel of an EXR file; empty for the luminance",
        maxlen=MAX_CHANNEL,
        options={"SKIP_SAVE"},
    )
    # What the file browser shows.
    filter_movie: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_image: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        name = self.channel_name
        image = recipe_import.matte_image(bpy.path.abspath(chosen_file(self)), name or "luminance")
        channel = {"channel": "NAMED", "channel_name": name} if name else {}
        region_edits.add_region(effect, selection.active_shutter(effect), "MATTE", image.name, image=image, **channel)


@kept
def strip_items(context: Context) -> list[tuple]:
    scene = selection.scene_of(context)
    all_strips = scene.sequence_editor.strips_all if scene and scene.sequence_editor else ()
    return [(strip.name, strip.name, "") for strip in all_strips if strip.type in strips.SOURCES]


class SHUTTER_OT_matte_strip(Adds, Operator):
    """Make a movie, image or clip strip of the edit the matte of the active shutter, muted or not"""

    bl_label = "Matte from Strip"

    strip: EnumProperty(name="Strip", items=strip_items, translation_context=contexts.no_translation)

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        region = region_edits.add_region(effect, selection.active_shutter(effect), "MATTE", self.strip, matte="STRIP")
        matte_strips.choose_strip(region, self.strip)


@kept
def _masks(_context: Context) -> list[tuple]:
    return [(mask.name_full, mask.name_full, "") for mask in bpy.data.masks]


class _OfMask(Adds):
    """Adds a region that a mask makes."""

    mask: EnumProperty(name="Mask", items=_masks, translation_context=contexts.no_translation)

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        if sentence := super().why_not(effect):
            return sentence
        return None if bpy.data.masks else rpt_("There is no mask: draw one in the Mask mode of an image or clip")

    def chosen(self) -> Mask:
        return next(mask for mask in bpy.data.masks if mask.name_full == self.mask)


class SHUTTER_OT_matte_mask(_OfMask, Operator):
    """Make a mask the matte of the active shutter"""

    bl_label = "Matte from Mask"

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        mask = self.chosen()
        region_edits.add_region(effect, selection.active_shutter(effect), "MATTE", mask.name, matte="MASK", mask=mask)


class SHUTTER_OT_outline_from_mask(_OfMask, Operator):
    """Make an outline of the active shutter that is drawn at each key of a mask"""

    bl_label = "Outline from Mask"

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        shutter = selection.active_shutter(effect)
        outline_masks.from_mask(self.edit, effect, self.effect_strip, shutter, self.chosen())


class SHUTTER_OT_matte_export(OfRegion, ImportHelper, Operator):
    """Write what the active matte or outline shows at each frame of its strip as pictures, for any other program"""

    bl_label = "Export Matte"
    bl_options = {"REGISTER"}

    directory: StringProperty(name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE"})
    format: EnumProperty(
        name="Format",
        description="What the pictures are",
        items=(("PNG", "PNG", "Grey, 16 bits"), ("EXR", "OpenEXR", "Float, in the channel Y")),
    )
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        if sentence := super().why_not(effect):
            return sentence
        is_laid = selection.active_region(effect).kind in strips.LAID
        return None if is_laid else rpt_("The region is no matte, ramp or outline")

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        folder = Path(bpy.path.abspath(self.directory or str(Path(self.filepath).parent)))
        region, word = selection.active_region(effect), self.format.lower()
        try:
            count = matte_export.save(self.edit, effect, self.effect_strip, region, folder, word)
        except OSError as error:
            raise UserError(f"{folder}: {error.strerror or error}") from None
        self.report({"INFO"}, rpt_('Saved {count} pictures in "{folder}"').format(count=count, folder=folder))


class SHUTTER_OT_ramp_add(Adds, Operator):
    """Make a ramp across the picture the matte of the active shutter"""

    bl_label = "Ramp"

    ramp: EnumProperty(name="Ramp", description="How the ramp runs", items=RAMPS)

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        region_edits.add_region(effect, selection.active_shutter(effect), "RAMP", ramp=self.ramp)


class SHUTTER_OT_time_map(Adds, Operator):
    """Show every pixel at its own moment: a ramp from the first of the frames to the last (slit-scan)"""

    bl_label = "Time Map"

    ramp: EnumProperty(name="Ramp", description="How the ramp runs", items=RAMPS)

    more = {"regions": 1, "shutters": 2}

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        time_map.add(effect, self.ramp)


classes = own_classes(globals())
