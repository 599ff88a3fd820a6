"""Base classes of the gizmos in previews and of their groups with shortcuts, and where a preview shows the picture."""

from typing import NamedTuple

import bpy
import numpy as np
from bpy.types import Context, Event, Gizmo, KeyConfig, KeyMap, PropertyGroup, Region, Strip
from numpy.typing import ArrayLike

from ...core.model.scribbles import mapped
from ..data import annotations, preview_areas
from .operator_bases import Mixin

TWEAK = ("gizmogroup.gizmo_tweak", "LEFTMOUSE", "PRESS", {"any": True})


class Dragged(Mixin):
    """A gizmo that is drawn and can be dragged while it has something to show.

    Subclasses have these methods:

    - `seen(context)` returns what to draw, or None if there is nothing. Others get this as `seen`.
    - `show(context, seen)` draws it.
    - `is_at(context, seen, location)` tells whether a point (x, y) of the region, in pixels, is on it.
    - `grab(context, event, seen)` begins to drag when the mouse button is pressed.
    - `drag(context, event, tweak)` follows the pointer; `tweak` is Blender's set of "SNAP" and "PRECISE".
    """

    def setup(self) -> None:
        self.use_draw_modal = True

    def draw(self, context: Context) -> None:
        if (seen := self.seen(context)) is not None:
            self.show(context, seen)

    def test_select(self, context: Context, location: tuple[int, int]) -> int:
        seen = self.seen(context)
        return 0 if seen is not None and self.is_at(context, seen, location) else -1

    def invoke(self, context: Context, event: Event) -> set[str]:
        if (seen := self.seen(context)) is None:  # it may disappear during playback
            return {"CANCELLED"}
        self.grab(context, event, seen)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event, tweak: set[str]) -> set[str]:
        self.drag(context, event, tweak)
        return {"RUNNING_MODAL"}


class InPreview(Mixin):
    """A gizmo group in previews. By default it shows one gizmo where an effect is seen, while the live preview is on.

    Subclasses have `is_wanted(live)`, which tells whether to show it by the settings of the live preview
    (ShutterPreview), or replace `poll`.

    Attributes:
        gizmo: The gizmo's class, unless a subclass replaces `setup`.
    """

    bl_space_type = "SEQUENCE_EDITOR"
    bl_region_type = "PREVIEW"
    bl_options = {"PERSISTENT"}
    gizmo: type[Gizmo]

    @classmethod
    def poll(cls, context: Context) -> bool:
        live = context.window_manager.virtual_shutter
        return live.live and cls.is_wanted(live) and preview_areas.shown(context) is not None

    def setup(self, _context: Context) -> None:
        self.gizmos.new(self.gizmo.__name__)


class WithKeys(InPreview):
    """A gizmo group with shortcuts, which work while the pointer is over its gizmo. Subclasses have their own `poll`.

    D with a mouse drag, which annotates in Blender, also works there.

    Attributes:
        shortcuts: For each: bl_idname of the operator, type and value of the event, and a dictionary of further
            arguments for keymap_items.new.
    """

    shortcuts: tuple[tuple[str, str, str, dict], ...] = (TWEAK,)

    @classmethod
    def setup_keymap(cls, keyconfig: KeyConfig) -> KeyMap:
        keymap = keyconfig.keymaps.new(cls.__name__, space_type=cls.bl_space_type, region_type="WINDOW")
        pen = keymap.keymap_items.new("gpencil.annotate", "LEFTMOUSE", "PRESS", key_modifier="D")
        pen.properties.mode, pen.properties.wait_for_input = "DRAW", False
        for *event, more in cls.shortcuts:
            keymap.keymap_items.new(*event, **more)
        return keymap


class View(NamedTuple):
    """Where a preview shows an effect's picture.

    Attributes:
        matrix: (3, 3), from fractions 0 to 1 of the picture to pixels of the region.
        aspect: Width of the picture divided by its height.
    """

    matrix: np.ndarray
    aspect: float

    def on_region(self, points: ArrayLike) -> np.ndarray:
        """Convert points (n, 2) in fractions of the picture to pixels of the region."""
        return mapped(self.matrix, np.asarray(points, np.float64))

    def on_picture(self, x: float, y: float) -> np.ndarray:
        """Convert a point in pixels of the region to fractions of the picture (2,)."""
        return mapped(np.linalg.inv(self.matrix), np.array([(x, y)], np.float64))[0]


def view(effect: PropertyGroup, strip: Strip, region: Region) -> View:
    """Return where a region of a preview shows an effect's picture."""
    width, height = size = annotations.picture_size(effect)
    return View(annotations.picture_to_region(strip, size, region), width / height)


def unregister() -> None:
    """Remove the groups' keymaps, which Blender leaves behind."""
    made = {group.__name__ for group in WithKeys.__subclasses__()}
    keyconfigs = bpy.context.window_manager.keyconfigs
    for keyconfig in filter(None, (keyconfigs.default, keyconfigs.user)):
        for keymap in [keymap for keymap in keyconfig.keymaps if keymap.name in made]:
            keyconfig.keymaps.remove(keymap)
