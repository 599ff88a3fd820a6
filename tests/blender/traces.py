"""What is left of the extension: names in Blender's lists, and Python objects that anything still holds.

Run inside Blender, or with the bpy wheel: enables and disables the extension twice."""

import gc
import sys
import types
import typing
import weakref

import bpy  # before its addon_utils

NAME = "bl_ext.user_default.virtual_shutter"
MENUS = ("SEQUENCER_MT_add_effect", "SEQUENCER_MT_strip", "SEQUENCER_MT_context_menu")
BASES = (
    "AddonPreferences",
    "Gizmo",
    "GizmoGroup",
    "Menu",
    "Operator",
    "Panel",
    "PropertyGroup",
    "RenderEngine",
    "UIList",
)
OWNERS = ("Scene", "Strip", "WindowManager")


def traces():
    """Sets of names, by kind."""
    handlers = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)}
    draws = [getattr(bpy.types, menu).draw for menu in MENUS]
    classes = [cls for base in BASES for cls in getattr(bpy.types, base).__subclasses__()]
    keymaps = [(c, k) for c in bpy.context.window_manager.keyconfigs for k in c.keymaps]
    return {
        "handlers": {
            (n, f.__name__) for n, functions in handlers.items() if isinstance(functions, list) for f in functions
        },
        "types": set(dir(bpy.types)),
        "operators": set(dir(bpy.ops.shutter)),
        "registered": {cls.__name__ for cls in classes if getattr(cls, "is_registered", False)},
        "properties": {
            (owner, name)
            for owner in OWNERS
            for name in getattr(bpy.types, owner).bl_rna.properties.keys()  # noqa: SIM118
        },
        # Blender's own, which nothing else lists.
        "menus": {f.__module__ for draw in draws for f in getattr(draw, "_draw_funcs", [draw])},
        "keymaps": {(config.name, keymap.name, len(keymap.keymap_items)) for config, keymap in keymaps},
    }


def difference(before, after):
    return {kind: before[kind] ^ after[kind] for kind in before if before[kind] != after[kind]}


def forget():
    """Forgets the extension's modules. Which of their functions and classes something holds all the same: a draw
    handler, a timer, a command, whatever Blender has no list of."""
    references = {}
    for name in [name for name in sys.modules if name.startswith(NAME)]:
        for value in vars(sys.modules.pop(name)).values():
            if isinstance(value, (types.FunctionType, type)) and value.__module__ == name:
                references[f"{name}.{value.__qualname__}"] = weakref.ref(value)
    del value
    vars(sys.modules["bl_ext.user_default"]).pop("virtual_shutter", None)
    # private: caches of `typing` keep the last types of a recipe's fields, which are not more with each time.
    for clear in typing._cleanups:
        clear()
    gc.collect()
    assert len(references) > 100
    return [name for name, reference in references.items() if reference() is not None]


def check():
    import addon_utils

    if NAME in sys.modules:  # Blender was started with it
        addon_utils.disable(NAME)
        forget()
    before = traces()
    for _ in range(2):
        assert addon_utils.enable(NAME)
        new = difference(before, traces())
        assert {"handlers", "types", "operators", "registered", "properties", "menus"} <= new.keys(), new.keys()
        addon_utils.disable(NAME)
        assert not difference(before, traces()), difference(before, traces())
        assert not (held := forget()), held
    print("NOTHING LEFT")


if __name__ == "__main__":
    check()
