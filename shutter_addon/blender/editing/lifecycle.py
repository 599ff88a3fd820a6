"""Effects come and go with their strips, however strips are deleted, pasted or brought back by undo."""

import uuid

import bpy

from ..data import annotations, data_format, fcurves, requirements, strips, undo
from ..rendering import invalidation, render_job, sessions
from . import copies, match_source, renamed_drawings, shown_annotations, undelete
from .add_effect import add_camera

EFFECTS = "virtual_shutter.effects"
_OLDER_NAMES = "Shutter ", "Scribbles ", "Verschluss ", "Markierungen "  # of annotations made for effects


def update(updated=None) -> None:
    """Brings the effects of all scenes in line with their strips. A second call changes nothing. What a newer version
    has saved is left to it.

    updated: the scene whose depsgraph is being updated, which must not go now."""
    if bpy.app.is_job_running("RENDER"):
        return
    if not data_format.is_file_newer():
        _tidy(updated)
    for scene in strips.local_scenes():
        invalidation.invalidate_changed(scene)


def _tidy(updated) -> None:
    scenes = strips.local_scenes()
    for scene in scenes:
        _reconnect(scene)
    mend()
    _separate_actions(scenes)
    copies.adopt()
    for scene in scenes:
        _remove_effects(scene)
        _unmute_sources(scene)
    renamed_drawings.follow(scenes)
    _remove_scenes(updated)
    _identify()
    _remove_left()
    if not render_job.runs():  # a film keeps its size
        follow_sources()


def mend() -> None:
    """Undoes what would leave effects out of the picture: their camera deleted, another engine, and the like."""
    for scene in strips.local_scenes():
        for strip in strips.own_strips(scene):
            if strip.scene is not None and strip.scene.library is None:
                _mend(strip)


def _mend(strip) -> None:
    for owner, name, value in requirements.settings(strip):
        if getattr(owner, name) != value:
            setattr(owner, name, value)
    if requirements.camera(strip) is None:
        add_camera(strip.scene)


def take_over() -> None:
    """Marks in a file of an older version what was made for effects, and removes what is left of those that are gone:
    annotations of such a name that nothing but previews uses."""
    for scene in _effect_scenes():
        made = [scene.annotation]
        if scene.camera is not None and scene.camera.name == f"{scene.name} Camera":
            made.append(scene.camera.data)
        for each in made:
            if each is not None and each.library is None:
                each.virtual_shutter_made = scene.virtual_shutter.identity
    for annotation in _unmarked():
        if annotation.users == shown_annotations.shown_by(annotation) > 0:
            annotation.virtual_shutter_made = annotations.GONE
    _remove_left()


def leave_to_user() -> None:
    """Annotations of such a name that the user made stay where the file is opened again."""
    for annotation in _unmarked():
        annotation.virtual_shutter_made = annotations.USERS


def _unmarked() -> list:
    own = [each for each in bpy.data.annotations if each.library is None and not each.virtual_shutter_made]
    return [each for each in own if each.name.startswith(_OLDER_NAMES)]


def follow_sources() -> None:
    """Gives each effect scene the rate of the scene whose effect it shows, and its source's size."""
    for scene in strips.local_scenes():
        match_source.follow(scene)


def forget() -> None:
    """Forgets what the annotations and the media of a file were, before another one is loaded."""
    renamed_drawings.forget()
    match_source.forget()
    shown_annotations.forget()
    undelete.forget_copy()


def _reconnect(scene) -> None:
    """Gives pasted effect strips their scene again: Blender's clipboard holds strips, but not the scenes they show."""
    for strip in scene.sequence_editor.strips_all if scene.sequence_editor else ():
        if strip.type == "SCENE" and strip.scene is None and strip.virtual_shutter_effect:
            restored = _scene_of(strip.virtual_shutter_effect) or undelete.restore(scene, strip.virtual_shutter_effect)
            if restored is not None:
                strip.scene = restored


def _scene_of(identity: str):
    return next((scene for scene in _effect_scenes() if scene.virtual_shutter.identity == identity), None)


def _effect_scenes() -> list:
    """The scenes that were made for effects, and can be changed."""
    return [
        scene
        for scene in strips.local_scenes()
        if scene.render.engine == strips.ENGINE and scene.virtual_shutter.identity
    ]


def _separate_actions(scenes) -> None:
    """A copied scene gets keys of its own: Blender lets both share an action."""
    taken = set()
    for scene in scenes:
        animation_data = scene.animation_data
        if not (scene.virtual_shutter.effects and animation_data and animation_data.action):
            continue
        if (key := (animation_data.action, animation_data.action_slot_handle)) in taken:
            animation_data.action = animation_data.action.copy()
        taken.add(key)


