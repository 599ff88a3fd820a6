"""What happens by itself: copies of effect strips get data of their own, and an old file's sources are closed."""

import bpy
from bpy.app.handlers import persistent

from . import copies, pictures, strips


@persistent
def _before_load(*_):
    pictures.forget()


@persistent
def _adopt_copies(*_):
    copies.adopt()


@persistent
def _before_render(scene, *_):
    # In a window the render has a thread of its own, and the last update has seen to copies.
    if bpy.app.background and scene.render.engine != strips.ENGINE:
        copies.adopt()


HANDLERS = {
    "load_pre": _before_load,
    "load_post": _adopt_copies,
    "depsgraph_update_post": _adopt_copies,
    "render_init": _before_render,
}


def register():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(function)


def unregister():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(function)
    pictures.forget()
