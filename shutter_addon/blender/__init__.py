"""Everything that touches bpy: properties, engine, strips, commands."""

from . import handlers
from .data import preferences, properties
from .interface import (
    bar_editor,
    full_quality,
    icons,
    inbetween_operators,
    matte_operators,
    note_buttons,
    operators,
    panels,
    preview,
    probe_gizmo,
    recipe_operators,
    region_gizmo,
    sharp_frame,
    split_gizmo,
    track_operators,
    translations,
)
from .rendering import engine

_modules = (
    translations,
    preferences,
    properties,
    engine,
    icons,
    sharp_frame,
    preview,
    operators,
    inbetween_operators,
    track_operators,
    matte_operators,
    recipe_operators,
    full_quality,
    panels,
    note_buttons,
    bar_editor,
    region_gizmo,
    split_gizmo,
    probe_gizmo,
    handlers,
)
_commands: list = []


def register() -> None:
    """Registers everything with Blender, the command included."""
    import bpy

    for module in _modules:
        module.register()
    _commands.append(bpy.utils.register_cli_command("shutter", _run))


def unregister() -> None:
    """Leaves nothing behind."""
    import bpy

    bpy.utils.unregister_cli_command(_commands.pop())
    for module in reversed(_modules):
        module.unregister()


def _run(argv: list[str]) -> int:
    from .command import main

    return main(argv)
