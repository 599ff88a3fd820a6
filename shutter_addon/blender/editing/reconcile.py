"""Make effects, scenes and annotations fit the strips again: after deleting, pasting, cutting, moving, copying, undo.

Afterwards these hold, and a second call changes nothing:

- Each effect strip shows its own effect scene, whose effect is in its scene, and each effect has a strip. Blender
  copies or cuts a Scene strip without its scene, so that the copy would show the original's effect.
- An effect scene has a camera, the settings that the sequencer needs, its own annotation, and a unique identity, which
  its strip and effect share. Nothing is left of removed ones.
- Edits share no action, and effects of different strips share no source. Only sources that an effect muted are muted.
- Keyframes and drawings keep their place in their strip, and regions have the names of their drawings.
- An effect scene has its edit's frame rate and its source's size.
"""

from __future__ import annotations

import uuid
from contextlib import suppress
from functools import lru_cache
from itertools import product

import bpy
import numpy as np
from bpy.types import PropertyGroup, Scene, Strip, bpy_struct

from ...core.model.limits import MAX_FRAME
from ...media import MediaError, open_source
from ..data import data_format, fcurves, requirements, sole_effect, source_media, strips
from ..data.annotations import LAYERS, USERS, picture_size
from ..data.property_copy import copy_properties
from ..rendering import invalidation, render_job, sessions
from . import add_effect, match_source, shown_annotations, undelete

# Settings that an effect scene copies from its edit. Blender crashes if a stereo scene shows one that is not.
_OF_EDIT = "fps", "fps_base", "use_multiview"


def update(updated: Scene | None = None) -> None:
    """Adapt effects to their strips after a change of the edit, and drop cached frames of changed effects.

    For example, a copied strip gets an effect of its own, and a moved one takes its keyframes along (see this module).
    Do nothing while a render job runs. If a newer version of the extension saved the file, only drop frames.

    Args:
        updated: Scene whose depsgraph is being updated, which must not be removed now; None: no scene is.
    """
    if bpy.app.is_job_running("RENDER"):
        return
    if not data_format.is_file_newer():
        shown = tidy(updated)
        if not render_job.runs():  # the size stays during a render
            follow_sources(shown)
    for scene in strips.local_scenes():
        invalidation.invalidate_changed(scene)


def tidy(updated: Scene | None = None) -> list[strips.ShownEffect]:
    """Adapt effects to their strips, as `update` does, but read no footage (follow_sources) and drop no cached frames.

    Args:
        updated: Scene whose depsgraph is being updated, which must not be removed now; None: no scene is.

    Returns:
        The effects that strips show afterwards, each with its strip and source.
    """
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


def gather() -> list[strips.ShownEffect]:
    """Return all effects that strips show in local scenes (not linked from other files), each with strip and source."""
    return [each for scene in strips.local_scenes() for each in strips.shown_effects(scene)]


def forget() -> None:
    """Forget the open file's footage, annotations in previews and copied effect, before another file is loaded."""
    _header.cache_clear()
    shown_annotations.forget()
    undelete.forget_copy()


def find_lost() -> None:
    """Restore the pointers to effect scenes and actions that undo has broken.

    Undo reads a changed scene into new memory. This may be where data lay that the undone step removed: an effect
    scene, or an action (_renew_action). Pointers to that data then point to the scene itself instead, or are empty.
    """
    scenes = strips.local_scenes()
    for scene in scenes:
        _find_action(scene)
    _find_scenes(scenes)


def _find_action(scene: Scene) -> None:
    """Restore a scene's lost pointer to its action: to an action that nothing uses and that has the scene's slot.

    The scene stores the handle (a number) of its slot. It stores none if the user removed the action; then do nothing.
    """
    animation = scene.animation_data
    if animation is None or animation.action is not None or not animation.action_slot_handle:
        return
    for action in bpy.data.actions:
        slots = [slot for slot in action.slots if slot.handle == animation.action_slot_handle]
        if slots and action.users == action.use_fake_user:  # nothing else uses it
            animation.action, animation.action_slot = action, slots[0]
            return


def _find_scenes(scenes: list[Scene]) -> None:
    """Restore pointers of effects and strips to their effect scene, by the identity that all three store."""
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
    """Restore what effect scenes need to be rendered: camera, engine and other settings (requirements.settings)."""
    for strip in [strip for scene in scenes for strip in strips.own_strips(scene)]:
        if strip.scene is not None and strip.scene.library is None:
            for owner, name, value in requirements.settings(strip):
                _give(owner, name, value)
            if requirements.camera(strip) is None:
                add_effect.add_camera(strip.scene)


