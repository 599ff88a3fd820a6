"""Which of a file's data the pictures of an edit are made of: scenes, objects, materials, images and all others."""

from collections.abc import Iterator

import bpy

from . import requirements


def used(scene, frames: range) -> set[bpy.types.ID]:
    """The scene, those in its Scene strips, what the strips name that are shown at these frames, and whatever that uses
    in turn. What scenes hold beside their strips is in no picture."""
    shown = requirements.scenes_at(scene, frames)
    uses: dict = {}
    for item, users in bpy.data.user_map().items():
        for user in users:
            uses.setdefault(user, []).append(item)
    items = set()
    new = [item for each, at in shown for item in _named(each, at)]
    while new:
        if (item := new.pop()) not in items:
            items.add(item)
            new += uses.get(item, ())
    return items.union(each for each, _ in shown)


def _named(scene, frames: range) -> Iterator[bpy.types.ID]:
    for strip in scene.sequence_editor.strips_all:
        if not requirements.is_shown(scene, strip, frames):
            continue
        for owner in (strip, *strip.modifiers):
            for setting in owner.bl_rna.properties:
                value = getattr(owner, setting.identifier) if setting.type == "POINTER" else None
                is_edit = isinstance(value, bpy.types.Scene) and strip.scene_input == "SEQUENCER"
                if isinstance(value, bpy.types.ID) and not is_edit:
                    yield value
