"""What happens by itself: effects follow their strips, and an old file's sources are closed."""

import bpy
from bpy.app.handlers import persistent

from . import cache, copies, lifecycle, pictures, strips


@persistent
def _before_load(*_):
    pictures.forget()


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


@persistent
def _before_render(scene, *_):
    # In a window the render has a thread of its own, and the last update has seen to copies.
    if bpy.app.background and scene.render.engine != strips.ENGINE:
        copies.adopt()
        for edit in bpy.data.scenes:
            cache.invalidate_changed(edit)


def _after_draw():
    if not (bpy.context.screen.is_animation_playing or bpy.app.timers.is_registered(_look)):
        bpy.app.timers.register(_look)


def _look():
    """Drawing and erasing a stroke updates no depsgraph, but redraws the preview."""
    if bpy.app.is_job_running("RENDER"):
        return
    changed = [cache.invalidate_changed(edit) for edit in bpy.data.scenes]
    if any(changed):
        for area in (area for window in bpy.context.window_manager.windows for area in window.screen.areas):
            if area.type == "SEQUENCE_EDITOR":
                area.tag_redraw()


HANDLERS = {
    "load_pre": _before_load,
    "load_post": _after_load,
    "depsgraph_update_post": _update,
    "undo_post": _after_undo,
    "redo_post": _after_undo,
    "render_init": _before_render,
}


_draw_handlers = []


def register():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(function)
    if not bpy.app.background:
        space = bpy.types.SpaceSequenceEditor
        _draw_handlers.append(space.draw_handler_add(_after_draw, (), "PREVIEW", "POST_PIXEL"))


def unregister():
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(function)
    while _draw_handlers:
        bpy.types.SpaceSequenceEditor.draw_handler_remove(_draw_handlers.pop(), "PREVIEW")
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    pictures.forget()