def _give(owner: bpy_struct, name: str, value: object) -> None:
    """Set a property only if its value differs, because Blender counts any assignment as a change."""
    if getattr(owner, name) != value:
        setattr(owner, name, value)


def _bring_back(scenes: list[Scene]) -> None:
    """Restore the effects of pasted strips. Blender's clipboard has Scene strips without the scenes that they show."""
    lost = [strip for scene in scenes for strip in strips.own_strips(scene) if strip.scene is None]
    if lost:
        _remove_left()  # remains of their removed scenes
    for strip in lost:
        if strip.scene is None and undelete.restore(strip.id_data, strip.virtual_shutter_effect):
            _find_scenes(scenes)  # other strips may show the same


def _oldest_first(scenes: list[Scene]) -> list[Scene]:
    """Return the scenes sorted by age (session_uid), so that a copied scene comes after its original.

    Where both share something, callers leave it to the first and change the copy. The original must stay unchanged,
    because undo assumes that a scene which the user's last step did not change is unchanged.
    """
    return sorted(scenes, key=lambda scene: scene.session_uid)


def _separate(scenes: list[Scene]) -> None:
    """Give copied scenes with effects an action (F-curves) of their own. Blender lets a copy share the original's."""
    taken = set()
    for animation in [scene.animation_data for scene in scenes if scene.virtual_shutter.effects]:
        if animation and animation.action:
            if (animation.action, animation.action_slot_handle) in taken:
                animation.action = animation.action.copy()
            taken.add((animation.action, animation.action_slot_handle))


def _adopt(scenes: list[Scene]) -> None:
    """Give strips that were copied, cut or pasted their own effect scene and effect, in place of the original's."""
    taken = set()
    for scene in scenes:
        for strip in sorted(strips.effect_strips(scene), key=_place):
            own, effect = strip.scene, strips.effect_of(scene, strip.scene)
            # Without an effect, the scene was copied with its strip, or the strip is pasted from another scene.
            original = effect or _original(scene, own)
            if original is None or own == scene:  # Blender lets nobody change what a scene shows of itself
                continue
            if own in taken or (effect is None and strips.effect_of(original.id_data, own)):
                own = own.copy()
            if effect is None or own != strip.scene:
                _duplicate(original, strip, own)
            taken.add(own)


def _place(strip: Strip) -> tuple[bool, int, int]:
    """Return a sort key for strips that show the same effect. The first strip keeps it, and the others get copies.

    First is the strip whose content begins where the effect does, otherwise the first on the timeline.

    Returns:
        Whether the content begins elsewhere or the scene lacks the effect; the left handle; the channel.
    """
    effect = strips.effect_of(strip.id_data, strip.scene)
    return effect is None or strips.origin(strip) != effect.start, strip.left_handle, strip.channel


def _original(scene: Scene, effect_scene: Scene) -> PropertyGroup | None:
    """Return the effect whose effect scene was copied. Look in `scene` first, then in other scenes.

    Args:
        scene: The scene with the strip that shows the copy.
        effect_scene: The copy. It still has the original's identity.

    Returns:
        None if no scene has such an effect.
    """
    identity = effect_scene.virtual_shutter.identity
    scenes = sorted(bpy.data.scenes, key=lambda other: other != scene)
    effects = (effect for other in scenes for effect in other.virtual_shutter.effects if effect.scene)
    return next((effect for effect in effects if effect.identity == identity != ""), None)


def _duplicate(effect: PropertyGroup, strip: Strip, effect_scene: Scene) -> None:
    """Give a strip a copy of an effect, and make the copy and the strip use `effect_scene`."""
    scene, old_scene, path = strip.id_data, effect.id_data, effect.path_from_id()
    new = data_format.new_effect(scene, old_scene.virtual_shutter.format)
    old = old_scene.path_resolve(path)  # looked up again, because adding to a collection moves its items
    copy_properties(old, new)
    new.scene = effect_scene
    strip.scene = effect_scene
    _renew_action(scene)
    fcurves.copy_curves(old_scene, path + ".", scene, new.path_from_id() + ".")


