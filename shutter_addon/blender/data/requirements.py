"""Which data an edit's pictures use, and which settings Blender's sequencer needs to ask our engine for an effect."""

from collections.abc import Iterator

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import ID, Object, Scene, Strip, bpy_struct

from ...core.frames import frame_ranges
from ...core.model.limits import MAX_FRAME
from .strips import ENGINE, all_strips, own_strips


def left_out(scene: Scene) -> list[tuple[range, str]]:
    """Return the effect strips that Blender would leave out of the picture without an error.

    It does so if the effect scene is gone, has no camera, or does not have the settings that it needs (`settings`).

    Returns:
        For each such strip: the timeline frames at which it lies, and the reason, as a sentence for the user. Muted
        strips, and those in muted channels or meta strips, are not listed.
    """
    reasons = ((shown_frames(scene, strip), why) for strip in own_strips(scene) if (why := _why(strip)) is not None)
    return [(frames, why) for frames, why in reasons if frames]


def _why(strip: Strip) -> str | None:
    if strip.scene is None:
        return rpt_('the scene of "{strip}" was deleted').format(strip=strip.name)
    if camera(strip) is None:
        return rpt_('the scene of "{strip}" has no camera').format(strip=strip.name)
    for owner, name, value in settings(strip):
        if getattr(owner, name) != value:
            setting = owner.bl_rna.properties[name].name
            return rpt_('the setting "{setting}" leaves "{strip}" out').format(setting=setting, strip=strip.name)
    return None


def settings(strip: Strip) -> Iterator[tuple[bpy_struct, str, object]]:
    """Yield the settings that an effect strip and its scene need, so that Blender renders the effect's picture.

    It needs a camera as well, which is not among them.

    Yields:
        The struct that has the setting, the setting's name, and the value that it needs.
    """
    scene = strip.scene
    yield strip, "scene_input", "CAMERA"
    yield scene.render, "engine", ENGINE
    yield scene.render, "resolution_percentage", 100
    yield scene.render, "use_border", False
    # Blender 5.3 has a list of effects, and deprecates the single tree.
    if getattr(scene, "compositor_effects", None) or getattr(scene, "compositing_node_group", None):
        yield scene.render, "use_compositing", False
    if not any(layer.use for layer in scene.view_layers):
        yield scene.view_layers[0], "use", True


def camera(strip: Strip) -> Object | None:
    """Return the camera of an effect strip's scene, without which Blender renders it empty; None: there is none."""
    bound = (marker.camera for marker in strip.scene.timeline_markers if marker.camera)
    return strip.scene_camera or strip.scene.camera or next(bound, None)


def shown_scenes(film: Scene, frames: range | None = None) -> dict[Scene, range]:
    """Return the scenes whose strips a rendered scene may show: itself, and those of its Scene strips, nested ones too.

    Scenes without a sequencer are left out.

    Args:
        film: The scene that is rendered.
        frames: Timeline frames of `film`. None: all frames, and muted strips count as well.

    Returns:
        For each scene, the range of its frames that can be visible. For `film` it is `frames`; if that is None, and for
        the other scenes, it is all frames that Blender has.
    """
    ever = range(-MAX_FRAME, MAX_FRAME + 1)
    shown = {film: ever if frames is None else frames}
    new = [film]
    while new:
        scene = new.pop()
        for strip in all_strips(scene):
            is_new = strip.type == "SCENE" and strip.scene and strip.scene not in shown
            if is_new and (frames is None or is_shown(scene, strip, shown[scene])):
                shown[strip.scene] = ever
                new.append(strip.scene)
    return {scene: at for scene, at in shown.items() if scene.sequence_editor}


def is_shown(scene: Scene, strip: Strip, frames: range) -> bool:
    """Tell whether a strip is shown at one of these timeline frames (shown_frames)."""
    return bool(frame_ranges.common(shown_frames(scene, strip), frames))


def shown_frames(scene: Scene, strip: Strip) -> range:
    """Return the timeline frames at which a strip and the meta strips around it lie and are not muted."""
    first, last = strip.left_handle, strip.right_handle
    while strip is not None:
        outer = strip.parent_meta()
        if strip.mute or (outer or scene.sequence_editor).channels[strip.channel].mute:
            return range(0)
        first, last = max(first, strip.left_handle), min(last, strip.right_handle)
        strip = outer
    return range(first, last)


def used_data(scene: Scene, frames: range) -> set[ID]:
    """Return the data-blocks that pictures at these timeline frames depend on: images, clips, fonts, scenes and so on.

    These are what visible strips and their modifiers use, directly or through other data-blocks. What a scene has
    beside its strips does not count unless a strip renders it.

    Args:
        scene: The scene that is rendered.
        frames: Its timeline frames.
    """
    shown = shown_scenes(scene, frames)
    uses: dict = {}
    for item, users in bpy.data.user_map().items():
        for user in users:
            uses.setdefault(user, []).append(item)
    items = set()
    new = [item for each, at in shown.items() for item in _named(each, at)]
    while new:
        if (item := new.pop()) not in items:
            items.add(item)
            new += uses.get(item, ())
    return items.union(shown)


def _named(scene: Scene, frames: range) -> Iterator[ID]:
    for strip in scene.sequence_editor.strips_all:
        if not is_shown(scene, strip, frames):
            continue
        for owner in (strip, *strip.modifiers):
            for setting in owner.bl_rna.properties:
                value = getattr(owner, setting.identifier) if setting.type == "POINTER" else None
                is_edit = isinstance(value, Scene) and strip.scene_input == "SEQUENCER"
                if isinstance(value, ID) and not is_edit:
                    yield value
