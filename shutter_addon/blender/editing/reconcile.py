"""Brings scenes, effects and annotations in line with the strips that there are, however these came and went: deleted,
pasted, cut, moved, copied with their edit, brought back by undo. What holds then, and a second call changes nothing:

- Each effect strip shows an effect scene of its own, whose effect its scene has, and each effect has a strip. Blender
  copies or cuts a Scene strip, but not the scene that it shows: the copy would show the original's effect.
- An effect scene has a camera, and the settings without which the sequencer leaves it out; an annotation of its own; an
  identity that no other has, which is its strip's and its effect's too. Of those that are gone nothing is left.
- Edits share no action, and effects that show different strips no source. What an effect muted is its source.
- Keys and drawings lie where they did within their strip, and regions have the names of their drawings.
- An effect scene has its edit's rate and its source's size.
"""

from __future__ import annotations

import uuid
from contextlib import suppress
from functools import lru_cache

import bpy
import numpy as np
from bpy.types import PropertyGroup, Scene, Strip, bpy_struct

from ...core.model.limits import MAX_FRAME
from ...media import MediaError, open_source
from ..data import data_format, fcurves, requirements, seen_alone, source_media, strips
from ..data.annotations import LAYERS, USERS, picture_size
from ..data.property_copy import copy_properties
from ..rendering import invalidation, render_job, sessions
from . import add_effect, match_source, shown_annotations, undelete

# What an effect scene has as its edit; Blender crashes where one in stereo shows a scene that is not.
_OF_EDIT = "fps", "fps_base", "use_multiview"
_names: dict[int, list[str]] = {}  # of layers, by session_uid of their annotation, as they were at the last update


def update(updated: Scene | None = None) -> None:
    """Has everything follow a change of the edit. What a newer version has saved is left to it.

    updated: the scene whose depsgraph is being updated, which must not go now."""
    if bpy.app.is_job_running("RENDER"):
        return
    if not data_format.is_file_newer():
        shown = tidy(updated)
        if not render_job.runs():  # a film keeps its size
            follow_sources(shown)
    for scene in strips.local_scenes():
        invalidation.invalidate_changed(scene)


def tidy(updated: Scene | None = None) -> list[strips.Shown]:
    """Does all but follow_sources, which reads media. Returns what is shown then."""
    scenes = _oldest_first(strips.local_scenes())
    _find_scenes(scenes)
    _mend(scenes)
    _bring_back(scenes)
    _separate(scenes)
    _adopt(scenes)
    for scene in scenes:
        _remove_effects(scene)
    shown = gather()
    _identify(shown)
    _follow_strips(shown)
    _part_sources(shown)
    _unmute_sources(scenes, shown)
    _follow_names(shown)
    _remove_scenes(updated)
    _remove_left()
    return shown


def gather() -> list[strips.Shown]:
    """All that scenes which can be changed show of effects."""
    return [each for scene in strips.local_scenes() for each in strips.shown_effects(scene)]


def forget() -> None:
    """Forgets what the annotations and the media of a file were, before another one is loaded."""
    _names.clear()
    _header.cache_clear()
    shown_annotations.forget()
    undelete.forget_copy()


def find_lost() -> None:
    """Finds again what Blender's undo loses. A scene that was changed is read into new memory, and what points there is
    taken for pointing to the scene itself. This memory may be that of data which the undone step had removed: of effect
    scenes, and of actions (_renew_action)."""
    scenes = strips.local_scenes()
    for scene in scenes:
        _find_action(scene)
    _find_scenes(scenes)


def _find_action(scene: Scene) -> None:
    """Whoever takes an action away by hand leaves no handle of a slot."""
    animation = scene.animation_data
    if animation is None or animation.action is not None or not animation.action_slot_handle:
        return
    for action in bpy.data.actions:
        slots = [slot for slot in action.slots if slot.handle == animation.action_slot_handle]
        if slots and action.users == action.use_fake_user:  # nothing else has it
            animation.action, animation.action_slot = action, slots[0]
            return


def _find_scenes(scenes: list[Scene]) -> None:
    """Effects and strips that lost their effect scene, or were pasted without, get it by its identity."""
    known = {scene.virtual_shutter.identity: scene for scene in reversed(_oldest_first(_effect_scenes()))}
    for scene in scenes:
        for effect in scene.virtual_shutter.effects:
            if effect.scene is None or effect.scene.virtual_shutter.identity != effect.identity:
                _give(effect, "scene", known.get(effect.identity, effect.scene))
        for strip in strips.all_strips(scene):
            found = known.get(strip.virtual_shutter_effect) if strip.type == "SCENE" else None
            if found not in (None, scene) and strip.scene in (None, scene):
                strip.scene = found


