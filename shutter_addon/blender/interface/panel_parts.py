"""Parts of panels: sentences, lists, buttons, factories for panels and menus, and icons of presets and patterns."""

from collections.abc import Callable
from functools import cache

import bpy.utils.previews
import numpy as np
from bpy.types import Context, Menu, Panel, PropertyGroup, Scene, Strip, UILayout
from bpy.utils.previews import ImagePreviewCollection

from ...core.model import shutters
from ...core.pixels import patterns
from ..data import selection
from . import drawing

Draws = Callable[[UILayout, Scene, PropertyGroup, Strip], None]  # draws the content of a panel

# Interface units beside a sentence in a panel: its margins with the sidebar's tabs, and its icon.
_MARGIN, _ICON = 64, 20
WIDEST = 360  # interface units: the widest sentence, as in a popover

_MOST_ROWS = 5  # rows of a list without scrolling
_SIZE, _WINDOW = 32, 8  # pixels of an icon; bars that it shows
_UNITS = 16  # interface units along each side of an icon
_LIGHT = (0.8, 0.8, 0.8)


def sentence(layout: UILayout, words: str, icon: str = "NONE", room: float = 1.0, is_quiet: bool = False) -> None:
    """Draw a translated sentence, broken into lines that fit the panel's width, but are at most WIDEST wide.

    Args:
        words: The sentence.
        icon: Icon before the first line.
        room: Fraction 0 to 1 of the panel's width that the layout has.
        is_quiet: Draw it greyed out.
    """
    unit, region = drawing.ui_scale(), bpy.context.region
    beside = _MARGIN if icon == "NONE" else _MARGIN + _ICON
    width = room * min(region.width if region else 300 * unit, WIDEST * unit) - beside * unit
    column = layout.column(align=True)
    column.active = not is_quiet
    for i, line in enumerate(drawing.wrapped(words, width)):
        row = column.row()
        row.scale_y = 0.8 if i else 1.0
        row.label(text=line, icon=icon if i == 0 or icon == "NONE" else "BLANK1", translate=False)


def draw_list(layout: UILayout, effect: PropertyGroup, kind: str, count: int) -> None:
    """Draw the list of an effect's shutters or regions with its buttons, such as Add and Remove.

    Args:
        kind: "shutter" or "region".
        count: Number of items that the list shows (regions of inactive shutters are hidden). It determines the height,
            and whether regions have buttons to move them.
    """
    row = layout.row()
    rows = min(max(count, 1), _MOST_ROWS)
    row.template_list(f"SHUTTER_UL_{kind}s", "", effect, f"{kind}s", effect, f"active_{kind}", rows=rows)
    column = row.column(align=True)
    if kind == "shutter":
        column.operator("shutter.shutter_add", text="", icon="ADD")
    else:
        column.operator("shutter.draw", text="", icon="ADD").new = True
    column.operator(f"shutter.{kind}_remove", text="", icon="REMOVE")
    if kind == "shutter":
        column.menu("SHUTTER_MT_shutters", text="", icon="DOWNARROW_HLT")
    elif count > 1:
        for direction, icon in (("UP", "TRIA_UP"), ("DOWN", "TRIA_DOWN")):
            column.operator(f"shutter.{kind}_move", text="", icon=icon).direction = direction


def draw_operators(layout: UILayout, *names: str) -> None:
    """Draw buttons or menu entries for operators of the extension.

    An operator with `choices` (see operator_bases.Named) becomes a submenu of them, unless it is greyed out.

    Args:
        names: Names of operators, without "shutter."; "" draws a separator. Operators that do not exist, because their
            feature was removed from the extension, are left out.
    """
    for name in names:
        if not name:
            layout.separator()
            continue
        kind = getattr(bpy.types, f"SHUTTER_OT_{name}", None)
        if kind is None:  # of a feature that was removed
            continue
        if kind.choices and kind.poll(bpy.context):
            layout.operator_menu_enum(f"shutter.{name}", kind.choices, icon=kind.icon)
        else:  # greyed out, its tooltip says why
            layout.operator(f"shutter.{name}", icon=kind.icon)


def draw_properties(layout: UILayout, owner: bpy.types.bpy_struct, *names: str) -> None:
    for name in names:
        layout.prop(owner, name)


