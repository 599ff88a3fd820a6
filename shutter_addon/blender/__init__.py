"""Everything that touches bpy: properties, engine, strips, commands."""

from importlib import import_module

import bpy

# Blender gets the `classes` of each, and loses its `TIMERS`; all else that it gets, `register` and `unregister` know.
_MODULES = (
    "data.main_thread",
    "interface.translations",
    "data.preferences",
    "data.properties",
    "data.movie_decoding",
    "rendering.engine",
    "interface.icons",
    "interface.sharp_frame",
    "interface.preview",
    "interface.operators",
    "interface.inbetween_operators",
    "interface.track_operators",
    "interface.matte_operators",
    "interface.readout_operators",
    "interface.outline_operators",
    "interface.outline_points",
    "interface.copy_operators",
    "interface.bake_operators",
    "interface.full_quality",
    "interface.numeric_operators",
    "interface.panels",
    "interface.menus",
    "interface.note_buttons",
    "interface.newer_files",
    "interface.gizmo_groups",
    "interface.bar_editor",
    "interface.region_gizmo",
    "interface.outline_gizmo",
    "interface.split_gizmo",
    "interface.probe_gizmo",
    "handlers",
)
_modules = [import_module(f".{name}", __package__) for name in _MODULES]
_commands: list = []


def register() -> None:
    """Registers everything with Blender, the command included."""
    for module in _modules:
        for cls in getattr(module, "classes", ()):
            bpy.utils.register_class(cls)
        if hasattr(module, "register"):
            module.register()
    _commands.append(bpy.utils.register_cli_command("shutter", _run))


def unregister() -> None:
    """Leaves nothing behind."""
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
