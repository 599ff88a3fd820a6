"""What Blender's undo loses of an edit is found again.

A scene that was changed is read into new memory, and what points there is taken for pointing to the scene itself. This
memory may be that of data which the undone step had removed: of effect scenes, and of actions (data.undo)."""

import bpy

from ..data import strips


def find_lost() -> None:
    """Gives each scene's action, and the scenes of its effects, where undo lost them."""
    for scene in strips.local_scenes():
        _find_action(scene)
        _find_effects(scene)


def _find_action(scene) -> None:
    """Whoever takes an action away by hand leaves no handle of a slot."""
    animation = scene.animation_data
    if animation is None or animation.action is not None or not animation.action_slot_handle:
        return
    for action in bpy.data.actions:
        slots = [slot for slot in action.slots if slot.handle == animation.action_slot_handle]
        if slots and action.users == action.use_fake_user:  # nothing else has it
            animation.action = action
            animation.action_slot = slots[0]
            return


def _find_effects(scene) -> None:
    own = {each.virtual_shutter.identity: each for each in bpy.data.scenes if each.render.engine == strips.ENGINE}
    for effect in scene.virtual_shutter.effects:
        shown = effect.scene
        if (shown is None or shown.virtual_shutter.identity != effect.identity) and effect.identity in own:
            effect.scene = own[effect.identity]
    for strip in scene.sequence_editor.strips_all if scene.sequence_editor else ():
        if strip.type == "SCENE" and strip.scene == scene and strip.virtual_shutter_effect in own:
            strip.scene = own[strip.virtual_shutter_effect]
