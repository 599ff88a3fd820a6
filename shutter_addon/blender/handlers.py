"""What happens by itself: copies of effect strips get data of their own, and an old file's sources are closed."""

import bpy
from bpy.app.handlers import persistent

from . import pictures


@persistent
def _loaded(*_):
    pictures.forget()


HANDLERS = {"load_pre": _loaded}


def register():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(function)


def unregister():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(function)
    pictures.forget()