def panel(
    end: str, label: str, draws: Draws, shows: Callable | None = None, within: str = "", **look: object
) -> type[Panel]:
    """Make the class of a panel of the Shutter tab, closed by default. It shows something of the active effect.

    Without an active effect, it is hidden.

    Args:
        end: End of the class name, after SEQUENCER_PT_shutter.
        label: Title of the panel.
        draws: Draws the content: takes the layout, the scene, the effect and the effect strip.
        shows: Takes the effect, and returns whether to show the panel; None: always show it.
        within: `end` of the panel that contains it; "": the first panel of the tab contains it.
        look: Other attributes of the class, such as bl_options.
    """

    def poll(_cls: type[Panel], context: Context) -> bool:
        active = selection.active(context)
        return active is not None and (shows is None or bool(shows(active[1])))

    def draw(self: Panel, context: Context) -> None:
        self.layout.use_property_split = True
        draws(self.layout, *selection.active(context))

    place = {"bl_space_type": "SEQUENCE_EDITOR", "bl_region_type": "UI", "bl_category": "Shutter"}
    content = {"bl_label": label, "bl_options": {"DEFAULT_CLOSED"}, "poll": classmethod(poll), "draw": draw}
    parent = {"bl_parent_id": f"SEQUENCER_PT_shutter{within}"}
    return type(f"SEQUENCER_PT_shutter{end}", (Panel,), place | content | parent | look)


def menu(name: str, label: str) -> Callable[[Callable[[UILayout, Context], None]], type[Menu]]:
    """Return a decorator that makes a menu class SHUTTER_MT_name from a function that draws it."""

    def made(draws: Callable[[UILayout, Context], None]) -> type[Menu]:
        def draw(self: Menu, context: Context) -> None:
            draws(self.layout, context)

        return type(f"SHUTTER_MT_{name}", (Menu,), {"__module__": draws.__module__, "bl_label": label, "draw": draw})

    return made


@cache
def _icons() -> ImagePreviewCollection:
    """Return the icons of presets (by name) and of shutters' patterns (by number). They are made once."""
    icons = bpy.utils.previews.new()
    pictures = {name: _drawn(shutters.preset_bars(name, _WINDOW)) for name in shutters.PRESETS}
    pictures |= {str(index): _painted(index) for index in range(patterns.COUNT)}
    for name, picture in pictures.items():
        icon = icons.new(name)
        icon.icon_size = icon.image_size = (_SIZE, _SIZE)
        icon.icon_pixels_float = icon.image_pixels_float = picture.ravel()
    return icons


def icon_of(name: str) -> int:
    """Return the icon number of a preset, for `icon_value`; 0 in the background."""
    return _icons()[name].icon_id


def pattern_icon(index: int) -> int:
    """Return the icon number of a shutter's pattern, for `icon_value`; 0 in the background.

    Args:
        index: Index of the shutter.
    """
    return icon_of(str(index % patterns.COUNT))


def _drawn(bars: np.ndarray) -> np.ndarray:
    """Return an icon that shows a shutter's bars: pixels (_SIZE, _SIZE, 4), float32, bottom row first."""
    picture = np.zeros((_SIZE, _SIZE, 4), dtype=np.float32)
    width = _SIZE // len(bars)
    picture[1, :] = 0.5
    for k, weight in enumerate(bars):
        picture[2 : 2 + round(weight * (_SIZE - 4)), k * width : (k + 1) * width - 1] = (0.9, 0.9, 0.9, 1.0)
    return picture


def _painted(index: int) -> np.ndarray:
    """Return an icon that shows a shutter's color pattern: pixels (_SIZE, _SIZE, 4), float32, bottom row first.

    Args:
        index: Index of the shutter.
    """
    y, x = (np.mgrid[:_SIZE, :_SIZE] + 0.5) * _UNITS / _SIZE
    picture = np.ones((_SIZE, _SIZE, 4), dtype=np.float32)
    picture[..., :3] = patterns.painted(_LIGHT, index, x, y)
    return picture


def unregister() -> None:
    bpy.utils.previews.remove(_icons())
    _icons.cache_clear()
