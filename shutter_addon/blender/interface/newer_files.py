"""Says that a file which was opened holds what this version of the extension does not know."""

import sys
from collections.abc import Iterable
from functools import partial

import bpy

from ...core import told
from ...core.messages import sentence, signed
from ..data import data_format


def tell(scenes: Iterable) -> None:
    """Says it once, of the first such scene: in the window, or on stderr where there is none."""
    words = next(filter(None, map(data_format.note, scenes)), None)
    if words is None:
        return
    told.record(words)
    if bpy.app.background:
        print(signed(words), file=sys.stderr)
    else:  # while a file is loaded, its windows are not there yet
        bpy.app.timers.register(partial(_show, sentence(words)), first_interval=0.0)


def _show(words: str) -> None:
    manager = bpy.context.window_manager
    with bpy.context.temp_override(window=manager.windows[0]):
        manager.popup_menu(
            lambda menu, _context: menu.layout.label(text=words, translate=False), title="Virtual Shutter", icon="INFO"
        )
