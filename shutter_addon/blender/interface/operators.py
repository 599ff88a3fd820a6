"""Operators: what the user can do, as thin calls of plain functions."""

import bpy
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty
from bpy.types import Operator

from ...core.messages import EffectError
from ...core.model import presets
from ...core.model.choices import CONTEXT, DRAWN
from ..data import annotations, consistency, preview_areas, selection, strips
from ..editing import (
    add_effect,
    bar_edits,
    collection_edits,
    drawn_places,
    match_source,
    region_edits,
    shown_annotations,
    shutter_edits,
)
from ..rendering.effect_source import FAULTS
from . import icons, sharp_frame
from .operator_bases import (
    UNDOABLE,
    Mixin,
    Move,
    OfEffect,
    OfRegion,
    OfShutter,
    OfStrokes,
    has_room,
    redraw,
    refused,
    report_error,
    report_warning,
)


class SHUTTER_OT_add_effect(Operator):
    """Add a Shutter strip above the active strip, which gives every pixel an exposure of its own"""

    bl_idname = "shutter.add_effect"
    bl_label = "Add Shutter Strip"
    bl_options = UNDOABLE

    @classmethod
    def poll(cls, context):
        return takes_effect(cls, context)

    def execute(self, context):
        return {"FINISHED"} if effect_added(self, context) else {"CANCELLED"}


def takes_effect(cls, context) -> bool:
    """For poll(): whether the active strip can be given an effect."""
    scene, source = selection.scene_of(context), selection.active_strip(context)
    if scene is None or source is None:
        return refused(cls, rpt_("Select a movie, image or clip strip"))
    if not scene.is_editable:
        return refused(cls, rpt_("The edit is linked from another file"))
    if source.type not in strips.SOURCES:
        return refused(cls, rpt_("The active strip is not a movie, image or clip strip"))
    return True


def effect_added(operator, context) -> bool:
    """Gives the active strip an effect, and shows it; the operator says why it cannot be."""
    scene, source = selection.scene_of(context), selection.active_strip(context)
    try:
        strip, effect = add_effect.add_effect(scene, source)
    except FAULTS as error:
        report_error(operator, str(error))
        return False
    shutter_edits.start(effect)
    selection.choose(scene, strip)
    if not bpy.app.background:
        show_panel(context)
    redraw(context)
    return True


class MakesEffect(Mixin):
    """Gives the active strip an effect first, if that has none."""

    @classmethod
    def poll(cls, context):
        return takes_effect(cls, context) if selection.active(context) is None else super().poll(context)

    def execute(self, context):
        if selection.active(context) is None and not effect_added(self, context):
            return {"CANCELLED"}
        return super().execute(context)


class SHUTTER_OT_match_source(OfEffect, Operator):
    """Give the Shutter strip transform, crop, flip, color and range of its source (scribbles stay on the picture)"""

    bl_idname = "shutter.match_source"
    bl_label = "Match Source"

    @classmethod
    def possible(cls, effect):
        if (shown := match_source.shown(effect)) is None:
            return refused(cls, rpt_("The Shutter strip has no source any more"))
        if not shown.differences:
            return refused(cls, rpt_("The Shutter strip is like its source"))
        return True

    def change(self, context, effect):
        if (neighbor := match_source.match(effect)) is not None:
            strip = selection.active(context)[2]
            sentence = rpt_('"{neighbor}" is in the way: "{strip}" has not the whole range of its source')
            report_warning(self, sentence.format(neighbor=neighbor.name, strip=strip.name))


class SHUTTER_OT_copy_modifiers(OfEffect, Operator):
    """Copy the modifiers of the source to the Shutter strip, which shows the source's file as it is"""

    bl_idname = "shutter.copy_modifiers"
    bl_label = "Copy Modifiers"

    @classmethod
    def possible(cls, effect):
        shown = match_source.shown(effect)
        if shown is None or not shown.lacks_modifiers:
            return refused(cls, rpt_("The Shutter strip has the modifiers of its source"))
        return True

    def change(self, _context, effect):
        match_source.copy_modifiers(effect)


