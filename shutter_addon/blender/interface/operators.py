"""Operators for effects, shutters, regions and recipes. Each calls a function of `editing`, which does the work."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import bpy
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy.types import Context, Event, Operator, PropertyGroup
from bpy_extras.io_utils import ExportHelper, ImportHelper

from ...core.messages import EffectError, UserError
from ...core.model import shutters
from ...core.model.choices import CONTEXT, DRAWN
from ...core.recipes import recipe_file
from ..data import annotations, consistency, data_format, preview_areas, recipe_import, selection, strips, validation
from ..devices import main_thread
from ..editing import add_effect, bar_edits, motion_keys, region_edits, shown_annotations, shutter_edits, undelete
from ..editing import match_source as matching
from ..output import error_report, matte_export
from . import needs, sharp_frame
from .bar_editor import bar_under
from .matte_operators import STRIP
from .operator_bases import UNDOABLE, Mixin, Named, OfEffect, chosen_file, given, kept, operator, redraw, report
from .panel_parts import draw_properties, icon_of


def why_no_effect(context: Context) -> str | None:
    """Return why the active strip cannot get an effect; None: it can."""
    scene, source = selection.scene_of(context), selection.active_strip(context)
    if scene is None or source is None:
        return rpt_("Select a movie, image or clip strip")
    if not scene.is_editable:
        return rpt_("The edit is linked from another file")
    return None if source.type in strips.SOURCES else rpt_("The active strip is not a movie, image or clip strip")


def give_effect(context: Context) -> None:
    """Add an effect with the shutters of shutter_edits.start to the active strip, select its strip and show its panel.

    Raises:
        FAULTS: One of the errors in effect_source.FAULTS: the strip's footage cannot be read.
    """
    scene = selection.scene_of(context)
    strip, effect = add_effect.add_effect(scene, selection.active_strip(context))
    shutter_edits.start(effect)
    selection.choose(scene, strip)
    if not bpy.app.background:
        for _window, area in preview_areas.previews(context):
            area.spaces.active.show_region_ui = True
        # A sidebar has no tabs before it is drawn. A slow window draws it late; one without room never does.
        main_thread.later(partial(_choose_tab, iter([0.1] * 30)), 0.1)
    redraw(context)


class SHUTTER_OT_add_effect(Named, Operator):
    """Add a Shutter strip, which gives every pixel its own exposure, above the active strip"""

    bl_label = "Add Shutter Strip"
    icon = "ADD"
    bl_options = UNDOABLE
    refusal = staticmethod(why_no_effect)

    def execute(self, context: Context) -> set[str]:
        return self.tried(give_effect, context)


class MakesEffect(Mixin):
    """A mix-in for operators on an effect. If the active strip can have one and has none, they first add it."""

    @classmethod
    def refusal(cls, context: Context) -> str | None:
        return why_no_effect(context) if selection.active(context) is None else super().refusal(context)

    def execute(self, context: Context) -> set[str]:
        if selection.active(context) is None and self.tried(give_effect, context) == {"CANCELLED"}:
            return {"CANCELLED"}
        return super().execute(context)


def _why_alike(effect: PropertyGroup) -> str | None:
    if (shown := matching.shown(effect)) is None:
        return rpt_("The Shutter strip has no source")
    return None if shown.differences else rpt_("The Shutter strip matches its source")


@operator("Match Source", _why_alike)
def match_source(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Copy transform, crop, flip, color and range of the source to the Shutter strip (strokes stay on the picture)"""
    if (neighbor := matching.match(effect)) is not None:
        sentence = rpt_('"{neighbor}" is in the way: "{strip}" does not have the whole range of its source')
        report(self, sentence.format(neighbor=neighbor.name, strip=self.effect_strip.name))