def _mend(scenes: list[Scene]) -> None:
    """Undoes what would leave effects out of the picture: their camera deleted, another engine, and the like."""
    for strip in [strip for scene in scenes for strip in strips.own_strips(scene)]:
        if strip.scene is not None and strip.scene.library is None:
            for owner, name, value in requirements.settings(strip):
                _give(owner, name, value)
            if requirements.camera(strip) is None:
                add_effect.add_camera(strip.scene)


def _give(owner: bpy_struct, name: str, value: object) -> None:
    """Gives a property a value that it has not: Blender takes whatever is set for a change."""
    if getattr(owner, name) != value:
        setattr(owner, name, value)


def _bring_back(scenes: list[Scene]) -> None:
    """Pasted effect strips get their effects again: Blender's clipboard holds strips, but not the scenes they show."""
    lost = [strip for scene in scenes for strip in strips.own_strips(scene) if strip.scene is None]
    if lost:
        _remove_left()  # of their scenes, which somebody removed
    for strip in lost:
        if strip.scene is None and undelete.restore(strip.id_data, strip.virtual_shutter_effect):
            _find_scenes(scenes)  # others have the same


def _oldest_first(scenes: list[Scene]) -> list[Scene]:
    """Copies come after what they were made of, so that this stays what it is: undo takes a scene for unchanged that
    the last step did not change."""
    return sorted(scenes, key=lambda scene: scene.session_uid)


def _separate(scenes: list[Scene]) -> None:
    """A copied edit gets keys of its own: Blender lets both share their action."""
    taken = set()
    for animation in [scene.animation_data for scene in scenes if scene.virtual_shutter.effects]:
        if animation and animation.action:
            if (animation.action, animation.action_slot_handle) in taken:
                animation.action = animation.action.copy()
            taken.add((animation.action, animation.action_slot_handle))


def _adopt(scenes: list[Scene]) -> None:
    """Effect strips that are copies, parts of cut ones or pasted from another scene get a scene and an effect."""
    taken = set()
    for scene in scenes:
        for strip in sorted(strips.effect_strips(scene), key=_place):
            own, effect = strip.scene, strips.effect_of(scene, strip.scene)
            # Without an effect, Blender copied the scene with its strip, or the strip is pasted from another scene.
            original = effect or _original(scene, own)
            if original is None or own == scene:  # what a scene shows of itself Blender allows nobody to change
                continue
            if own in taken or (effect is None and strips.effect_of(original.id_data, own)):
                own = own.copy()
            if effect is None or own != strip.scene:
                _duplicate(original, strip, own)
            taken.add(own)


def _place(strip: Strip) -> tuple[bool, int, int]:
    """Of strips with the same effect, the first of those that begin where its keys are comes first, and keeps it."""
    effect = strips.effect_of(strip.id_data, strip.scene)
    return effect is None or strips.origin(strip) != effect.start, strip.left_handle, strip.channel


def _original(scene: Scene, effect_scene: Scene) -> PropertyGroup | None:
    """The effect that a copied effect scene was made for; those of the scene itself first."""
    identity = effect_scene.virtual_shutter.identity
    scenes = sorted(bpy.data.scenes, key=lambda other: other != scene)
    effects = (effect for other in scenes for effect in other.virtual_shutter.effects if effect.scene)
    return next((effect for effect in effects if effect.identity == identity != ""), None)


def _duplicate(effect: PropertyGroup, strip: Strip, effect_scene: Scene) -> None:
    """Gives a strip and its scene a copy of an effect."""
    scene, old_scene, path = strip.id_data, effect.id_data, effect.path_from_id()
    new = data_format.new_effect(scene, old_scene.virtual_shutter.format)
    old = old_scene.path_resolve(path)  # adding to a collection moves its items in memory
    copy_properties(old, new)
    new.scene = effect_scene
    _shorten(strip, [other for other in strips.effect_strips(old_scene) if other.scene == old.scene])
    strip.scene = effect_scene
    _renew_action(scene)
    fcurves.copy_curves(old_scene, path + ".", scene, new.path_from_id() + ".")


def _shorten(strip: Strip, same: list[Strip]) -> None:
    """Blender's Add menu offers effect scenes: a strip of all their frames gets the length of the effect's own."""
    if strip.right_handle - strip.left_handle == MAX_FRAME:
        ends = [other.right_handle - strips.origin(other) for other in same if other != strip]
        strip.right_handle = strip.left_handle + round(min(ends, default=MAX_FRAME))


