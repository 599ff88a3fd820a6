"""A new effect: its strip above the source, and its scene."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_n as n_
from bpy.types import PropertyGroup, Scene, Strip, StripsTopLevel, bpy_struct

from ...core.frames.frame_source import FrameSource
from ...core.model.limits import MAX_FRAME
from ...media import color
from ..data import data_format, fcurves, seen_alone, source_media
from ..data.annotations import new_annotation
from ..data.property_copy import for_a_while
from ..data.strips import ENGINE, Shown, effect_of, nearest_source, origin, overlap, shown_effects

_COLOR = "COLOR_06"
# What a strip looks like: what it is called, and the names of the strip's properties and groups.
LOOK = {
    n_("transform"): ("transform",),
    n_("crop"): ("crop",),
    n_("flip"): ("use_flip_x", "use_flip_y"),
    n_("color"): ("color_multiply", "color_saturation", "multiply_alpha"),
}


def add_effect(scene: Scene, source: Strip) -> tuple[Strip, PropertyGroup]:
    """Puts a new effect on a movie, image or clip strip: its strip above the source, same range, transform and crop.

    Returns strip and effect; the effect has no shutter yet. MediaError: the source cannot be read."""
    medium = _take(source)
    name = data_("Shutter {source}").format(source=source.name)
    effect_scene = new_effect_scene(scene, uuid.uuid4().hex, name, (medium.width, medium.height))
    level = (source.parent_meta() or scene.sequence_editor).strips
    taken = {s.channel for s in level if overlap(s, source)}
    channel = next(c for c in range(source.channel + 1, source.channel + len(taken) + 2) if c not in taken)
    strip = level.new_scene(data_("Shutter"), effect_scene, channel, int(source.content_start))
    strip.left_handle, strip.right_handle = source.left_handle, source.right_handle
    strip.blend_type = source.blend_type
    copy_look(source, strip)
    config = source_media.spec(source).options["config"]
    keeps = color.keeps(scene.sequencer_colorspace_settings.name, config)
    if not keeps and medium.alpha == "opaque" and seen_alone.hides(scene, strip):
        strip.blend_type = "REPLACE"  # Blender changes colours as it lays strips over others
    effect = data_format.new_effect(scene, data_format.FORMAT)
    effect.name, effect.scene, effect.start = strip.name, effect_scene, origin(strip)
    effect.source = source.virtual_shutter_source
    strip.virtual_shutter_effect = effect.identity = effect_scene.virtual_shutter.identity
    scene.render.sequencer_gl_preview = "RENDERED"  # or the preview shows the effect's empty scene
    strip.color_tag = _COLOR
    connect(scene, [strip, source, *source.connections])
    return strip, effect_of(scene, effect_scene)  # again: an operator's update may move the collection's items


def choose_source(effect: PropertyGroup, strip: Strip, source: Strip) -> None:
    """Has an effect show another movie, image or clip strip. MediaError: it cannot be read."""
    _take(source)
    scene, effect.source = effect.id_data, source.virtual_shutter_source
    if nearest_source(scene, effect, strip) != source:  # but a copy or another part of it
        own_source(source, shown_effects(scene))
        effect.source = source.virtual_shutter_source
    connect(scene, [strip, source, *source.connections])


def own_source(source: Strip, shown: list[Shown]) -> None:
    """Gives a source an identity that no other strip has; the effects that show it, of all those, go along."""
    source.virtual_shutter_source = uuid.uuid4().hex
    for effect in [each.effect for each in shown if each.source == source]:
        effect.source = source.virtual_shutter_source


def _take(source: Strip) -> FrameSource:
    """Gives a strip an identity as a source, unless it has one; its medium, which is closed. Through a transparent
    picture the plain source would show; an opaque one stays: mute the effect to see it. MediaError: it cannot be
    read."""
    medium = source_media.open_media(source)
    medium.close()
    source.virtual_shutter_source = source.virtual_shutter_source or uuid.uuid4().hex
    if medium.alpha != "opaque" and not source.mute:
        source.mute = source.virtual_shutter_muted = True
    return medium


def connect(scene: Scene, connected: list[Strip]) -> None:
    """Connects strips, so that they are selected and moved together; each leaves the strips it was connected to."""
    with selecting(scene, connected):
        bpy.ops.sequencer.connect(toggle=False)


@contextmanager
def selecting(scene: Scene, chosen: list[Strip]) -> Iterator[None]:
    """For what Blender has an operator only, which takes the selection: these strips are it meanwhile."""
    selected = ((strip, "select", strip in chosen) for strip in scene.sequence_editor.strips_all)
    with for_a_while(selected), bpy.context.temp_override(sequencer_scene=scene):
        yield


def copy_look(source: Strip, strip: Strip, *, keys: bool = False) -> None:
    """Transform, crop, flip and colour of the source strip; keys: theirs as well, in place of the strip's own."""
    for name in (name for names in LOOK.values() for name in names):
        for (old, prop), (new, _prop) in zip(settings(source, name), settings(strip, name), strict=True):
            setattr(new, prop, getattr(old, prop))
        if keys:
            path = f"{strip.path_from_id()}.{name}"
            fcurves.remove_curves(strip.id_data, path)
            fcurves.copy_curves(source.id_data, f"{source.path_from_id()}.{name}", strip.id_data, path)


def settings(strip: Strip, name: str) -> list[tuple[bpy_struct, str]]:
    """Owner and name of a strip's property, or of all that are in a group of it."""
    group = getattr(strip, name)
    if not isinstance(group, bpy_struct):
        return [(strip, name)]
    return [(group, prop.identifier) for prop in group.bl_rna.properties if not prop.is_readonly]


def new_footage(level: StripsTopLevel, name: str, files: list[str], channel: int, start: int, is_movie: bool) -> Strip:
    """A new strip of a movie, or of an image sequence."""
    if is_movie:
        return level.new_movie(name, files[0], channel, start)
    strip = level.new_image(name, files[0], channel, start)
    for file in files[1:]:
        strip.elements.append(os.path.basename(file))
    return strip


def new_effect_scene(scene: Scene, identity: str, name: str, size: tuple[int, int]) -> Scene:
    """An effect scene for an effect of the scene, with a camera and an empty annotation."""
    effect_scene = bpy.data.scenes.new(name)
    effect_scene.virtual_shutter.identity = identity
    effect_scene.render.engine = ENGINE
    effect_scene.render.resolution_x, effect_scene.render.resolution_y = size
    effect_scene.render.resolution_percentage = 100
    # Past its scene's end a Scene strip shows the last frame. Source and strip may be made longer, by hand, by speed or
    # by keys of the source time.
    effect_scene.frame_start, effect_scene.frame_end = 1, MAX_FRAME
    # A Scene strip plays at its own scene's rate; at that of the timeline it shows one frame per timeline frame.
    effect_scene.render.fps, effect_scene.render.fps_base = scene.render.fps, scene.render.fps_base
    add_camera(effect_scene)
    new_annotation(effect_scene, name)
    return effect_scene


def add_camera(scene: Scene) -> None:
    """Without a camera, Blender renders a Scene strip empty and never asks the engine."""
    name = f"{scene.name} Camera"
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    camera.data.virtual_shutter_made = scene.virtual_shutter.identity
    scene.collection.objects.link(camera)
    scene.camera = camera
