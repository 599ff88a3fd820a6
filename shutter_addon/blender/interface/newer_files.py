"""Says that a file which was opened holds what this version of the extension does not know."""

import sys
from collections.abc import Iterable

import bpy

from ...core import told
from ...core.messages import sentence, signed
from ..data import data_format

_words: list[str] = []  # of the sentence that waits for the window, or was shown last


def tell(scenes: Iterable) -> None:
    """Says it once, of the first such scene: in the window, or on stderr where there is none."""
    words = data_format.note(scenes)
    if words is None:
        return
    told.record(words)
    if bpy.app.background:
        print(signed(words), file=sys.stderr)
    else:  # while a file is loaded, its windows are not there yet
        _words[:] = [sentence(words)]
        if not bpy.app.timers.is_registered(_show):
            bpy.app.timers.register(_show, first_interval=0.0)


def _show() -> None:
    """A timer, once."""
    (words,), manager = _words, bpy.context.window_manager
    if not manager.windows:
        return
    with bpy.context.temp_override(window=manager.windows[0]):
        manager.popup_menu(
            lambda menu, _context: menu.layout.label(text=words, translate=False), title="Virtual Shutter", icon="INFO"
        )


TIMERS = (_show,)
