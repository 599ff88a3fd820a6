"""The menu *Strip ▸ Shutter*, which has every operator for search and shortcuts, and entries in Blender's menus."""

import bpy
from bpy.types import Context, Menu, UILayout

from ..data import selection, strips
from .panel_parts import draw_operators, draw_properties, menu

_OUTLINING = "subject_find", "subject_outline", "subject_scribble", "", "outline_it", "outline_draw", "outline_needed"
# Menus of operators: end of the name, label, and names for panel_parts.draw_operators.
_MENUS = {
    "shutter": ("Shutters", "shutter_add", "shutter_remove", "shutter_duplicate", "shutter_move"),
    "bars": ("Bars", "bar_set", "preset", "", "bars_key", "bars_unkey"),
    "outline": ("Outline", *_OUTLINING),
    "track": ("Track", "track", "track_look", "panning_shot", "", "follow"),
    "camera": ("Camera", "track_camera", "track_camera_look", "tripod"),
    "footage": ("Footage", "source", "match_source", "", "smooth_streaks"),
    "bake": ("Bake", "bake", "bake_stop", "unbake"),
}


@menu("strip", "Shutter")
def strip_menu(layout: UILayout, _context: Context) -> None:
    draw_operators(layout, "add_effect", "draw", "erase", "")
    draw_operators(layout, "effect_copy", "effect_paste", "recipe_import", "recipe_export", "")
    for end in ("shutter", "bars", "region", "outline", "track", "camera", "footage", "bake", "preview"):
        if end not in _MENUS or any(hasattr(bpy.types, f"SHUTTER_OT_{name}") for name in _MENUS[end][1:]):
            layout.menu(f"SHUTTER_MT_of_{end}")
    draw_operators(layout, "", "copy_report")


@menu("of_region", "Regions")
def region_menu(layout: UILayout, context: Context) -> None:
    layout.menu_contents("SHUTTER_MT_regions")
    layout.separator()
    active = selection.active(context)
    if active is not None and (region := selection.active_region(active[1])) is not None:
        draw_properties(layout, region, "location", "rotation", "scale")
    draw_operators(layout, "region_key", "region_assign", "region_move", "region_remove", "matte_export")
    draw_operators(layout, "", "sharp_subject", "clean_trail")


def _of_operators(end: str, label: str, *names: str) -> type[Menu]:
    @menu(f"of_{end}", label)
    def made(layout: UILayout, _context: Context) -> None:
        draw_operators(layout, *names)

    return made


@menu("of_preview", "Preview")
def preview_menu(layout: UILayout, context: Context) -> None:
    live = context.window_manager.virtual_shutter
    draw_operators(layout, "full_quality", "")
    layout.prop(live, "live")
    layout.prop_menu_enum(live, "view")
    draw_properties(layout, live, "split", "probe", "probe_at")


def _add_entry(self, _context: Context) -> None:
    self.layout.separator()
    self.layout.operator("shutter.add_effect", text="Shutter")


def _strip_entry(self, context: Context) -> None:
    strip = selection.active_strip(context)
    if strip is None or not (strip.type in strips.SOURCES or selection.active(context)):
        return
    self.layout.separator()
    if strip.type in strips.SOURCES:
        self.layout.operator("shutter.draw", text="Draw Shutter", icon="GREASEPENCIL")
        self.layout.operator("shutter.add_effect")
    draw_operators(self.layout, "effect_copy", "effect_paste")


def _entry(self, _context: Context) -> None:
    self.layout.separator()
    self.layout.menu(strip_menu.__name__)


_ENTRIES = (
    ("SEQUENCER_MT_add_effect", _add_entry),
    ("SEQUENCER_MT_strip", _strip_entry),
    ("SEQUENCER_MT_context_menu", _strip_entry),
    ("SEQUENCER_MT_strip", _entry),
)

classes = tuple(_of_operators(end, *content) for end, content in _MENUS.items())


def register() -> None:
    for name, entry in _ENTRIES:
        getattr(bpy.types, name).append(entry)


def unregister() -> None:
    for name, entry in _ENTRIES:
        getattr(bpy.types, name).remove(entry)
