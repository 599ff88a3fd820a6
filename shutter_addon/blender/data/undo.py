"""Keys that handlers change, so that undo brings them back as they were."""

import bpy


def renew_action(scene) -> None:
    """Puts a copy of the action that holds a scene's keys in its place, for a handler to change.

    Handlers come after the undo push of the user's step. Undo keeps data that is equal in both steps as it is now,
    whatever a handler did to it since; the copy is in neither of them, and the action comes back.
    """
    action = scene.animation_data and scene.animation_data.action
    if not action or action.library is not None:
        return
    name, copy = action.name, action.copy()
    action.user_remap(copy)
    copy.use_fake_user = action.use_fake_user
    bpy.data.actions.remove(action)
    copy.name = name
