"""What Blender's sequencer needs to ask the engine for an effect, and which data an edit's pictures use."""

from collections.abc import Iterator

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import ID, Object, Scene, Strip, bpy_struct

from ...core.frames import frame_ranges
from ...core.model.limits import MAX_FRAME
from .strips import ENGINE, all_strips, own_strips


def left_out(scene: Scene) -> list[tuple[range, str]]:
    """Return the timeline frames at which the sequencer leaves an effect out, and why."""
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
    """Yield owner, name and value of the settings that a strip's picture needs, besides a camera."""
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
    """Return the camera that shows the strip's scene, or None."""
    bound = (marker.camera for marker in strip.scene.timeline_markers if marker.camera)
    return strip.scene_camera or strip.scene.camera or next(bound, None)


def shown_scenes(film: Scene, frames: range | None = None) -> dict[Scene, range]:
    """Return what a film shows at some frames: itself, and every scene in its Scene strips at all frames.

    Args:
        frames: None: at any, even where strips are muted now.
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
    """Tell whether a strip is shown at one of these timeline frames."""
    return bool(frame_ranges.common(shown_frames(scene, strip), frames))


def shown_frames(scene: Scene, strip: Strip) -> range:
    """Return the timeline frames at which a strip is shown: not muted, nor in a meta strip that is."""
    first, last = strip.left_handle, strip.right_handle
    while strip is not None:
        outer = strip.parent_meta()
        if strip.mute or (outer or scene.sequence_editor).channels[strip.channel].mute:
            return range(0)
        first, last = max(first, strip.left_handle), min(last, strip.right_handle)
        strip = outer
    return range(first, last)


def used_data(scene: Scene, frames: range) -> set[ID]:
    """Return the data-blocks that pictures at these frames use: scenes, and what their shown strips use in turn.

    What scenes hold beside their strips is in no picture.
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
