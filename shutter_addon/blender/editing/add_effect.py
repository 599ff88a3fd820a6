"""A new effect: its strip above the source, and its scene."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
from bpy.app.translations import pgettext_data as data_
from bpy.types import PropertyGroup, Scene, Strip

from ...core.frames.frame_source import FrameSource
from ...core.model.limits import MAX_FRAME
from ...media import color
from ..data import data_format, seen_alone, source_media
from ..data.annotations import new_annotation
from ..data.strips import ENGINE, Shown, effect_of, nearest_source, origin, overlap, shown_effects

_COLOR = "COLOR_06"
_LOOK = ("use_flip_x", "use_flip_y", "color_multiply", "color_saturation", "multiply_alpha")


def add_effect(scene: Scene, source: Strip) -> tuple[Strip, PropertyGroup]:
    """Puts a new effect on a movie, image or clip strip: its strip above the source, same range, transform and crop.

    Returns strip and effect; the effect has no shutter yet. MediaError: the source cannot be read."""
    medium = source_media.open_media(source)
    medium.close()
    if not source.virtual_shutter_source:
        source.virtual_shutter_source = uuid.uuid4().hex
    name = data_("Shutter {source}").format(source=source.name)
    effect_scene = new_effect_scene(scene, uuid.uuid4().hex, name, (medium.width, medium.height))
    level = (source.parent_meta() or scene.sequence_editor).strips
    taken = {s.channel for s in level if overlap(s, source)}
    channel = next(c for c in range(source.channel + 1, source.channel + len(taken) + 2) if c not in taken)
    strip = level.new_scene(data_("Shutter"), effect_scene, channel, int(source.content_start))
    strip.left_handle, strip.right_handle = source.left_handle, source.right_handle
    strip.blend_type = source.blend_type
    copy_look(source, strip)
    _mute(source, medium)
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
    medium, scene = source_media.open_media(source), effect.id_data
    medium.close()
    _mute(source, medium)
    source.virtual_shutter_source = effect.source = source.virtual_shutter_source or uuid.uuid4().hex
    if nearest_source(scene, effect, strip) != source:  # but a copy or another part of it
        own_source(source, shown_effects(scene))
        effect.source = source.virtual_shutter_source
    connect(scene, [strip, source, *source.connections])


def own_source(source: Strip, shown: list[Shown]) -> None:
    """Gives a source an identity that no other strip has; the effects that show it, of all those, go along."""
    source.virtual_shutter_source = uuid.uuid4().hex
    for effect in [each.effect for each in shown if each.source == source]:
        effect.source = source.virtual_shutter_source


def _mute(source: Strip, medium: FrameSource) -> None:
    """Through a transparent picture the plain source would show. An opaque one stays: mute the effect to see it."""
    if medium.alpha != "opaque" and not source.mute:
        source.mute = source.virtual_shutter_muted = True


def connect(scene: Scene, connected: list[Strip]) -> None:
    """Connects strips, so that they are selected and moved together; each leaves the strips it was connected to."""
    with selecting(scene, connected):
        bpy.ops.sequencer.connect(toggle=False)


@contextmanager
def selecting(scene: Scene, chosen: list[Strip]) -> Iterator[None]:
    """For what Blender has an operator only, which takes the selection: these strips are it meanwhile."""
    before = [(strip, strip.select) for strip in scene.sequence_editor.strips_all]
    for strip, _is_selected in before:
        strip.select = strip in chosen
    with bpy.context.temp_override(sequencer_scene=scene):
        yield
    for strip, is_selected in before:
        strip.select = is_selected


def copy_look(source: Strip, strip: Strip) -> None:
    """Transform, crop, flip and colour of the source strip."""
    for group in ("transform", "crop"):
        old, new = getattr(source, group), getattr(strip, group)
        for prop in old.bl_rna.properties:
            if not prop.is_readonly:
                setattr(new, prop.identifier, getattr(old, prop.identifier))
    for name in _LOOK:
        setattr(strip, name, getattr(source, name))


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
