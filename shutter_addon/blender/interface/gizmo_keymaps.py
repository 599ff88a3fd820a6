"""Keymaps of gizmo groups, made and removed: Blender leaves them behind. The keys are in each group's setup_keymap."""

import bpy

_made: set[str] = set()  # of which groups


def new(group, keyconfig):
    """A keymap for a gizmo group, in which Blender's own key for the pen is the pen's still."""
    _made.add(group.bl_idname)
    keymap = keyconfig.keymaps.new(group.bl_idname, space_type=group.bl_space_type, region_type="WINDOW")
    pen = keymap.keymap_items.new("gpencil.annotate", "LEFTMOUSE", "PRESS", key_modifier="D")
    pen.properties.mode, pen.properties.wait_for_input = "DRAW", False
    return keymap


def unregister():
    """Once the groups are gone."""
    keyconfigs = bpy.context.window_manager.keyconfigs
    for keyconfig in filter(None, (keyconfigs.default, keyconfigs.user)):
        for keymap in [keymap for keymap in keyconfig.keymaps if keymap.name in _made]:
            keyconfig.keymaps.remove(keymap)
