"""What panels are made of: sentences, lists, and when there is an effect to show. And icons: little pictures of the
presets' bars, for menus, and of the patterns that mattes show, for lists."""

from collections.abc import Callable, Sequence
from typing import Any

import bpy.utils.previews
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.types import Context, Menu, PropertyGroup, Scene, Strip, UILayout
from bpy.utils.previews import ImagePreviewCollection

from ...core import told
from ...core.model import shutters
from ...core.model.fields import fields_of
from ...core.pixels import patterns
from ..data import selection
from . import drawing
from .operator_bases import Mixin

Draws = Callable[[UILayout, Scene, PropertyGroup, Strip], None]  # what a panel shows of an effect

# Units of the interface beside a sentence in a panel: margins and the tabs of a sidebar; its icon.
_MARGIN, _ICON = 64, 20
WIDEST = 360  # units of the interface that a sentence takes at most, as a popover does

_MOST_ROWS = 5  # of a list; the rest is scrolled to
_SIZE, _WINDOW = 32, 8  # of an icon, in pixels, and of the bars that it shows
_UNITS = 16  # of the interface, along each side of an icon
_LIGHT = (0.8, 0.8, 0.8)
_icons: list[ImagePreviewCollection] = []  # of Blender's: one while the extension is registered


def sentence(layout: UILayout, words: str, icon: str = "NONE", room: float = 1.0, is_quiet: bool = False) -> None:
    """A sentence, already translated, in as many lines as the panel's width takes; room: its share of that width."""
    if icon == "ERROR":
        told.shown(words, level=2)
    unit, region = drawing.ui_scale(), bpy.context.region
    width = (
        room * min(region.width if region else 300 * unit, WIDEST * unit)
        - (_MARGIN + (_ICON if icon != "NONE" else 0)) * unit
    )
    column = layout.column(align=True)
    column.active = not is_quiet
    for i, line in enumerate(drawing.wrapped(words, width)):
        row = column.row()
        row.scale_y = 0.8 if i else 1.0
        row.label(text=line, icon=icon if i == 0 or icon == "NONE" else "BLANK1", translate=False)


def draw_fields(layout: UILayout, owner: PropertyGroup, kind: type) -> None:
    """The properties that the fields of a class of the model have panels show by themselves."""
    for field in fields_of(kind).values():
        if field.shown:
            layout.prop(owner, field.blender)


def draw_list(
    layout: UILayout, effect: PropertyGroup, kind: str, items: Sequence[PropertyGroup], menu: str | None = None
) -> None:
    """The list of shutters or regions, as high as it has to be, and the buttons beside it."""
    row = layout.row()
    row.template_list(
        f"SHUTTER_UL_{kind}s",
        "",
        effect,
        f"{kind}s",
        effect,
        f"active_{kind}",
        rows=min(max(len(items), 1), _MOST_ROWS),
    )
    column = row.column(align=True)
    if kind == "shutter":
        column.operator("shutter.shutter_add", text="", icon="ADD")
    else:
        column.operator("shutter.draw", text="", icon="ADD").new = True
    column.operator(f"shutter.{kind}_remove", text="", icon="REMOVE")
    if menu:
        column.menu(menu, text="", icon="DOWNARROW_HLT")
    elif len(items) > 1:
        draw_moves(column, kind, has_text=False)


def draw_moves(layout: UILayout, kind: str, *, has_text: bool = True) -> None:
    """What moves the active shutter or region in its list."""
    ways = (
        ("UP", n_("Move Up", contexts.operator_default), "TRIA_UP"),
        ("DOWN", n_("Move Down", contexts.operator_default), "TRIA_DOWN"),
    )
    for direction, text, icon in ways:
        layout.operator(f"shutter.{kind}_move", text=text if has_text else "", icon=icon).direction = direction


def draw_operators(layout: UILayout, *entries: tuple[str, ...]) -> None:
    """Operators of ours: see _draw_operator."""
    for entry in entries:
        _draw_operator(layout, *entry)