def show_panel(context) -> None:
    """Opens the sidebar's Shutter tab beside the picture: in the Properties editor it is below all other panels."""
    for _window, area in preview_areas.previews(context):
        area.spaces.active.show_region_ui = True
    # A sidebar has tabs once it has been drawn, which a slow window does late, and one without room never.
    _waits[:] = [0.1] * 30
    if not bpy.app.timers.is_registered(_choose_tab):
        bpy.app.timers.register(_choose_tab, first_interval=0.1)


_waits: list[float] = []


def _choose_tab() -> float | None:
    areas = [area for _window, area in preview_areas.previews(bpy.context)]
    sidebars = [next(region for region in area.regions if region.type == "UI") for area in areas]
    drawn = [s for s in sidebars if not s.is_property_readonly("active_panel_category")]
    if len(drawn) < len(sidebars) and _waits:
        return _waits.pop()
    for sidebar in drawn:
        sidebar.active_panel_category = "Shutter"
        sidebar.tag_redraw()
    return None


class SHUTTER_OT_shutter_add(OfEffect, Operator):
    """Add a shutter that is fully open"""

    bl_idname = "shutter.shutter_add"
    bl_label = "Add Shutter"

    @classmethod
    def possible(cls, effect):
        return has_room(cls, effect, "shutters")

    def change(self, _context, effect):
        shutter_edits.add_shutter(effect)


class SHUTTER_OT_shutter_duplicate(OfShutter, Operator):
    """Add a copy of the active shutter, keyframes included"""

    bl_idname = "shutter.shutter_duplicate"
    bl_label = "Duplicate Shutter"

    @classmethod
    def possible(cls, effect):
        return super().possible(effect) and has_room(cls, effect, "shutters")

    def change(self, _context, effect):
        shutter_edits.duplicate_shutter(effect, effect.active_shutter)


class SHUTTER_OT_shutter_remove(OfShutter, Operator):
    """Remove the active shutter and its regions"""

    bl_idname = "shutter.shutter_remove"
    bl_label = "Remove Shutter"

    @classmethod
    def possible(cls, effect):
        if len(effect.shutters) == 1:
            return refused(cls, rpt_("The last shutter of an effect cannot be removed"))
        return super().possible(effect)

    def change(self, _context, effect):
        shutter_edits.remove_shutter(effect, effect.active_shutter)


class SHUTTER_OT_shutter_move(Move, OfShutter, Operator):
    """Move the active shutter in the list (the first one is the default, which holds where nothing is scribbled)"""

    bl_idname = "shutter.shutter_move"
    bl_label = "Move Shutter"

    def change(self, _context, effect):
        index = effect.active_shutter
        to = self.target(list(range(len(effect.shutters))), index)
        if to == index:
            return {"CANCELLED"}
        shutter_edits.move_shutter(effect, index, to)
        return None


_preset_items: list = []


def _presets(_self, _context):
    """With icons, which exist only once the extension is registered; Blender needs the list kept."""
    _preset_items[:] = [
        (name, label, description, icons.of(name), i)
        for i, (name, (label, description, _make)) in enumerate(presets.PRESETS.items())
    ]
    return _preset_items


class SHUTTER_OT_preset(OfShutter, Operator):
    """Give the active shutter the bars of a preset"""

    bl_idname = "shutter.preset"
    bl_label = "Apply Shutter Preset"

    preset: EnumProperty(name="Preset", items=_presets, translation_context=CONTEXT)

    def change(self, context, effect):
        shutter_edits.apply_preset(effect, effect.active_shutter, self.preset, bar_edits.auto_key(context))


class SHUTTER_OT_bars_key(OfShutter, Operator):
    """Insert keyframes for all bars of the active shutter at the current frame"""

    bl_idname = "shutter.bars_key"
    bl_label = "Insert Bar Keyframes"

    def change(self, _context, effect):
        bar_edits.key_bars(effect, effect.active_shutter)


class SHUTTER_OT_bars_unkey(OfShutter, Operator):
    """Delete the keyframes of all bars of the active shutter at the current frame"""

    bl_idname = "shutter.bars_unkey"
    bl_label = "Delete Bar Keyframes"

    def change(self, _context, effect):
        if not bar_edits.unkey_bars(effect, effect.active_shutter):
            report_warning(self, rpt_("No bar has a keyframe at the current frame"))
            return {"CANCELLED"}
        return None


