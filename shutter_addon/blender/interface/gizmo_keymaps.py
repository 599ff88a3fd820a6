"""Keymaps of gizmo groups, made and removed: Blender leaves them behind. The keys are in each group's setup_keymap."""

import bpy


def new(group, keyconfig):
    """An empty keymap for a gizmo group."""
    return keyconfig.keymaps.new(group.bl_idname, space_type=group.bl_space_type, region_type="WINDOW")


def remove(group) -> None:
    """Removes a gizmo group's keymap, once the group is gone."""
    keyconfigs = bpy.context.window_manager.keyconfigs
    for keyconfig in (keyconfigs.default, keyconfigs.user):
        if keyconfig is not None and (keymap := keyconfig.keymaps.get(group.bl_idname)) is not None:
            keyconfig.keymaps.remove(keymap)
