"""The menu *Strip ▸ Shutter*, which has every operator for search and shortcuts, and entries in Blender's menus."""

import bpy
from bpy.types import Context, Menu, UILayout

from ..data import selection, strips
from .panel_parts import draw_moves, draw_operators, menu


@menu("strip", "Shutter")
def strip_menu(layout: UILayout, _context: Context) -> None:
    draw_operators(layout, ("add_effect", "ADD"), ("draw", "GREASEPENCIL"), ("erase",))
    layout.separator()
    draw_operators(layout, ("effect_copy", "COPYDOWN"), ("effect_paste", "PASTEDOWN"))
    for end in ("shutter", "bars", "region", "outline", "track", "camera", "footage", "bake", "preview"):
        layout.menu(f"SHUTTER_MT_of_{end}")
    layout.separator()
    draw_operators(layout, ("copy_report", "COPYDOWN"))


@menu("of_shutter", "Shutters")
def shutter_menu(layout: UILayout, _context: Context) -> None:
    draw_operators(layout, ("shutter_add", "ADD"), ("shutter_remove", "REMOVE"))
    layout.menu_contents("SHUTTER_MT_shutters")


@menu("of_region", "Regions")
def region_menu(layout: UILayout, _context: Context) -> None:
    layout.menu_contents("SHUTTER_MT_regions")
    layout.separator()
    draw_operators(layout, ("region_transform",), ("region_key", "KEY_HLT"), ("region_assign", "NONE", "shutter"))
    draw_moves(layout, "region")
    draw_operators(layout, ("region_remove", "REMOVE"), ("matte_export", "EXPORT"))
    layout.separator()
    draw_operators(layout, ("sharp_subject", "RENDERLAYERS"), ("clean_trail", "CURVE_PATH"))


# Menus of operators only. End of the name: label, and groups for panel_parts.draw_operators.
_GROUPS: dict[str, tuple] = {
    "bars": (
        "Bars",
        [("bar_set",), ("preset", "PRESET", "preset")],
        [("bars_key", "KEY_HLT"), ("bars_unkey", "KEY_DEHLT")],
    ),
    "outline": (
        "Outline",
        [("subject_find",), ("subject_outline",), ("subject_scribble",)],
        [("outline_it",), ("outline_draw",)],
        [("outline_needed",)],
    ),
    "track": (
        "Track",
        [("track", "NONE", "direction"), ("track_look",), ("panning_shot", "CON_FOLLOWTRACK")],
        [("follow", "TRACKER")],
    ),
    "camera": (
        "Camera",
        [("track_camera", "NONE", "direction"), ("track_camera_look",), ("tripod", "CON_CAMERASOLVER")],
    ),
    "footage": (
        "Footage",
        [("source", "NONE", "strip"), ("match_source",)],
        [("smooth_streaks",)],
    ),
    "bake": ("Bake", [("bake",), ("bake_stop",), ("unbake",)]),
}


def _of_groups(end: str, label: str, *groups: list[tuple[str, ...]]) -> type[Menu]:
    @menu(f"of_{end}", label)
    def made(layout: UILayout, _context: Context) -> None:
        for i, group in enumerate(groups):
            if i:
                layout.separator()
            draw_operators(layout, *group)

    return made


@menu("of_preview", "Preview")
def preview_menu(layout: UILayout, context: Context) -> None:
    live = context.window_manager.virtual_shutter
    layout.operator("shutter.full_quality")
    layout.separator()
    layout.prop(live, "live")
    layout.prop_menu_enum(live, "view")
    layout.prop(live, "split")
    layout.separator()
    layout.prop(live, "probe")
    layout.prop(live, "probe_at")


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
    draw_operators(self.layout, ("effect_copy", "COPYDOWN"), ("effect_paste", "PASTEDOWN"))


def _entry(self, _context: Context) -> None:
    self.layout.separator()
    self.layout.menu(strip_menu.__name__)


_ENTRIES = (
    ("SEQUENCER_MT_add_effect", _add_entry),
    ("SEQUENCER_MT_strip", _strip_entry),
    ("SEQUENCER_MT_context_menu", _strip_entry),
    ("SEQUENCER_MT_strip", _entry),
)

classes = tuple(_of_groups(end, *what) for end, what in _GROUPS.items())


def register() -> None:
    for name, entry in _ENTRIES:
        getattr(bpy.types, name).append(entry)


def unregister() -> None:
    for name, entry in _ENTRIES:
        getattr(bpy.types, name).remove(entry)