def _remove_effects(scene) -> None:
    """Removes the scene's effects that none of its strips shows any more."""
    shown = {strip.scene for strip in strips.effect_strips(scene)}
    effects = scene.virtual_shutter.effects
    stay = [effect.scene in shown for effect in effects]
    if all(stay):
        return
    places = {i: sum(stay[:i]) if stays else None for i, stays in enumerate(stay)}
    for i in reversed([i for i, stays in enumerate(stay) if not stays]):
        undelete.keep(scene, effects[i])
        effects.remove(i)
    undo.renew_action(scene)
    fcurves.reindex(scene, EFFECTS, places)


def _unmute_sources(scene) -> None:
    """Sources that an effect muted show again once no effect strip shows them."""
    muted = [s for s in scene.sequence_editor.strips_all if s.virtual_shutter_muted] if scene.sequence_editor else []
    shown = strips.shown_sources(scene) if muted else ()
    for source in muted:
        if source.name not in shown and not _is_baked_over(scene, source):
            source.mute = source.virtual_shutter_muted = False


def _is_baked_over(scene, source) -> bool:
    """Whether a film that was baked of a source lies above it: the source would be seen through transparent parts."""
    baked = (s for s in source.connections if s.type in strips.SOURCES and s.channel > source.channel)
    return any(s.virtual_shutter_bake.identity and strips.overlap(s, source) for s in baked)


def _remove_scenes(updated) -> None:
    """Removes effect scenes that no strip and no window shows, with what was made for them."""
    shown = {strip.scene for scene in bpy.data.scenes for strip in strips.effect_strips(scene)}
    windows = [window for manager in bpy.data.window_managers for window in manager.windows]
    shown.update(scene for window in windows for scene in (window.scene, window.workspace.sequencer_scene))
    for effect_scene in _effect_scenes():
        if effect_scene not in shown and effect_scene != updated:
            _remove(effect_scene)


def _remove(scene) -> None:
    camera, annotation = scene.camera, scene.annotation
    bpy.data.scenes.remove(scene)
    sessions.drop_removed()
    invalidation.drop_removed()
    if camera is not None and camera.type == "CAMERA" and camera.library is None and not camera.users:
        data = camera.data
        bpy.data.objects.remove(camera)
        _remove_unused(bpy.data.cameras, data)
    if annotation is not None and annotation.library is None:
        if shown_annotations.is_own(annotation):
            shown_annotations.let_go(annotation)
        _remove_unused(bpy.data.annotations, annotation)


def _remove_unused(collection, item) -> None:
    if not item.users:
        collection.remove(item)


def _remove_left() -> None:
    """Removes what was made for effects whose scene somebody removed. What is used elsewhere is the user's from then
    on, as is a copy."""
    scenes = _effect_scenes()
    for annotation in _left(bpy.data.annotations, [scene.annotation for scene in scenes]):
        shown_annotations.let_go(annotation)
        _remove_unused(bpy.data.annotations, annotation)
    for camera in _left(bpy.data.cameras, [scene.camera.data for scene in scenes if scene.camera]):
        for each in [each for each in bpy.data.objects if each.data == camera and not each.users]:
            bpy.data.objects.remove(each)
        _remove_unused(bpy.data.cameras, camera)


def _left(collection, used) -> list:
    """Those of a collection of data that were made for an effect which is gone. They, and those that their effect does
    not use, as copies, are the user's from now on."""
    identities = {scene.virtual_shutter.identity for scene in bpy.data.scenes}
    marked = [each for each in collection if each.virtual_shutter_made not in ("", annotations.USERS)]
    unused = [each for each in marked if each.library is None and each not in used]
    gone = [each for each in unused if each.virtual_shutter_made not in identities]
    for each in unused:
        each.virtual_shutter_made = annotations.USERS
    return gone


def _identify() -> None:
    """Every effect scene has an identity of its own, and its strips and its effect carry it."""
    taken = set()
    for effect_scene in _effect_scenes():
        if effect_scene.virtual_shutter.identity in taken:
            effect_scene.virtual_shutter.identity = uuid.uuid4().hex
        taken.add(effect_scene.virtual_shutter.identity)
        _claim(effect_scene.annotation, effect_scene.virtual_shutter.identity)
    for scene in strips.local_scenes():
        for strip in strips.effect_strips(scene):
            if strip.virtual_shutter_effect != strip.scene.virtual_shutter.identity:
                strip.virtual_shutter_effect = strip.scene.virtual_shutter.identity
        for effect in scene.virtual_shutter.effects:
            if effect.scene is not None and effect.identity != effect.scene.virtual_shutter.identity:
                effect.identity = effect.scene.virtual_shutter.identity


def _claim(made, identity: str) -> None:
    """What was made for an effect, and copied with it, is marked as its own."""
    if made is not None and made.library is None and made.virtual_shutter_made not in ("", annotations.USERS, identity):
        made.virtual_shutter_made = identity
