"""Copies of effect strips get an effect of their own.

Blender copies a Scene strip, or the whole edit, but not the scene that it shows: the copy would render the
original's effect, at the original's place in time. Parts of a cut strip have the same origin, and share.
"""

from typing import Any

import bpy

from ...core.model.limits import MAX_FRAME
from ..data import data_format, fcurves, strips, undo
from ..data.property_copy import copy_properties


def adopt() -> None:
    """Gives every effect strip that is a copy a scene, an effect and keys of its own; keys follow moved strips."""
    taken = set()
    for scene in strips.local_scenes():
        for effect_scene, parts in _groups(scene).items():
            effect = strips.effect_of(scene, effect_scene)
            if effect is None:  # Blender copied the scene with its strip, or the strip is pasted from another scene
                if (original := _original(scene, effect_scene)) is not None:
                    for origin, same in parts.items():
                        own = _copied(effect_scene) if strips.effect_of(original[0], effect_scene) else effect_scene
                        _duplicate(*original, scene, same, origin, own)
                        taken.add(own)
            else:
                if effect_scene in taken:  # the scene is a copy, its effects' data copied with it
                    effect.scene = _copied(effect_scene)
                    for strip in (strip for same in parts.values() for strip in same):
                        strip.scene = effect.scene
                _settle(scene, effect, parts)
                taken.add(effect_scene)


def _groups(scene) -> dict:
    """Effect strips by scene, then by origin."""
    groups: dict = {}
    for strip in strips.effect_strips(scene):
        groups.setdefault(strip.scene, {}).setdefault(strips.origin(strip), []).append(strip)
    return groups


def _original(scene, effect_scene) -> tuple[Any, str] | None:
    """Scene and path of the effect that a copied effect scene was made for; those of its own scene first."""
    for other in sorted(bpy.data.scenes, key=lambda other: other != scene):
        for effect in other.virtual_shutter.effects:
            if effect.scene and effect.scene.virtual_shutter.identity == effect_scene.virtual_shutter.identity:
                return other, effect.path_from_id()
    return None


def _settle(scene, effect, parts: dict) -> None:
    """Moves the effect's keys to its strips, and gives strips of other origins a copy of it."""
    path, effect_scene = effect.path_from_id(), effect.scene
    start = effect.start if effect.start in parts else min(parts)
    if not abs(effect.start) <= 2 * MAX_FRAME:  # no frame: its keys are where they are
        effect.start = start
    _move_drawings(effect)
    if start != effect.start:
        _move(scene, effect, path, start - effect.start)
    for origin in sorted(parts.keys() - {start}):  # after the first no effect is where it was
        _duplicate(scene, path, scene, parts[origin], origin, _copied(effect_scene))


def _duplicate(old_scene, path: str, scene, parts, origin: float, effect_scene) -> None:
    """A copy of the effect at `path`, for these strips and their scene."""
    new = data_format.new_effect(scene, old_scene.virtual_shutter.format)
    old = old_scene.path_resolve(path)  # adding to a collection moves its items in memory
    copy_properties(old, new)
    new.scene = effect_scene
    if effect_scene.annotation is not None and effect_scene.annotation == old.scene.annotation:
        effect_scene.annotation = effect_scene.annotation.copy()
    for strip in parts:
        strip.scene = effect_scene
    new_path = new.path_from_id()
    undo.renew_action(scene)
    fcurves.copy_curves(old_scene, path + ".", scene, new_path + ".")
    _move(scene, new, new_path, origin - old.start)


def _move(scene, effect, path: str, frames: float) -> None:
    undo.renew_action(scene)
    fcurves.move_curves(scene, path + ".", frames)
    effect.start += frames
    _move_drawings(effect)


def _move_drawings(effect) -> None:
    """Drawings follow the effect's start, by that which the annotation says they are for: undo may bring the effect's
    back and leave the annotation, which a handler moved, as it is."""
    annotation = effect.scene.annotation
    if annotation is None or annotation.library is not None:
        return
    frames = effect.start - annotation.virtual_shutter_start
    if not (annotation.is_property_set("virtual_shutter_start") and abs(frames) <= 4 * MAX_FRAME):  # or it is no frame
        annotation.virtual_shutter_start = effect.start
    elif frames:
        for drawing in [drawing for layer in annotation.layers for drawing in layer.frames]:
            drawing.frame_number += round(frames)
        annotation.virtual_shutter_start = effect.start


def _copied(scene):
    copy = scene.copy()
    if scene.annotation is not None:
        copy.annotation = scene.annotation.copy()
    return copy