class SHUTTER_OT_bar_set(OfShutter, Operator):
    """Set the weight of a bar as a number"""

    bl_idname = "shutter.bar_set"
    bl_label = "Set Bar Weight"

    bar: IntProperty(name="Bar", description="Number of the bar, from 1", default=1, min=1)
    weight: FloatProperty(name="Weight", description="How much the bar's frame contributes", min=0.0, soft_max=1.0)

    def invoke(self, context, event):
        from .bar_editor import bar_under

        effect = selection.active(context)[1]
        is_clicked = event.value == "DOUBLE_CLICK"  # else it comes from a menu, wherever the pointer rests
        place = bar_under(context, event.mouse_region_x, event.mouse_region_y) if is_clicked else None
        self.is_pointed_at = place is not None
        if place is not None:
            self.bar = place + 1
        try:
            bars = bar_edits.bars_now(effect, effect.active_shutter)
        except EffectError as error:
            report_error(self, str(error))
            return {"CANCELLED"}
        self.weight = bars[min(self.bar, len(bars)) - 1]
        title = iface_("Bar {number}").format(number=self.bar) if self.is_pointed_at else ""
        return context.window_manager.invoke_props_dialog(self, width=200, title=title)

    def draw(self, _context):
        self.layout.activate_init = True
        if not getattr(self, "is_pointed_at", False):  # from a menu, by keys
            self.layout.prop(self, "bar")
        self.layout.prop(self, "weight")

    def change(self, context, effect):
        weights = bar_edits.bars_now(effect, effect.active_shutter)
        if self.bar > len(weights):
            report_error(self, rpt_("The shutter has {count} bars").format(count=len(weights)))
            return {"CANCELLED"}
        weights[self.bar - 1] = self.weight
        bar_edits.paint(effect, effect.active_shutter, weights, bar_edits.auto_key(context))
        return None


class SHUTTER_OT_draw(MakesEffect, OfShutter, Operator):
    """Draw on the sharp frame where the active shutter holds (at another frame, this redraws the active region)"""

    bl_idname = "shutter.draw"
    bl_label = "Draw"
    only_seen = True

    # Blender would use again what a button was pressed with before.
    new: BoolProperty(
        name="New Region",
        description="Start a new region instead of adding strokes to the active one",
        options={"SKIP_SAVE"},
    )
    kind: EnumProperty(
        name="Type",
        description="How the strokes cover the picture",
        items=DRAWN,
        translation_context=CONTEXT,
        options={"SKIP_SAVE"},
    )

    @classmethod
    def possible(cls, effect):
        if not super().possible(effect):
            return False
        return selection.active_region(effect) is not None or has_room(cls, effect, "regions")

    def change(self, context, effect):
        region = selection.active_region(effect)
        if self.new or region is None or region.kind in strips.MATTES:
            if sentence := collection_edits.why_full(effect, "regions"):  # poll() does not know what `new` is
                raise EffectError(sentence)
            region = region_edits.first_drawn(effect, selection.active_shutter(effect), self.kind)
        drawn_places.begin(effect, selection.active(context)[2], effect.active_region)
        if not drawing_tool(context, effect, region, "builtin.annotate"):
            self.report({"INFO"}, "Open a sequencer with a preview to draw")
        sharp_frame.show(context)


class SHUTTER_OT_erase(OfStrokes, Operator):
    """Erase strokes of the active region in the preview"""

    bl_idname = "shutter.erase"
    bl_label = "Erase"
    only_seen = True

    def change(self, context, effect):
        drawn_places.begin(effect, selection.active(context)[2], effect.active_region, erases=True)
        if not drawing_tool(context, effect, selection.active_region(effect), "builtin.annotate_eraser"):
            self.report({"INFO"}, "Open a sequencer with a preview to erase")


def drawing_tool(context, effect, region, tool: str) -> bool:
    """Makes the region's layer the active annotation of every preview, and the tool theirs; whether there is one."""
    if annotations.layer_of(effect, region) is None:
        region_edits.new_layer(effect, region)
    consistency.aim_pen(effect)
    for _window, area in preview_areas.previews(context):
        shown_annotations.give(area.spaces.active, effect.scene.annotation)
    return sharp_frame.take_up(context, tool)


