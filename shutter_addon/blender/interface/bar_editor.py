"""The bar editor: a gizmo in the preview that shows the active shutter's bars (weights of frames), to paint and key."""

from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.translations import contexts
from bpy.app.translations import pgettext_iface as iface_
from bpy.types import Context, Event, Gizmo, GizmoGroup, PropertyGroup, Scene, Strip

from ...core.messages import EffectError
from ..data import consistency, selection
from ..editing import bar_edits
from . import drawing
from .gizmo_groups import TWEAK, Dragged, WithKeys

_MARGIN, _HEIGHT, _BAR = 16, 96, 16  # interface units
_PAD, _HEADER = 8, 18
_SWATCH = 12
_SNAP = 0.1
_FINE = 0.1
_THRESHOLD = 3  # interface units: a longer movement is a drag


@dataclass(frozen=True)
class Layout:
    """Where the bar editor and its bars lie in the preview's region, in pixels.

    Attributes:
        frame: Box around the whole editor: left, bottom, right, top.
        box: Box around the bars, below the header: left, bottom, right, top.
        count: Number of bars.
        top: Weight at the upper edge of `box`; at the lower edge it is 0.
    """

    frame: tuple[float, float, float, float]
    box: tuple[float, float, float, float]
    count: int
    top: float

    def bar_at(self, x: float) -> int:
        """Return the index of the bar at x (pixels). Beyond the ends, return the first or last bar's."""
        left, _, right, _ = self.box
        return min(max(int((x - left) / (right - left) * self.count), 0), self.count - 1)

    def weight_at(self, y: float) -> float:
        """Return the weight of a bar that reaches up to y (pixels), at least 0."""
        _, bottom, _, top = self.box
        return max((y - bottom) / (top - bottom) * self.top, 0.0)

    def contains(self, x: float, y: float) -> bool:
        left, bottom, right, top = self.frame
        return left <= x < right and bottom <= y < top


def layout(width: float, bars: np.ndarray, unit: float) -> Layout:
    """Return the layout of the bar editor, at the lower left of a preview. It is narrower in a narrow region.

    The highest bar, or the weight 1 if that is higher, reaches the upper edge of the box.

    Args:
        width: Width of the preview's region in pixels.
        bars: The bars (L,) to show: a weight for each frame.
        unit: Pixels per interface unit.
    """
    margin, pad = _MARGIN * unit, _PAD * unit
    # A narrow region shows the left part of the editor.
    width = max(min(max(len(bars) * _BAR, 200) * unit, width - 2 * margin), 4 * pad)
    frame = margin, margin, margin + width, margin + _HEIGHT * unit
    box = frame[0] + pad, frame[1] + pad, frame[2] - pad, frame[3] - _HEADER * unit
    return Layout(frame=frame, box=box, count=len(bars), top=max(1.0, float(np.max(bars, initial=0.0))))


def _layout(context: Context, bars: np.ndarray) -> Layout:
    return layout(context.region.width, bars, drawing.ui_scale())


def painted(
    values: np.ndarray, place: Layout, start: tuple[float, float], end: tuple[float, float], snap: bool
) -> np.ndarray:
    """Return bars (L,) after the pointer was dragged from one point to another: each bar on the way gets a new weight.

    The weight is read at the height of the straight line between the points, and limited to 0 to `place.top`. Within a
    single bar, it is read at the end point.

    Args:
        values: The bars before, (L,).
        place: Where the bars lie.
        start: Start point (x, y) in pixels of the region.
        end: End point (x, y) in pixels of the region.
        snap: Round new weights to multiples of _SNAP.
    """
    result = np.array(values, dtype=np.float64)
    first, last = place.bar_at(start[0]), place.bar_at(end[0])
    steps = abs(last - first)
    for step in range(steps + 1):
        u = step / steps if steps else 1.0
        weight = min(place.weight_at((1 - u) * start[1] + u * end[1]), place.top)
        bar = first + step * (1 if last >= first else -1)
        result[bar] = round(weight / _SNAP) * _SNAP if snap else weight
    return result


def bar_under(context: Context, x: float, y: float) -> int | None:
    """Return the index of the active shutter's bar at a point of a preview, in pixels; None: there is none."""
    if context.region is None or context.region.type != "PREVIEW" or (seen := _seen(context)) is None:
        return None
    place = _layout(context, seen[3])
    return place.bar_at(x) if place.contains(x, y) else None


def _seen(context: Context) -> tuple[Scene, PropertyGroup, Strip, np.ndarray, list[str]] | None:
    """Return what the bar editor shows of the active effect.

    None: the preview does not show that effect, it has no active shutter, or the shutter's bars are invalid.

    Returns:
        Scene, effect and effect strip, the active shutter's bars (L,), and their key states (bar_edits.key_state).
    """
    seen = selection.in_picture(context)
    if seen is None or selection.active_shutter(effect := seen[1]) is None:
        return None
    try:
        return (*seen, *bar_edits.shown(effect, effect.active_shutter))
    except EffectError:  # panels and the live preview show the error
        return None


