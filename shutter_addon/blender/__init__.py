"""The part of the extension that needs bpy, and its registration with Blender.

Blender calls `register` when the extension is enabled and `unregister` when it is disabled.
"""

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
    """Return the Blender classes that a module wants registered: its own named SHUTTER_…, then its tuple `classes`."""
    own = [each for each in vars(module).values() if getattr(each, "__module__", "") == module.__name__]
    named = [each for each in own if isinstance(each, type) and each.__name__.startswith("SHUTTER_")]
    return (*named, *getattr(module, "classes", ()))


@cache
def _command() -> object:
    return bpy.utils.register_cli_command("shutter", _run)


def register() -> None:
    """Register all modules' classes, call the modules' own `register`, and add the command `blender -c shutter`."""
    for module in _modules:
        for cls in classes_of(module):
            bpy.utils.register_class(cls)
        if hasattr(module, "register"):
            module.register()
    _command()


def unregister() -> None:
    """Undo `register`, in reverse order."""
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