def _remove_effects(scene: Scene) -> None:
    """Remove effects of a scene that none of its strips shows any more. Keep their data for undelete.restore."""
    group, shown = scene.virtual_shutter, {strip.scene for strip in strips.effect_strips(scene)}
    gone = [i for i, effect in enumerate(group.effects) if effect.scene not in shown]
    if gone:
        _renew_action(scene)
    for i in reversed(gone):
        undelete.keep(group.effects[i])
        fcurves.remove_item(group, "effects", i)


def _renew_action(scene: Scene) -> None:
    """Replace a scene's action by a copy before a handler of ours changes its F-curves, so that undo restores them.

    Handlers run after Blender has stored the user's step for undo. If an action is equal before and after that step,
    undo leaves it as it is now, with the handler's changes. A copy is in neither state, so undo has to restore the
    action. Do nothing if there is no action, or a linked one.
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
    """Return the scenes that were made for effects and can be changed."""
    made = [scene for scene in strips.local_scenes() if scene.virtual_shutter.identity]
    return [scene for scene in made if scene.render.engine == strips.ENGINE]


def _effect_strips() -> list[Strip]:
    return [strip for scene in strips.local_scenes() for strip in strips.effect_strips(scene)]


def _identify(shown: list[strips.ShownEffect]) -> None:
    """Give each effect scene a unique identity, which its strip and effect get, too, and an annotation of its own."""
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
    for strip in _effect_strips():
        _give(strip, "virtual_shutter_effect", strip.scene.virtual_shutter.identity)
    for effect, _strip, _source in shown:
        _give(effect, "identity", effect.scene.virtual_shutter.identity)


def _follow_strips(shown: list[strips.ShownEffect]) -> None:
    """Move keyframes and drawings of effects along with strips that were moved in time."""
    for effect, strip, _source in shown:
        start = strips.origin(strip)
        if not abs(effect.start) <= 2 * MAX_FRAME:  # not a valid frame: leave the keyframes
            effect.start = start
        _move_drawings(effect, start)
        if start != effect.start:
            _renew_action(strip.id_data)
            fcurves.move_curves(strip.id_data, effect.path_from_id() + ".", start - effect.start)
            effect.start = start


def _move_drawings(effect: PropertyGroup, start: float) -> None:
    """Move an effect's drawings in time by as many frames as the start of its strip's content has moved.

    The annotation stores the start that its drawings fit. The effect's own start counts only if the annotation has no
    valid one: undo may restore the effect, but leave the annotation as a handler has moved it.

    Args:
        start: Timeline frame where the content of the effect's strip now begins (strips.origin).
    """
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


def _part_sources(shown: list[strips.ShownEffect]) -> None:
    """Give source strips new identities where effects use different strips with the same identity.

    Copies and cut parts of a strip share its identity. The first strip that is found keeps it. Effects of the others
    get the new identity, too.
    """
    first: dict[tuple[Scene, str], Strip] = {}
    for effect, strip, source in shown:
        if source and first.setdefault((strip.id_data, effect.source), source) != source:
            add_effect.own_source(source, shown)


def _unmute_sources(scenes: list[Scene], shown: list[strips.ShownEffect]) -> None:
    """Unmute sources that were muted for an effect, which no effect strip uses and no baked strip covers any more."""
    sources = {each.source for each in shown}
    for strip in [strip for scene in scenes for strip in strips.all_strips(scene) if strip.virtual_shutter_muted]:
        if strip not in sources and not _is_baked_over(strip):
            strip.mute = strip.virtual_shutter_muted = False


def _is_baked_over(source: Strip) -> bool:
    """Tell whether a baked (rendered) effect covers a source: a strip above that is connected and overlaps in time.

    Such a source stays muted, because it would show through transparent parts of the baked strip.
    """
    baked = (s for s in source.connections if s.type in strips.SOURCES and s.channel > source.channel)
    return any(s.virtual_shutter_bake.identity and strips.overlap(s, source) for s in baked)


def _follow_names(shown: list[strips.ShownEffect]) -> None:
    """Enter the new name of a renamed annotation layer in the regions that use it, then store the layers' names.

    An effect stores the names of its annotation's layers as of the last call. A layer counts as renamed if there are as
    many names as before and exactly one differs. They are stored in the effect, and not in the annotation, so that undo
    restores them together with the regions.
    """
    for effect, _strip, _source in shown:
        annotation = effect.scene.annotation
        if annotation is None or annotation.library is not None:
            continue
        before, names = effect.layer_names.splitlines(), [layer.info for layer in annotation.layers]
        changed = [(old, new) for old, new in zip(before, names, strict=False) if old != new]
        if len(before) == len(names) and len(changed) == 1:
            old, new = changed[0]
            for region, name in product(effect.regions, LAYERS):
                if getattr(region, name) == old:
                    setattr(region, name, new)
        _give(effect, "layer_names", "\n".join(names))


def _remove_scenes(updated: Scene | None) -> None:
    """Remove effect scenes that neither a strip nor a window shows.

    Args:
        updated: Scene whose depsgraph is being updated, which must not be removed now.
    """
    stay = {strip.scene for strip in _effect_strips()} | {updated}
    for window in [window for manager in bpy.data.window_managers for window in manager.windows]:
        stay.update((window.scene, window.workspace.sequencer_scene))
    for scene in _effect_scenes():
        if scene not in stay:
            bpy.data.scenes.remove(scene)
            sessions.drop_removed()


def _remove_left() -> None:
    """Remove cameras that no effect scene uses, and annotations of removed effects, if they were made for effects.

    Those that something else uses are marked as the user's own instead, as are annotations that an existing effect no
    longer uses.
    """
    scenes = _effect_scenes()
    used = {scene.annotation for scene in scenes} | {scene.camera.data for scene in scenes if scene.camera}
    identities = {scene.virtual_shutter.identity for scene in bpy.data.scenes}
    for made in (*bpy.data.annotations, *bpy.data.cameras):
        if made.library is not None or made in used or not shown_annotations.is_own(made):
            continue
        # Copies of an effect scene share its camera, which may have the identity of a removed original.
        if made.virtual_shutter_made not in identities or isinstance(made, bpy.types.Camera):
            shown_annotations.let_go(made)
            bpy.data.batch_remove([each for each in bpy.data.objects if each.data == made and not each.users])
            if not made.users:
                bpy.data.batch_remove([made])
                continue
        made.virtual_shutter_made = USERS


def follow_sources(shown: list[strips.ShownEffect]) -> None:
    """Give effect scenes the edit's frame rate and stereo setting, and the size of the source's footage.

    If the size changes, strokes stay in place on the picture. Also set a factor in the colors of an effect strip, so
    that where Blender scales or turns the strip, it blends display values or light as it does for the source. Footage
    that cannot be read changes neither size nor factor.

    Args:
        shown: The effects with their strips and sources.
    """
    for strip in _effect_strips():
        if strip.scene.library is None:
            for name in _OF_EDIT:
                _give(strip.scene.render, name, getattr(strip.id_data.render, name))
    for effect, strip, source in shown:
        if strip.scene.library is not None:
            continue
        with suppress(MediaError):
            header = _header(source_media.spec(source)) if source else None
            if header is not None:
                if header[0] != picture_size(effect):
                    with match_source.scribbles_kept(effect, strip):
                        effect.scene.render.resolution_x, effect.scene.render.resolution_y = header[0]
                _follow_mixing(strip, source, is_encoded=header[1])


def _follow_mixing(strip: Strip, source: Strip, *, is_encoded: bool) -> None:
    if strip.color_multiply not in (1, strips.IN_CODE_VALUES):
        return
    scene, path = strip.id_data, strip.path_from_id()
    stays = sole_effect.has_values(strip.transform, sole_effect.IN_PLACE)
    stays = stays and not sole_effect.has_animation(scene, f"{path}.transform.")
    mixes = not stays or strip.transform.filter.startswith("CUBIC")
    same_space = source_media.reading(source)[0] == scene.sequencer_colorspace_settings.name
    factor = strips.IN_CODE_VALUES if mixes and is_encoded and same_space else 1
    if strip.color_multiply != factor and not sole_effect.has_animation(scene, f"{path}.color_multiply"):
        strip.color_multiply = factor


@lru_cache(256)
def _header(spec: source_media.SourceSpec) -> tuple[tuple[int, int], bool] | None:
    """Open footage, and return what effect scenes need to know of it. The result is cached.

    Returns:
        (width, height) in pixels, each limited to what a Blender scene can have; and whether Blender, where it scales
        or turns the footage, blends display values (movies, 8-bit pictures) instead of light. None: the footage cannot
        be read.
    """
    with suppress(MediaError):
        medium = open_source(spec.path, files=spec.files, **spec.options | {"colorspace": None})
        medium.close()
        side = bpy.types.RenderSettings.bl_rna.properties["resolution_x"]
        width, height = (min(max(n, side.hard_min), side.hard_max) for n in (medium.width, medium.height))
        return (width, height), spec.files is None or medium.dtype == np.uint8
    return None
