"""Everything that touches bpy: properties, engine, strips, commands."""

from . import handlers
from .data import main_thread, movie_decoding, preferences, properties
from .interface import (
    bake_operators,
    bar_editor,
    copy_operators,
    full_quality,
    gizmo_groups,
    icons,
    inbetween_operators,
    matte_operators,
    menus,
    newer_files,
    note_buttons,
    numeric_operators,
    operators,
    outline_gizmo,
    outline_operators,
    outline_points,
    panels,
    preview,
    probe_gizmo,
    readout_operators,
    region_gizmo,
    sharp_frame,
    split_gizmo,
    track_operators,
    translations,
)
from .rendering import engine

# Blender gets the `classes` of each, and loses its `TIMERS`; all else that it gets, `register` and `unregister` know.
_modules = (
    main_thread,
    translations,
    preferences,
    properties,
    movie_decoding,
    engine,
    icons,
    sharp_frame,
    preview,
    operators,
    inbetween_operators,
    track_operators,
    matte_operators,
    readout_operators,
    outline_operators,
    outline_points,
    copy_operators,
    bake_operators,
    full_quality,
    numeric_operators,
    panels,
    menus,
    note_buttons,
    newer_files,
    gizmo_groups,
    bar_editor,
    region_gizmo,
    outline_gizmo,
    split_gizmo,
    probe_gizmo,
    handlers,
)
_commands: list = []


def register() -> None:
    """Registers everything with Blender, the command included."""
    import bpy

    for module in _modules:
        for cls in getattr(module, "classes", ()):
            bpy.utils.register_class(cls)
        if hasattr(module, "register"):
            module.register()
    _commands.append(bpy.utils.register_cli_command("shutter", _run))


def unregister() -> None:
    """Leaves nothing behind."""
    import bpy

    bpy.utils.unregister_cli_command(_commands.pop())
    for module in reversed(_modules):
        if hasattr(module, "unregister"):
            module.unregister()
        for timer in filter(bpy.app.timers.is_registered, getattr(module, "TIMERS", ())):
            bpy.app.timers.unregister(timer)
        for cls in reversed(getattr(module, "classes", ())):
            bpy.utils.unregister_class(cls)


def _run(argv: list[str]) -> int:
    from .command import main

    return main(argv)
