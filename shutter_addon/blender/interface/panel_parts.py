"""What panels are made of: sentences, lists, and when there is an effect to show."""

import bpy

from ...core import told
from ..data import selection
from . import drawing
from .operator_bases import Mixin

# Units of the interface beside a sentence in a panel: margins and the tabs of a sidebar; its icon.
_MARGIN, _ICON = 64, 20
WIDEST = 360  # units of the interface that a sentence takes at most, as a popover does

_MOST_ROWS = 5  # of a list; the rest is scrolled to


def sentence(layout, words: str, icon: str = "NONE", room: float = 1.0, is_quiet: bool = False) -> None:
    """A sentence, already translated, in as many lines as the panel's width takes; room: its share of that width."""
    if icon == "ERROR":
        told.shown(words)
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


def _rows(items) -> int:
    """Of a list of so many."""
    return min(max(len(items), 1), _MOST_ROWS)


def draw_list(layout, effect, kind: str, items, menu: str | None = None) -> None:
    """The list of shutters or regions, as high as it has to be, and the buttons beside it."""
    row = layout.row()
    row.template_list(f"SHUTTER_UL_{kind}s", "", effect, f"{kind}s", effect, f"active_{kind}", rows=_rows(items))
    column = row.column(align=True)
    if kind == "shutter":
        column.operator("shutter.shutter_add", text="", icon="ADD")
    else:
        column.operator("shutter.draw", text="", icon="ADD").new = True
    column.operator(f"shutter.{kind}_remove", text="", icon="REMOVE")
    if menu:
        column.menu(menu, text="", icon="DOWNARROW_HLT")
    elif len(items) > 1:
        column.operator(f"shutter.{kind}_move", text="", icon="TRIA_UP").direction = "UP"
        column.operator(f"shutter.{kind}_move", text="", icon="TRIA_DOWN").direction = "DOWN"


class WithEffect(Mixin):
    @classmethod
    def poll(cls, context):
        return super().poll(context) and selection.active(context) is not None
