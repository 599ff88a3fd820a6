"""Buttons behind the preview's notes. Each calls an operator."""

from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Gizmo, GizmoGroup, Region

from . import drawing
from .gizmo_groups import InPreview, Seen

HEIGHT = 19  # interface units
_PAD = 8
OPERATORS = "shutter.full_quality", "shutter.smooth_streaks"


Button = tuple[str, str]  # operator (in previews one of OPERATORS) and label (in panels, "" for the operator's own)


def of_strobing(step: float) -> tuple[str, Button]:
    """Return the note about too few frames with its button.

    Args:
        step: pixels from one exposed frame to the next.
    """
    words = rpt_("Too few frames: steps of {pixels} pixels").format(pixels=f"{step:.0f}")
    return words, ("shutter.smooth_streaks", iface_("Smooth"))


places: dict[tuple[int, str], tuple[drawing.Box, Button]] = {}  # by region and operator, for the gizmos


def clear(region: Region) -> None:
    """Remove all buttons from a region."""
    for key in [key for key in places if key[0] == region.as_pointer()]:
        del places[key]


def width(button: Button) -> float:
    """Return the width of a button in pixels."""
    return drawing.text_width(button[1]) + 2 * _PAD * drawing.ui_scale()


def place(region: Region, left: float, bottom: float, button: Button) -> None:
    """Put a button into a region, where its gizmo draws it."""
    box = left, bottom, left + width(button), bottom + HEIGHT * drawing.ui_scale()
    places[region.as_pointer(), button[0]] = box, button


class SHUTTER_GT_note_button(Seen, Gizmo):
    def seen(self, context: Context) -> tuple[drawing.Box, Button] | None:
        return places.get((context.region.as_pointer(), self.operator))

    def show(self, context: Context, seen: tuple[drawing.Box, Button]) -> None:
        (left, bottom, right, top), (_operator, label) = seen
        look = context.preferences.themes[0].user_interface.wcol_tool
        unit, thin = drawing.ui_scale(), drawing.line_width()
        with drawing.pixel_space(context.region):
            drawing.rectangles([(left, bottom, right, top)], [(*look.outline[:3], 1.0)])
            inner = (left + thin, bottom + thin, right - thin, top - thin)
            drawing.rectangles([inner], [(*(look.inner_sel if self.is_highlight else look.inner)[:3], 1.0)])
            color = look.text_sel if self.is_highlight else look.text
            drawing.text(left + _PAD * unit, bottom + 6 * unit, label, color=(*color, 1.0))

    def is_at(self, _context: Context, seen: tuple[drawing.Box, Button], location: tuple[int, int]) -> bool:
        (left, bottom, right, top), _button = seen
        return left <= location[0] <= right and bottom <= location[1] <= top


class SHUTTER_GGT_note_buttons(InPreview, GizmoGroup):
    bl_label = "Buttons of Notes"

    def setup(self, _context: Context) -> None:
        for operator in OPERATORS:
            gizmo = self.gizmos.new(SHUTTER_GT_note_button.__name__)
            gizmo.operator = operator
            gizmo.target_set_operator(operator)


def unregister() -> None:
    places.clear()
