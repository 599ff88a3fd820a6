"""Says that a file which was opened holds what this version of the extension does not know."""

import sys
from collections.abc import Iterable

import bpy

from ...core import told
from ...core.messages import sentence, signed
from ..data import data_format
from .operator_bases import popup, soon

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
        soon(_show)


def _show() -> None:
    """A timer, once."""
    if windows := bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=windows[0]):
            popup(bpy.context, *_words, title="Virtual Shutter", icon="INFO")


TIMERS = (_show,)