def _remove_effects(scene: Scene) -> None:
    """Removes the scene's effects that none of its strips shows any more."""
    group, shown = scene.virtual_shutter, {strip.scene for strip in strips.effect_strips(scene)}
    gone = [i for i, effect in enumerate(group.effects) if effect.scene not in shown]
    if gone:
        _renew_action(scene)
    for i in reversed(gone):
        undelete.keep(group.effects[i])
        fcurves.remove_item(group, "effects", i)


def _renew_action(scene: Scene) -> None:
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


def _effect_scenes() -> list[Scene]:
    """The scenes that were made for effects, and can be changed."""
    made = [scene for scene in strips.local_scenes() if scene.virtual_shutter.identity]
    return [scene for scene in made if scene.render.engine == strips.ENGINE]


def _identify(shown: list[strips.Shown]) -> None:
    """Every effect scene has an identity and an annotation of its own; its strip, its effect and that carry it."""
    identities, drawn = set(), set()
    for scene in _oldest_first(_effect_scenes()):
        group = scene.virtual_shutter
        if group.identity in identities:
            group.identity = uuid.uuid4().hex
        identities.add(group.identity)
        if scene.annotation is not None:
            if scene.annotation in drawn or scene.annotation.library is not None:
                scene.annotation = scene.annotation.copy()
            drawn.add(scene.annotation)
            if shown_annotations.is_own(scene.annotation):
                _give(scene.annotation, "virtual_shutter_made", group.identity)
    for strip in [strip for scene in strips.local_scenes() for strip in strips.effect_strips(scene)]:
        _give(strip, "virtual_shutter_effect", strip.scene.virtual_shutter.identity)
    for effect, _strip, _source in shown:
        _give(effect, "identity", effect.scene.virtual_shutter.identity)


def _follow_strips(shown: list[strips.Shown]) -> None:
    """Moves keys and drawings with their strips."""
    for effect, strip, _source in shown:
        start = strips.origin(strip)
        if not abs(effect.start) <= 2 * MAX_FRAME:  # no frame: its keys are where they are
            effect.start = start
        _move_drawings(effect, start)
        if start != effect.start:
            _renew_action(strip.id_data)
            fcurves.move_curves(strip.id_data, effect.path_from_id() + ".", start - effect.start)
            effect.start = start


def _move_drawings(effect: PropertyGroup, start: float) -> None:
    """Drawings go along to where an effect starts now, from that which the annotation says they are for: undo may bring
    the effect's back and leave the annotation, which a handler moved, as it is."""
    annotation = effect.scene.annotation
    if annotation is None or annotation.library is not None:
        return
    before = annotation.virtual_shutter_start
    is_known = annotation.is_property_set("virtual_shutter_start") and abs(start - before) <= 4 * MAX_FRAME
    if not is_known:
        before = effect.start
    if not is_known or before != start:
        for drawing in [drawing for layer in annotation.layers for drawing in layer.frames]:
            drawing.frame_number += round(start - before)
        annotation.virtual_shutter_start = start


def _part_sources(shown: list[strips.Shown]) -> None:
    """Where effects with the same source show different strips, parts of a cut source or copies, each gets its own."""
    first: dict[tuple[Scene, str], Strip] = {}
    for effect, strip, source in shown:
        if source and first.setdefault((strip.id_data, effect.source), source) != source:
            add_effect.own_source(source, shown)


def _unmute_sources(scenes: list[Scene], shown: list[strips.Shown]) -> None:
    """Sources that an effect muted show again once no effect strip shows them."""
    sources = {each.source for each in shown}
    for strip in [strip for scene in scenes for strip in strips.all_strips(scene) if strip.virtual_shutter_muted]:
        if strip not in sources and not _is_baked_over(strip):
            strip.mute = strip.virtual_shutter_muted = False


def _is_baked_over(source: Strip) -> bool:
    """Whether a film that was baked of a source lies above it: the source would be seen through transparent parts."""
    baked = (s for s in source.connections if s.type in strips.SOURCES and s.channel > source.channel)
    return any(s.virtual_shutter_bake.identity and strips.overlap(s, source) for s in baked)


def _follow_names(shown: list[strips.Shown]) -> None:
    """Gives regions the new names of their drawings, layers of the effect's annotation.

    Handlers come after the undo push of the user's step. Undoing the step after a rename brings back a region with
    the old name and an annotation that has the new one: so the annotation carries the names that its regions go by.
    Undoing the rename itself leaves the region as it is now: that the names before were others is told by memory.
    """
    before = dict(_names)
    _names.clear()  # of annotations that are gone
    for effect, _strip, _source in shown:
        annotation = effect.scene.annotation
        if annotation is None or annotation.library is not None:
            continue
        names = [layer.info for layer in annotation.layers]
        _rename(effect, annotation.virtual_shutter_names.splitlines(), names)
        _rename(effect, before.get(annotation.session_uid, names), names)
        _names[annotation.session_uid] = names
        _give(annotation, "virtual_shutter_names", "\n".join(names))


