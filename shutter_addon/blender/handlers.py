"""What happens by itself: effects follow their strips, and an old file's sources are closed."""

import bpy
from bpy.app.handlers import persistent

from . import building, cache, copies, kept, lifecycle, pictures, sources, strips


@persistent
def _before_load(*_):
    building.stop()
    pictures.forget()
    cache.forget()
    lifecycle.forget()


@persistent
def _after_load(*_):
    copies.adopt()


@persistent
def _update(scene=None, *_):
    lifecycle.update(scene)


@persistent
def _after_undo(*_):
    for edit in bpy.data.scenes:
        cache.invalidate(edit)
    pictures.drop_removed()
    _show_scribbles()


def _show_scribbles():
    """Previews lose their annotation when undo removes it, and do not find it again with redo."""
    found = strips.active(bpy.context)
    for _window, area in strips.previews(bpy.context):
        if found and area.spaces.active.annotation is None:
            area.spaces.active.annotation = found[1].scene.annotation


@persistent
def _before_render(scene, *_):
    if scene.render.engine != strips.ENGINE:
        sources.look_again()
    # In a window the render has a thread of its own, and the last update has seen to copies.
    if bpy.app.background and scene.render.engine != strips.ENGINE:
        copies.adopt()
        for edit in bpy.data.scenes:
            cache.invalidate_changed(edit)


HANDLERS = {
    "load_pre": _before_load,
    "load_post": _after_load,
    "depsgraph_update_post": _update,
    "undo_post": _after_undo,
    "redo_post": _after_undo,
    "render_init": _before_render,
}


def register():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(function)


def unregister():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(function)
    pictures.forget()
    lifecycle.forget()
    kept.forget()