@operator("Insert Region Keyframes", needs.a_region, icon="KEY_HLT")
def region_key(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Insert keyframes for location, rotation and scale of the active region at the current frame"""
    motion_keys.insert(effect, effect.active_region)


@operator("Sharp Subject", needs.a_region)
def sharp_subject(_self: Operator, context: Context, effect: PropertyGroup) -> None:
    """Keep the active region sharp in front of a long exposure of everything else"""
    shutter_edits.as_layer(effect, effect.active_region, "STILL", "ANGLE_360", bar_edits.auto_key(context))


@operator("Trail", needs.a_region)
def clean_trail(_self: Operator, context: Context, effect: PropertyGroup) -> None:
    """Make the active region leave a trail in front of everything else, which stays sharp"""
    shutter_edits.as_layer(effect, effect.active_region, "ANGLE_360", "STILL", bar_edits.auto_key(context))


def _choose_tab(waits: Iterator[float]) -> float | None:
    """Open the sidebar's Shutter tab in all previews, once the sidebars are drawn. This is a timer of Blender.

    Args:
        waits: Seconds until the next try, while a sidebar is not drawn yet. When no value is left, leave out such
            sidebars.

    Returns:
        Seconds until the next try; None: it is done.
    """
    areas = [area for _window, area in preview_areas.previews(bpy.context)]
    sidebars = [next(region for region in area.regions if region.type == "UI") for area in areas]
    drawn = [s for s in sidebars if not s.is_property_readonly("active_panel_category")]
    if len(drawn) < len(sidebars) and (wait := next(waits, None)):
        return wait
    for sidebar in drawn:
        sidebar.active_panel_category = "Shutter"
        sidebar.tag_redraw()
    return None


@operator("Add Shutter", needs.room_for_a_shutter, icon="ADD")
def shutter_add(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Add a shutter that is fully open"""
    shutter_edits.add_shutter(effect)


@operator("Duplicate Shutter", needs.a_shutter, needs.room_for_a_shutter, icon="DUPLICATE")
def shutter_duplicate(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Add a copy of the active shutter, keyframes included"""
    shutter_edits.duplicate_shutter(effect, effect.active_shutter)


def _why_last(effect: PropertyGroup) -> str | None:
    return rpt_("The last shutter of an effect cannot be removed") if len(effect.shutters) == 1 else None


@operator("Remove Shutter", _why_last, needs.a_shutter, icon="REMOVE")
def shutter_remove(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Remove the active shutter and its regions"""
    shutter_edits.remove_shutter(effect, effect.active_shutter)


_DIRECTION = EnumProperty(name="Direction", items=(("UP", "Up", ""), ("DOWN", "Down", "")), options={"SKIP_SAVE"})


def _move(effect: PropertyGroup, kind: str, direction: str, places: list[int]) -> set[str] | None:
    """Move the active shutter or region one place up or down in its list in the sidebar.

    Args:
        kind: "shutter" or "region".
        direction: "UP" or "DOWN".
        places: Indices, in the effect, of the items that the list shows: a list of regions shows only some.

    Returns:
        {"CANCELLED"} if the item already is the first or last of the list, else None.
    """
    index = getattr(effect, f"active_{kind}")
    step = places.index(index) + (1 if direction == "DOWN" else -1)
    if not 0 <= step < len(places):
        return {"CANCELLED"}
    region_edits.move(effect, kind, index, places[step])
    return None


@operator("Move Shutter", needs.a_shutter, direction=_DIRECTION)
def shutter_move(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Move the active shutter in the list (the first one is the default, used where nothing is drawn)"""
    return _move(effect, "shutter", self.direction, list(range(len(effect.shutters))))


@kept
def _presets(_context: Context) -> list[tuple]:
    """Return the enum items of the presets, with icons. Icons exist only while the extension is registered."""
    presets = enumerate(shutters.PRESETS.items())
    return [(name, label, description, icon_of(name), i) for i, (name, (label, description, _make)) in presets]


_PRESET = EnumProperty(name="Preset", items=_presets, translation_context=CONTEXT)


@operator("Apply Shutter Preset", needs.a_shutter, icon="PRESET", preset=_PRESET)
def preset(self: Operator, context: Context, effect: PropertyGroup) -> None:
    """Give the active shutter the bars of a preset"""
    shutter_edits.apply_preset(effect, effect.active_shutter, self.preset, bar_edits.auto_key(context))


@operator("Insert Bar Keyframes", needs.a_shutter, icon="KEY_HLT")
def bars_key(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Insert keyframes for all bars of the active shutter at the current frame"""
    bar_edits.key_bars(effect, effect.active_shutter)


@operator("Delete Bar Keyframes", needs.a_shutter, icon="KEY_DEHLT")
def bars_unkey(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Delete the keyframes of all bars of the active shutter at the current frame"""
    is_deleted = bar_edits.unkey_bars(effect, effect.active_shutter)
    return None if is_deleted else report(self, rpt_("No bar has a keyframe at the current frame"))


class SHUTTER_OT_bar_set(OfEffect, Operator):
    """Set the weight of a bar as a number"""

    bl_label = "Set Bar Weight"
    needs = (needs.a_shutter,)

    bar: IntProperty(name="Bar", description="Number of the bar, from 1", default=1, min=1)
    weight: FloatProperty(name="Weight", description="How much the frame counts", min=0.0, soft_max=1.0)

    def invoke(self, context: Context, event: Event) -> set[str]:
        if event.value == "DOUBLE_CLICK":  # from a menu, the pointer is anywhere
            place = bar_under(context, event.mouse_region_x, event.mouse_region_y)
            self.bar = self.bar if place is None else place + 1
        if self.tried(self._read, selection.active(context)[1]) == {"CANCELLED"}:
            return {"CANCELLED"}
        return context.window_manager.invoke_props_dialog(self, width=200)

    def _read(self, effect: PropertyGroup) -> None:
        bars = bar_edits.bars_now(effect, effect.active_shutter)
        self.weight = bars[min(self.bar, len(bars)) - 1]

    def draw(self, _context: Context) -> None:
        self.layout.activate_init = True
        draw_properties(self.layout, self, "weight", "bar")

    def change(self, context: Context, effect: PropertyGroup) -> None:
        weights = bar_edits.bars_now(effect, effect.active_shutter)
        if self.bar > len(weights):
            raise EffectError(rpt_("The shutter has {count} bars").format(count=len(weights)))
        weights[self.bar - 1] = self.weight
        bar_edits.paint(effect, effect.active_shutter, weights, bar_edits.auto_key(context))


def _why_no_room(effect: PropertyGroup) -> str | None:
    return validation.why_full(effect, regions=1 if selection.active_region(effect) is None else 0)


class SHUTTER_OT_draw(MakesEffect, OfEffect, Operator):
    """Draw on the sharp frame where the active shutter is used (at another frame, this redraws the active region)"""

    bl_label = "Draw"
    icon = "GREASEPENCIL"
    only_seen = True
    needs = needs.a_shutter, _why_no_room

    new: given(BoolProperty, "New Region", "Start a new region instead of adding strokes to the active one")
    kind: given(EnumProperty, "Type", "How the strokes cover the picture", items=DRAWN, translation_context=CONTEXT)
    not_this: given(BoolProperty, "Not This", "Draw on what the active subject is not")

    def change(self, context: Context, effect: PropertyGroup) -> None:
        region = selection.active_region(effect)
        if self.not_this and (sentence := needs.a_subject(effect)):
            raise EffectError(sentence)
        if self.new or region is None or region.kind in strips.MATTES:
            if sentence := validation.why_full(effect, regions=1):  # poll() does not know the value of `new`
                raise EffectError(sentence)
            region_edits.first_drawn(effect, selection.active_shutter(effect), self.kind)
        region_edits.begin_drawing(effect, self.effect_strip, effect.active_region)
        _take_tool(self, context, effect, "builtin.annotate", "not_layer" if self.not_this else "layer")
        sharp_frame.show(context)


@operator("Erase", needs.strokes, only_seen=True)
def erase(self: Operator, context: Context, effect: PropertyGroup) -> None:
    """Erase strokes of the active region in the preview"""
    region_edits.begin_drawing(effect, self.effect_strip, effect.active_region, erases=True)
    _take_tool(self, context, effect, "builtin.annotate_eraser")


def _take_tool(by: Operator, context: Context, effect: PropertyGroup, tool: str, layer: str = "layer") -> None:
    """Activate an annotation tool in all previews, to draw on an annotation layer of the active region.

    Make the layer if the region lacks it. If no preview is open, tell the user to open one.

    Args:
        by: The running operator, which tells the user.
        tool: Blender's identifier of the tool.
        layer: Which of the region's layers, one of annotations.LAYERS.
    """
    region = selection.active_region(effect)
    if annotations.layer_of(effect, region, layer) is None:
        region_edits.new_layer(effect, region, layer)
    consistency.aim_pen(effect, layer)
    for _window, area in preview_areas.previews(context):
        shown_annotations.give(area.spaces.active, effect.scene.annotation)
    if not sharp_frame.take_up(context, tool):
        by.report({"INFO"}, "Open a sequencer with a preview to draw")


@kept
def _shutters(context: Context) -> list[tuple]:
    active = selection.active(context)
    return [(str(i), shutter.name, "") for i, shutter in enumerate(active[1].shutters)] if active else []


_SHUTTER = EnumProperty(name="Shutter", items=_shutters, translation_context=contexts.no_translation)


@operator("Assign Region to Shutter", needs.a_region, shutter=_SHUTTER)
def region_assign(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Assign the active region to another shutter"""
    region_edits.assign_region(effect, effect.active_region, effect.shutters[int(self.shutter)])


@operator("Remove Region", needs.a_region, icon="REMOVE")
def region_remove(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Remove the active region and its strokes"""
    region_edits.remove_region(effect, effect.active_region)


@operator("Move Region", needs.a_region, direction=_DIRECTION)
def region_move(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Move the active region in the list (later ones cover earlier ones)"""
    return _move(effect, "region", self.direction, selection.own_regions(effect))


@operator("Choose Source", icon="SEQUENCE", strip=STRIP)
def source(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Choose the movie, image or clip strip whose frames the effect exposes"""
    add_effect.choose_source(effect, self.effect_strip, self.edit.sequence_editor.strips_all[self.strip])


@operator("Copy Effect", icon="COPYDOWN", options={"REGISTER"})
def effect_copy(self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Copy the shutters, regions, keyframes and options of the effect, for other strips and scenes of this file"""
    undelete.copy(effect, self.effect_strip)
    if data_format.is_newer(self.edit):
        report(self, rpt_("Data of a newer version of Virtual Shutter is left out"))


class SHUTTER_OT_effect_paste(MakesEffect, OfEffect, Operator):
    """Paste the copied effect to the active strip, replacing its effect"""

    bl_label = "Paste Effect"
    icon = "PASTEDOWN"

    @classmethod
    def refusal(cls, context: Context) -> str | None:
        return super().refusal(context) if undelete.has_copy() else rpt_("Copy an effect first")

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        undelete.paste(effect, self.effect_strip)


class SHUTTER_OT_recipe_import(OfEffect, ImportHelper, Operator):
    """Replace the shutters, regions, keyframes and options of the effect with those of a recipe file"""

    bl_label = "Import Recipe"
    icon = "IMPORT"
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        path = Path(chosen_file(self))
        found = recipe_file.load(path)
        recipe_import.apply(self.edit, effect, self.effect_strip, found, path.parent)
        if found.lost is not None:
            report(self, rpt_(found.lost.template).format(**found.lost.words))


class SHUTTER_OT_recipe_export(OfEffect, ExportHelper, Operator):
    """Save the shutters, regions, keyframes and options of the effect as a recipe file"""

    bl_label = "Export Recipe"
    icon = "EXPORT"
    bl_options = {"REGISTER"}
    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        path = chosen_file(self)
        try:
            recipe_file.save(matte_export.recipe_for(self.edit, effect, self.effect_strip, Path(path)), path)
        except OSError as error:
            raise UserError(f"{path}: {error.strerror or error}") from None
        self.report({"INFO"}, rpt_('Saved "{path}"').format(path=path))
        if data_format.is_newer(self.edit):
            report(self, rpt_("Data of a newer version of Virtual Shutter is left out"))


class SHUTTER_OT_copy_report(Named, Operator):
    """Copy versions, device, types and numbers of the edit, and last errors: no names, no paths. Nothing is sent"""

    bl_label = "Copy Report"
    icon = "COPYDOWN"

    def execute(self, context: Context) -> set[str]:
        if bpy.app.background:
            words = rpt_("Without a window there is no clipboard: use the command check with --report")
            return report(self, words, "ERROR")
        context.window_manager.clipboard = error_report.text(selection.scene_of(context))
        self.report({"INFO"}, rpt_("Report copied: paste it into your message and read it before you send it"))
        return {"FINISHED"}