_layer_items: list = []


def _layers(_self, context):
    active = selection.active(context)
    layers = region_edits.free_layers(active[1], annotation_of(context)) if active else []
    _layer_items[:] = [(layer.info, layer.info, "") for layer in layers]
    return _layer_items


def annotation_of(context):
    """The annotation that the first preview shows."""
    return next((area.spaces.active.annotation for _window, area in preview_areas.previews(context)), None)


class SHUTTER_OT_region_take(OfShutter, Operator):
    """Make an annotation layer of the preview a region of the active shutter"""

    bl_idname = "shutter.region_take"
    bl_label = "Add Region from Annotation Layer"
    only_seen = True

    layer: EnumProperty(name="Layer", items=_layers, translation_context=contexts.no_translation)

    @classmethod
    def possible(cls, effect):
        return super().possible(effect) and has_room(cls, effect, "regions")

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        if not region_edits.free_layers(selection.active(context)[1], annotation_of(context)):
            return refused(cls, rpt_("The preview shows no annotation layer that is not a region yet"))
        return True

    def change(self, context, effect):
        layer = annotation_of(context).layers[self.layer]
        region_edits.take_layer(effect, selection.active_shutter(effect), layer)
        for _window, area in preview_areas.previews(context):
            shown_annotations.give(area.spaces.active, effect.scene.annotation)


_shutter_items: list = []


def _shutters(_self, context):
    active = selection.active(context)
    shutters = active[1].shutters if active else []
    _shutter_items[:] = [(str(i), shutter.name, "") for i, shutter in enumerate(shutters)]
    return _shutter_items


class SHUTTER_OT_region_assign(OfRegion, Operator):
    """Assign the active region to another shutter"""

    bl_idname = "shutter.region_assign"
    bl_label = "Assign Region to Shutter"

    shutter: EnumProperty(name="Shutter", items=_shutters, translation_context=contexts.no_translation)

    def change(self, _context, effect):
        region_edits.assign_region(effect, effect.active_region, effect.shutters[int(self.shutter)])


class SHUTTER_OT_region_remove(OfRegion, Operator):
    """Remove the active region and its strokes"""

    bl_idname = "shutter.region_remove"
    bl_label = "Remove Region"

    def change(self, _context, effect):
        region_edits.remove_region(effect, effect.active_region)


class SHUTTER_OT_region_move(Move, OfRegion, Operator):
    """Move the active region in the list (later ones lie over earlier ones)"""

    bl_idname = "shutter.region_move"
    bl_label = "Move Region"

    def change(self, _context, effect):
        index, name = effect.active_region, selection.active_shutter(effect).name
        listed = [i for i, region in enumerate(effect.regions) if region.shutter == name]
        if (to := self.target(listed, index)) == index:
            return {"CANCELLED"}
        region_edits.move_region(effect, index, to)
        return None


class SHUTTER_OT_region_key(OfRegion, Operator):
    """Insert keyframes for location, rotation and scale of the active region at the current frame"""

    bl_idname = "shutter.region_key"
    bl_label = "Insert Region Keyframes"

    def change(self, _context, effect):
        region_edits.key_region(effect, effect.active_region)


classes = (
    SHUTTER_OT_add_effect,
    SHUTTER_OT_match_source,
    SHUTTER_OT_copy_modifiers,
    SHUTTER_OT_shutter_add,
    SHUTTER_OT_shutter_duplicate,
    SHUTTER_OT_shutter_remove,
    SHUTTER_OT_shutter_move,
    SHUTTER_OT_preset,
    SHUTTER_OT_bars_key,
    SHUTTER_OT_bars_unkey,
    SHUTTER_OT_bar_set,
    SHUTTER_OT_draw,
    SHUTTER_OT_erase,
    SHUTTER_OT_region_take,
    SHUTTER_OT_region_assign,
    SHUTTER_OT_region_remove,
    SHUTTER_OT_region_move,
    SHUTTER_OT_region_key,
)
TIMERS = (_choose_tab,)