def _rename(effect: PropertyGroup, before: list[str], names: list[str]) -> None:
    """One name among the same number of drawings is another: it was renamed."""
    changed = [(old, new) for old, new in zip(before, names, strict=False) if old != new]
    if len(before) == len(names) and len(changed) == 1:
        for region in effect.regions:
            for name in LAYERS:
                if getattr(region, name) == changed[0][0]:
                    setattr(region, name, changed[0][1])


def _remove_scenes(updated: Scene | None) -> None:
    """Removes effect scenes that no strip and no window shows."""
    stay = {strip.scene for scene in strips.local_scenes() for strip in strips.effect_strips(scene)} | {updated}
    for window in [window for manager in bpy.data.window_managers for window in manager.windows]:
        stay.update((window.scene, window.workspace.sequencer_scene))
    for scene in _effect_scenes():
        if scene not in stay:
            bpy.data.scenes.remove(scene)
            sessions.drop_removed()


def _remove_left() -> None:
    """Removes the annotations and cameras that were made for effects which are gone. What is used elsewhere is the
    user's from then on, as is what an effect does not use, as a copy."""
    scenes = _effect_scenes()
    used = {scene.annotation for scene in scenes} | {scene.camera.data for scene in scenes if scene.camera}
    identities = {scene.virtual_shutter.identity for scene in bpy.data.scenes}
    for made in (*bpy.data.annotations, *bpy.data.cameras):
        if made.library is not None or made in used or not shown_annotations.is_own(made):
            continue
        # Copies of an effect scene share its camera, which may outlive that whose identity it has.
        if made.virtual_shutter_made not in identities or isinstance(made, bpy.types.Camera):
            shown_annotations.let_go(made)
            bpy.data.batch_remove([each for each in bpy.data.objects if each.data == made and not each.users])
            if not made.users:
                bpy.data.batch_remove([made])
                continue
        made.virtual_shutter_made = USERS


def follow_sources(shown: list[strips.Shown]) -> None:
    """Gives effect scenes the rate and views of the scene that shows them, and the size of their sources; has Blender
    mix the strips' pixels as their sources'."""
    for strip in [strip for scene in strips.local_scenes() for strip in strips.effect_strips(scene)]:
        if strip.scene.library is None:
            for name in _OF_EDIT:
                _give(strip.scene.render, name, getattr(strip.id_data.render, name))
    for effect, strip, source in shown:
        if strip.scene.library is not None:
            continue
        with suppress(MediaError):
            header = _header(source_media.spec(source)) if source else None
            if header is not None:
                _follow_size(effect, strip, header[0])
                _follow_mixing(strip, source, is_encoded=header[1])


def _follow_size(effect: PropertyGroup, strip: Strip, size: tuple[int, int]) -> None:
    if size != picture_size(effect):
        with match_source.scribbles_kept(effect, strip):
            effect.scene.render.resolution_x, effect.scene.render.resolution_y = size


def _follow_mixing(strip: Strip, source: Strip, *, is_encoded: bool) -> None:
    if strip.color_multiply not in (1, strips.IN_CODE_VALUES):
        return
    scene, path = strip.id_data, strip.path_from_id()
    mixes = (
        not seen_alone.has(strip.transform, seen_alone.IN_PLACE)
        or strip.transform.filter.startswith("CUBIC")
        or seen_alone.has_animation(scene, f"{path}.transform.")
    )
    same_space = source_media.reading(source)[0] == scene.sequencer_colorspace_settings.name
    factor = strips.IN_CODE_VALUES if mixes and is_encoded and same_space else 1
    if strip.color_multiply != factor and not seen_alone.has_animation(scene, f"{path}.color_multiply"):
        strip.color_multiply = factor


@lru_cache(256)
def _header(spec: source_media.SourceSpec) -> tuple[tuple[int, int], bool] | None:
    """Width and height of a medium's picture, as a scene can have them, and whether Blender keeps code values of it in
    place of light. None: it cannot be read, and is not tried again and again."""
    with suppress(MediaError):
        medium = open_source(spec.path, files=spec.files, **spec.options | {"colorspace": None})
        medium.close()
        side = bpy.types.RenderSettings.bl_rna.properties["resolution_x"]
        width, height = (min(max(n, side.hard_min), side.hard_max) for n in (medium.width, medium.height))
        return (width, height), spec.files is None or medium.dtype == np.uint8
    return None