class SHUTTER_GT_bars(Dragged, Gizmo):
    seen = staticmethod(_seen)

    def show(self, context: Context, seen: tuple) -> None:
        scene, effect, strip, bars, states = seen
        shutter = selection.active_shutter(effect)
        words, place = bar_edits.current_summary(scene, effect, strip, bars), _layout(context, bars)
        _draw(place, shutter, bars, states)
        _draw_header(place, shutter, effect.active_shutter, f"{shutter.name}   {words}")

    def is_at(self, context: Context, seen: tuple, location: tuple[int, int]) -> bool:
        return _layout(context, seen[3]).contains(*location)

    def grab(self, context: Context, event: Event, seen: tuple) -> None:
        effect = seen[1]
        self.index = effect.active_shutter
        self.target = selection.Target.of(effect, None)  # during playback, another effect may become active
        self.before = consistency.bars(effect.shutters[self.index])
        # Between keys, the visible bars differ from the stored ones.
        self.values = bar_edits.bars_now(effect, self.index)
        # The scale stays while dragging, so that bars do not run away from the pointer.
        self.place = _layout(context, self.values)
        self.mouse = self.point = event.mouse_region_x, event.mouse_region_y
        self.paints = False  # a click or double click does not paint

    def drag(self, context: Context, event: Event, tweak: set[str]) -> None:
        mouse = event.mouse_region_x, event.mouse_region_y
        threshold = _THRESHOLD * drawing.ui_scale()
        self.paints = self.paints or max(abs(a - b) for a, b in zip(mouse, self.mouse, strict=True)) >= threshold
        # `tweak` has keys that are pressed during the drag, the event those that were held before.
        fine, snap = "PRECISE" in tweak or event.shift, "SNAP" in tweak or event.ctrl
        effect = self.target.effect()
        if effect is not None and self.paints and (mouse != self.mouse or snap):
            point = mouse[0], self.point[1] + (mouse[1] - self.mouse[1]) * (_FINE if fine else 1.0)
            self.values = painted(self.values, self.place, self.point, point, snap)
            bar_edits.paint(effect, self.index, self.values)
            self.mouse, self.point = mouse, point
            context.area.tag_redraw()

    def exit(self, context: Context, cancel: bool) -> None:
        effect = self.target.effect()
        if effect is None or not self.paints:
            return
        if cancel:
            bar_edits.set_bars(effect.shutters[self.index], self.before)
            return
        if bar_edits.auto_key(context):
            bar_edits.key_bars(effect, self.index)
        bpy.ops.ed.undo_push(message=iface_("Paint Bars", contexts.operator_default))


def _draw(place: Layout, shutter: PropertyGroup, values: np.ndarray, states: list[str]) -> None:
    left, bottom, right, _top = place.box
    edges = np.linspace(left, right, place.count + 1)
    thin, foot = drawing.line_width(), drawing.ui_scale() * 3
    theme = bpy.context.preferences.themes[0].user_interface.wcol_state
    colors = {"animated": theme.inner_anim, "keyed": theme.inner_key, "changed": theme.inner_changed}
    drawing.rectangles([place.frame], [drawing.BACK])
    boxes = drawing.bars(place.box, np.minimum(values / place.top, 1.0), (*shutter.color, 0.95))
    keyed = [i for i, state in enumerate(states) if state]
    feet = [(boxes[i][0], bottom - foot - thin, boxes[i][2], bottom - thin) for i in keyed]
    drawing.rectangles(feet, [(*colors[states[i]][:3], 1.0) for i in keyed])
    ticks = range(0, place.count + 1, max(1, 4 * (place.count // 32), 4 if place.count > 8 else 1))
    marks = [(edges[k] - thin / 2, bottom - 2 * foot - thin, edges[k] + thin / 2, bottom - thin) for k in ticks]
    drawing.rectangles(marks, [(1, 1, 1, 0.5)] * len(ticks))


def _draw_header(place: Layout, shutter: PropertyGroup, index: int, words: str) -> None:
    """Draw the shutter's color with its pattern, and a text, above the bars.

    Args:
        index: Index of the shutter, which determines the pattern.
        words: The text.
    """
    unit, (left, _, _, top) = drawing.ui_scale(), place.box
    bottom = top + 4 * unit
    start, (_, _, right, upper) = left + (_SWATCH + 6) * unit, place.frame
    if (end := start + drawing.text_width(words) + _PAD * unit) > right:  # text on footage would be hard to read
        drawing.rectangles([(right, top, end, upper)], [drawing.BACK])
    drawing.swatch(left, bottom - unit, _SWATCH * unit, shutter, index)
    drawing.text(start, bottom, words)


class SHUTTER_GGT_bars(WithKeys, GizmoGroup):
    bl_label = "Shutter Bars"
    gizmo = SHUTTER_GT_bars
    shortcuts = (
        ("shutter.bar_set", "LEFTMOUSE", "DOUBLE_CLICK", {}),
        TWEAK,
        ("shutter.bars_key", "I", "PRESS", {}),
        ("shutter.bars_unkey", "I", "PRESS", {"alt": True}),
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        seen = selection.in_picture(context)
        return seen is not None and selection.active_shutter(seen[1]) is not None and seen[0].is_editable