def _draw_operator(layout: UILayout, name: str, icon: str = "NONE", prop: str = "") -> None:
    """prop: whose items are a menu of their own"""
    if prop:
        layout.operator_menu_enum(f"shutter.{name}", prop, icon=icon)
    else:
        layout.operator(f"shutter.{name}", icon=icon)


def draw_properties(layout: UILayout, owner: bpy.types.bpy_struct, *names: str) -> None:
    for name in names:
        layout.prop(owner, name)


def draw_progress(layout: UILayout, done: int, total: int) -> None:
    text = iface_("{done} of {total}").format(done=done, total=total)
    layout.progress(factor=done / max(total, 1), text=text, translate=False)


def of_effect(label: str, draws: Draws, shows: Callable[[PropertyGroup], Any] | None = None, **look: object) -> type:
    """Makes a panel of the effect, closed at first.

    shows: gives what there is to show of an effect, if anything; look: what else the class has for Blender"""

    class Drawn(Mixin):
        @classmethod
        def poll(cls, context: Context) -> bool:
            active = selection.active(context) if super().poll(context) else None
            return active is not None and (shows is None or bool(shows(active[1])))

        def draw(self, context: Context) -> None:
            self.layout.use_property_split = True
            draws(self.layout, *selection.active(context))

    return type("Drawn", (Drawn,), {"bl_label": label, "bl_options": {"DEFAULT_CLOSED"}} | look)


def menu(name: str, label: str) -> Callable[[Callable[[UILayout, Context], None]], type[Menu]]:
    """Makes a menu, SHUTTER_MT_ and its name, of a function that draws it."""

    def made(draws: Callable[[UILayout, Context], None]) -> type[Menu]:
        def draw(self: Menu, context: Context) -> None:
            draws(self.layout, context)

        content = {"__module__": draws.__module__, "bl_label": label, "draw": draw}
        return type(f"SHUTTER_MT_{name}", (Menu,), content)

    return made


def icon_of(name: str) -> int:
    """The icon of a preset; 0, which is none, in the background."""
    return _icons[0][name].icon_id if _icons and name in _icons[0] else 0


def pattern_icon(index: int) -> int:
    """The icon of the pattern that the shutter at an index of the list has; 0, which is none, in the background."""
    return icon_of(str(index % patterns.COUNT))


def _drawn(bars: np.ndarray) -> np.ndarray:
    """Bars as a picture (size, size, 4), bottom row first."""
    picture = np.zeros((_SIZE, _SIZE, 4), dtype=np.float32)
    width = _SIZE // len(bars)
    picture[1, :] = 0.5
    for k, weight in enumerate(bars):
        picture[2 : 2 + round(weight * (_SIZE - 4)), k * width : (k + 1) * width - 1] = (0.9, 0.9, 0.9, 1.0)
    return picture


def _painted(index: int) -> np.ndarray:
    """A pattern as a picture (size, size, 4), bottom row first."""
    y, x = (np.mgrid[:_SIZE, :_SIZE] + 0.5) * _UNITS / _SIZE
    picture = np.ones((_SIZE, _SIZE, 4), dtype=np.float32)
    picture[..., :3] = patterns.painted(_LIGHT, index, x, y)
    return picture


def register() -> None:
    _icons.append(bpy.utils.previews.new())
    pictures = {name: _drawn(shutters.preset_bars(name, _WINDOW)) for name in shutters.PRESETS}
    pictures |= {str(index): _painted(index) for index in range(patterns.COUNT)}
    for name, picture in pictures.items():
        icon = _icons[0].new(name)
        icon.icon_size = icon.image_size = (_SIZE, _SIZE)
        icon.icon_pixels_float = icon.image_pixels_float = picture.ravel()


def unregister() -> None:
    bpy.utils.previews.remove(_icons.pop())
