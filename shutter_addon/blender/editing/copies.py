"""Copies of effect strips get an effect of their own.

Blender copies a Scene strip, or the whole edit, but not the scene that it shows: the copy would render the
original's effect, at the original's place in time. Parts of a cut strip have the same origin, and share.
"""

import bpy

from ...core.model.limits import MAX_FRAME
from ..data import fcurves, strips
from ..data.property_copy import copy_properties


def adopt() -> None:
    """Gives every effect strip that is a copy a scene, an effect and keys of its own; keys follow moved strips."""
    taken = set()
    for edit in [scene for scene in bpy.data.scenes if scene.library is None]:  # linked ones cannot be changed
        for scene, parts in _groups(edit).items():
            effect = strips.effect_of(edit, scene)
            if effect is None:  # Blender copied the scene with its strip, or the strip is pasted from another edit
                if (original := _original(edit, scene)) is not None:
                    for origin, same in parts.items():
                        own = _copied(scene) if strips.effect_of(original[0], scene) else scene
                        _duplicate(*original, edit, same, origin, own)
                        taken.add(own)
            else:
                if scene in taken:  # the edit is a copy, its effects' data copied with it
                    effect.scene = _copied(scene)
                    for strip in (strip for same in parts.values() for strip in same):
                        strip.scene = effect.scene
                _settle(edit, effect, parts)
                taken.add(scene)


def _groups(edit) -> dict:
    """Effect strips by scene, then by origin."""
    groups: dict = {}
    for strip in strips.effect_strips(edit):
        groups.setdefault(strip.scene, {}).setdefault(strips.origin(strip), []).append(strip)
    return groups


def _original(edit, scene):
    """Edit and path of the effect that a copied scene was made for; its own edit's first."""
    for other in sorted(bpy.data.scenes, key=lambda other: other != edit):
        for effect in other.virtual_shutter.effects:
            if effect.scene and effect.scene.virtual_shutter.identity == scene.virtual_shutter.identity:
                return other, effect.path_from_id()
    return None


def _settle(edit, effect, parts: dict) -> None:
    """Moves the effect's keys to its strips, and gives strips of other origins a copy of it."""
    path, scene = effect.path_from_id(), effect.scene
    start = effect.start if effect.start in parts else min(parts)
    if not abs(effect.start) <= 2 * MAX_FRAME:  # no frame: its keys are where they are
        effect.start = start
    if start != effect.start:
        _move(edit, effect, path, start - effect.start)
    for origin in sorted(parts.keys() - {start}):
        _duplicate(edit, path, edit, parts[origin], origin, _copied(scene))  # no effect is where it was after that


def _duplicate(old_edit, path: str, edit, parts, origin: float, scene) -> None:
    """A copy of the effect at `path`, for these strips and their scene."""
    new = edit.virtual_shutter.effects.add()
    old = old_edit.path_resolve(path)  # adding to a collection moves its items in memory
    copy_properties(old, new)
    new.scene = scene
    if scene.annotation is not None and scene.annotation == old.scene.annotation:
        scene.annotation = scene.annotation.copy()
    for strip in parts:
        strip.scene = scene
    new_path = new.path_from_id()
    fcurves.copy_curves(old_edit, path + ".", edit, new_path + ".")
    _move(edit, new, new_path, origin - old.start)


def _move(edit, effect, path: str, frames: float) -> None:
    fcurves.move_curves(edit, path + ".", frames)
    for layer in effect.scene.annotation.layers if effect.scene.annotation else ():
        for drawing in layer.frames:
            drawing.frame_number += round(frames)
    effect.start += frames


def _copied(scene):
    copy = scene.copy()
    if scene.annotation is not None:
        copy.annotation = scene.annotation.copy()
    return copy
