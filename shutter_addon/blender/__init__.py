"""Everything that uses bpy: properties, the engine, strips, commands."""

from importlib import import_module
from types import ModuleType

import bpy

# The classes of each are registered (classes_of), then its `register` is called.
_MODULES = (
    "devices.main_thread",
    "interface.translations",
    "data.preferences",
    "data.properties",
    "data.movie_decoding",
    "rendering.engine",
    "interface.panel_parts",
    "interface.sharp_frame",
    "interface.preview",
    "interface.operators",
    "interface.track_operators",
    "interface.matte_operators",
    "interface.bake_operators",
    "interface.full_quality",
    "interface.panels",
    "interface.menus",
    "interface.gizmo_groups",
    "interface.bar_editor",
    "interface.region_gizmo",
    "interface.outline_operators",
    "interface.subject_operators",
    "interface.probe_gizmo",
    "handlers",
)
_modules = [import_module(f".{name}", __package__) for name in _MODULES]
_commands: list = []


def classes_of(module: ModuleType) -> tuple[type, ...]:
    """Return a module's classes to register: those named SHUTTER_…, and its `classes`."""
    own = [each for each in vars(module).values() if getattr(each, "__module__", "") == module.__name__]
    named = [each for each in own if isinstance(each, type) and each.__name__.startswith("SHUTTER_")]
    return (*named, *getattr(module, "classes", ()))


def register() -> None:
    """Register everything with Blender, with the command."""
    for module in _modules:
        for cls in classes_of(module):
            bpy.utils.register_class(cls)
        if hasattr(module, "register"):
            module.register()
    _commands.append(bpy.utils.register_cli_command("shutter", _run))


def unregister() -> None:
    """Unregister everything."""
    bpy.utils.unregister_cli_command(_commands.pop())
    for module in reversed(_modules):
        if hasattr(module, "unregister"):
            module.unregister()
        for cls in reversed(classes_of(module)):
            bpy.utils.unregister_class(cls)


def _run(argv: list[str]) -> int:
    from .command import main

    return main(argv)
