"""What happens by itself: effects follow their strips, an old file's sources are closed, and a render that cannot show
an effect ends."""

import sys

import bpy
from bpy.app.handlers import persistent

from . import building, cache, copies, kept, lifecycle, pictures, rendering, sources, strips


@persistent
def _before_load(*_):
    building.stop()
    pictures.forget()
    cache.forget()
    sources.forget()
    lifecycle.forget()


@persistent
def _after_load(*_):
    copies.adopt()
    lifecycle.mend()


@persistent
def _update(scene=None, *_):
    if not rendering.cancelling():
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
    if rendering.cancelling():
        return
    rendering.begin(scene)
    cache.drop_spoilt()
    if scene.render.engine == strips.ENGINE:
        return
    sources.look_again()
    sources.filming = rendering.runs()
    if bpy.app.background:  # in a window the render has a thread of its own, and the last update has seen to copies
        lifecycle.mend()
        copies.adopt()
    for edit in bpy.data.scenes:
        cache.invalidate_changed(edit)


@persistent
def _before_frame(scene, *_):
    if rendering.is_film(scene):
        if (sentence := strips.left_out(scene)) is not None:
            rendering.fail(sentence)
        if rendering.stopping():
            rendering.cancel()


@persistent
def _after_render(scene, *_):
    if rendering.is_film(scene):
        cache.drop_spoilt()
    rendering.end(scene, alone=sys._getframe().f_back is None)
    sources.filming = rendering.runs()


HANDLERS = {
    "load_pre": _before_load,
    "load_post": _after_load,
    "depsgraph_update_post": _update,
    "undo_post": _after_undo,
    "redo_post": _after_undo,
    "render_init": _before_render,
    "render_pre": _before_frame,
    "render_cancel": _after_render,
    "render_complete": _after_render,
}


def register():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(function)


def unregister():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(function)
    pictures.forget()
    sources.forget()
    lifecycle.forget()
    kept.forget()
