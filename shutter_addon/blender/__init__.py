"""Everything that uses bpy: properties, the engine, strips, commands."""

from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

import bpy

from .. import features
from . import interface

# The classes of each are registered (classes_of), then its `register` is called.
_GIZMOS = "interface.probe_gizmo", "interface.region_gizmo"  # what is registered before them is grabbed before them
_INTERFACE = sorted({f"interface.{module.name}" for module in iter_modules(interface.__path__)} - set(_GIZMOS))
_MODULES = "devices.main_thread", "data.preferences", "data.properties", "rendering.engine", *_INTERFACE
_modules = [import_module(f".{name}", __package__) for name in _MODULES]
_modules += [*features.modules(), *(import_module(f".{name}", __package__) for name in (*_GIZMOS, "handlers"))]


def classes_of(module: ModuleType) -> tuple[type, ...]:
    """Return a module's classes to register: those named SHUTTER_…, and its `classes`."""
    own = [each for each in vars(module).values() if getattr(each, "__module__", "") == module.__name__]
    named = [each for each in own if isinstance(each, type) and each.__name__.startswith("SHUTTER_")]
    return (*named, *getattr(module, "classes", ()))


@cache
def _command() -> object:
    return bpy.utils.register_cli_command("shutter", _run)


def register() -> None:
    """Register everything with Blender, with the command."""
    for module in _modules:
        for cls in classes_of(module):
            bpy.utils.register_class(cls)
        if hasattr(module, "register"):
            module.register()
    _command()


def unregister() -> None:
    """Unregister everything."""
    bpy.utils.unregister_cli_command(_command())
    _command.cache_clear()
    for module in reversed(_modules):
        if hasattr(module, "unregister"):
            module.unregister()
        for cls in reversed(classes_of(module)):
            bpy.utils.unregister_class(cls)


def _run(argv: list[str]) -> int:
    from .command import main

    return main(argv)
