"""Every effect strip has an effect of its own.

Blender copies or cuts a Scene strip, or copies the whole edit, but not the scene that it shows: the copy, or the right
half, would show the original's effect, and be changed with it.
"""

import uuid
from typing import Any

import bpy

from ...core.model.limits import MAX_FRAME
from ..data import data_format, fcurves, strips, undo
from ..data.property_copy import copy_properties


def adopt() -> None:
    """Gives every effect strip that is a copy, or part of a cut one, a scene, an effect and keys of its own, and copied
    sources theirs; keys follow moved strips."""
    taken = set()
    for scene in strips.local_scenes():
        for effect_scene, same in _groups(scene).items():
            effect, own = strips.effect_of(scene, effect_scene), effect_scene
            if effect_scene == scene:  # which Blender allows nobody to change
                continue
            if effect is None:  # Blender copied the scene with its strip, or the strip is pasted from another scene
                if (original := _original(scene, effect_scene)) is None:
                    continue
                if strips.effect_of(original[0], effect_scene):
                    own = _copied(effect_scene)
                effect = _duplicate(*original, same[0], own)
            elif effect_scene in taken:  # the scene is a copy, its effects' data copied with it
                effect.scene = own = _copied(effect_scene)
            for strip in same:
                if strip.scene != own:
                    strip.scene = own
            _settle(scene, effect, same)
            taken.add(own)
        _part_sources(scene)


def _groups(scene) -> dict:
    """Effect strips by the scene that they show."""
    groups: dict = {}
    for strip in strips.effect_strips(scene):
        groups.setdefault(strip.scene, []).append(strip)
    return groups


def _original(scene, effect_scene) -> tuple[Any, str] | None:
    """Scene and path of the effect that a copied effect scene was made for; those of its own scene first."""
    for other in sorted(bpy.data.scenes, key=lambda other: other != scene):
        for effect in other.virtual_shutter.effects:
            if effect.scene and effect.scene.virtual_shutter.identity == effect_scene.virtual_shutter.identity:
                return other, effect.path_from_id()
    return None


def _settle(scene, effect, same: list) -> None:
    """Moves the effect's keys to its strip, the first of those that begin where they are, and gives the others a copy
    of it."""
    path, effect_scene = effect.path_from_id(), effect.scene
    keeper, *others = sorted(same, key=lambda s: (strips.origin(s) != effect.start, s.left_handle, s.channel))
    start = strips.origin(keeper)
    if not abs(effect.start) <= 2 * MAX_FRAME:  # no frame: its keys are where they are
        effect.start = start
    _move_drawings(effect)
    if start != effect.start:
        _move(scene, effect, path, start - effect.start)
    for strip in others:  # after the first no effect is where it was
        _duplicate(scene, path, strip, _copied(effect_scene))


def _duplicate(old_scene, path: str, strip, effect_scene):
    """A copy of the effect at `path`, for a strip and its scene."""
    scene = strip.id_data
    new = data_format.new_effect(scene, old_scene.virtual_shutter.format)
    old = old_scene.path_resolve(path)  # adding to a collection moves its items in memory
    copy_properties(old, new)
    new.scene = effect_scene
    _shorten(strip, [other for other in strips.effect_strips(old_scene) if other.scene == old.scene])
    if effect_scene.annotation is not None and effect_scene.annotation == old.scene.annotation:
        effect_scene.annotation = effect_scene.annotation.copy()
    strip.scene = effect_scene
    new_path = new.path_from_id()
    undo.renew_action(scene)
    fcurves.copy_curves(old_scene, path + ".", scene, new_path + ".")
    _move(scene, new, new_path, strips.origin(strip) - old.start)
    return new


def _shorten(strip, same: list) -> None:
    """Blender's Add menu offers effect scenes: a strip of all their frames gets the length of the effect's own."""
    if strip.right_handle - strip.left_handle == MAX_FRAME:
        ends = [other.right_handle - strips.origin(other) for other in same if other != strip]
        strip.right_handle = strip.left_handle + round(min(ends, default=MAX_FRAME))


def _part_sources(scene) -> None:
    """Where effects with the same source show different strips, parts of a cut source or copies, each gets its own."""
    first: dict = {}
    for effect, _strip, source in strips.with_sources(scene):
        if first.setdefault(effect.source, source) != source:
            own_source(scene, source)


def own_source(scene, source) -> None:
    """Gives a source an identity that no other strip has; the effects that show it go along."""
    identity = uuid.uuid4().hex
    for effect, _strip, other in strips.with_sources(scene):
        if other == source:
            effect.source = identity
    source.virtual_shutter_source = identity


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
