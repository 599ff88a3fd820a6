"""Operators that make regions of mattes, ramps and time maps."""

from pathlib import Path

import bpy
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy.types import Operator
from bpy_extras.io_utils import ImportHelper

from ...core.messages import EffectError
from ...core.model.choices import RAMPS
from ...core.model.limits import MAX_CHANNEL
from ...core.recipes.recipe import RecipeError
from ...media import MediaError
from ..data import matte_strips, recipe_import, selection, strips
from ..editing import outline_masks, region_edits, time_map
from ..output import matte_export
from .operator_bases import OfRegion, OfShutter, chosen_file, has_room, refused, report_error


class _AddsRegion(OfShutter):
    """Adds a region to the active shutter."""

    @classmethod
    def possible(cls, effect):
        return super().possible(effect) and has_room(cls, effect, "regions")


class SHUTTER_OT_matte_add(_AddsRegion, ImportHelper, Operator):
    """Make a movie, an image sequence or a picture the matte of the active shutter"""

    bl_idname = "shutter.matte_add"
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

    def change(self, _context, effect):
        name = self.channel_name
        try:
            image = recipe_import.matte_image(bpy.path.abspath(chosen_file(self)), name or "luminance")
        except (MediaError, RecipeError) as error:
            raise EffectError(str(error)) from None
        channel = {"channel": "NAMED", "channel_name": name} if name else {}
        region_edits.add_matte(effect, selection.active_shutter(effect), name=image.name, image=image, **channel)


_strip_items: list = []


def strip_items(_self, context):
    scene = selection.scene_of(context)
    all_strips = scene.sequence_editor.strips_all if scene and scene.sequence_editor else ()
    _strip_items[:] = [(strip.name, strip.name, "") for strip in all_strips if strip.type in strips.SOURCES]
    return _strip_items


class SHUTTER_OT_matte_strip(_AddsRegion, Operator):
    """Make a movie, image or clip strip of the edit the matte of the active shutter, muted or not"""

    bl_idname = "shutter.matte_strip"
    bl_label = "Matte from Strip"

    strip: EnumProperty(name="Strip", items=strip_items, translation_context=contexts.no_translation)

    def change(self, _context, effect):
        region = region_edits.add_matte(effect, selection.active_shutter(effect), name=self.strip, matte="STRIP")
        matte_strips.choose_strip(region, self.strip)


_mask_items: list = []


def _masks(_self, _context):
    _mask_items[:] = [(mask.name_full, mask.name_full, "") for mask in bpy.data.masks]
    return _mask_items


class _OfMask(_AddsRegion):
    """Adds a region that a mask makes."""

    mask: EnumProperty(name="Mask", items=_masks, translation_context=contexts.no_translation)

    @classmethod
    def possible(cls, effect):
        return super().possible(effect) and (
            bool(bpy.data.masks)
            or refused(cls, rpt_("There is no mask: draw one in the Mask mode of an image or clip"))
        )

    def chosen(self):
        return next(mask for mask in bpy.data.masks if mask.name_full == self.mask)


class SHUTTER_OT_matte_mask(_OfMask, Operator):
    """Make a mask the matte of the active shutter"""

    bl_idname = "shutter.matte_mask"
    bl_label = "Matte from Mask"

    def change(self, _context, effect):
        mask = self.chosen()
        region_edits.add_matte(effect, selection.active_shutter(effect), name=mask.name, matte="MASK", mask=mask)


class SHUTTER_OT_outline_from_mask(_OfMask, Operator):
    """Make an outline of the active shutter that is drawn at each key of a mask"""

    bl_idname = "shutter.outline_from_mask"
    bl_label = "Outline from Mask"

    def change(self, context, effect):
        scene, _effect, strip = selection.active(context)
        outline_masks.from_mask(scene, effect, strip, selection.active_shutter(effect), self.chosen())


class SHUTTER_OT_matte_export(OfRegion, ImportHelper, Operator):
    """Write what the active matte or outline shows at each frame of its strip as pictures, for any other program"""

    bl_idname = "shutter.matte_export"
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
    def possible(cls, effect):
        if not super().possible(effect):
            return False
        return selection.active_region(effect).kind in strips.LAID or refused(
            cls, rpt_("The region is no matte, ramp or outline")
        )

    def change(self, context, effect):
        scene, _effect, strip = selection.active(context)
        folder = Path(bpy.path.abspath(self.directory or str(Path(self.filepath).parent)))
        try:
            region, word = selection.active_region(effect), self.format.lower()
            count = matte_export.save(scene, effect, strip, region, folder, word)
        except OSError as error:
            sentence = f"{folder}: {error.strerror or error}"
            report_error(self, sentence)
            return {"CANCELLED"}
        self.report({"INFO"}, rpt_('Saved {count} pictures in "{folder}"').format(count=count, folder=folder))
        return None


class SHUTTER_OT_ramp_add(_AddsRegion, Operator):
    """Make a ramp across the picture the matte of the active shutter"""

    bl_idname = "shutter.ramp_add"
    bl_label = "Ramp"

    ramp: EnumProperty(name="Ramp", description="How the ramp runs", items=RAMPS)

    def change(self, _context, effect):
        region_edits.add_matte(effect, selection.active_shutter(effect), "RAMP", ramp=self.ramp)


class SHUTTER_OT_time_map(_AddsRegion, Operator):
    """Show every pixel at its own moment: a ramp from the first of the frames to the last (slit-scan)"""

    bl_idname = "shutter.time_map"
    bl_label = "Time Map"

    ramp: EnumProperty(name="Ramp", description="How the ramp runs", items=RAMPS)

    @classmethod
    def possible(cls, effect):
        return super().possible(effect) and has_room(cls, effect, "shutters", 2)

    def change(self, _context, effect):
        time_map.add(effect, self.ramp)


classes = (
    SHUTTER_OT_matte_add,
    SHUTTER_OT_matte_strip,
    SHUTTER_OT_matte_mask,
    SHUTTER_OT_outline_from_mask,
    SHUTTER_OT_matte_export,
    SHUTTER_OT_ramp_add,
    SHUTTER_OT_time_map,
)
