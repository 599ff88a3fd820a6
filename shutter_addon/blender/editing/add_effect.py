"""Add an effect to a source strip: make an effect strip above it, and the effect scene that this strip shows."""

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
from ..data import data_format, fcurves, sole_effect, source_media
from ..data.annotations import new_annotation
from ..data.property_copy import for_a_while
from ..data.strips import ENGINE, ShownEffect, effect_of, nearest_source, origin, overlap, shown_effects

_COLOR = "COLOR_06"
# The look of a strip: each part's label, and the strip's properties and groups that it consists of.
LOOK = {
    n_("transform"): ("transform",),
    n_("crop"): ("crop",),
    n_("flip"): ("use_flip_x", "use_flip_y"),
    n_("color"): ("color_multiply", "color_saturation", "multiply_alpha"),
}


def add_effect(scene: Scene, source: Strip) -> tuple[Strip, PropertyGroup]:
    """Add an effect, which has no shutter yet, to a movie, image or clip strip.

    Args:
        scene: The scene that has the strip.
        source: The movie, image or clip strip.

    Returns:
        The new effect strip, above the source and with its range and look (LOOK); and the new effect.

    Raises:
        MediaError: The source's footage cannot be read.
    """
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
    if not keeps and medium.alpha == "opaque" and sole_effect.covers_all(scene, strip):
        strip.blend_type = "REPLACE"  # Blender changes colors when it blends strips
    effect = data_format.new_effect(scene, data_format.FORMAT)
    effect.name, effect.scene, effect.start = strip.name, effect_scene, origin(strip)
    effect.source = source.virtual_shutter_source
    strip.virtual_shutter_effect = effect.identity = effect_scene.virtual_shutter.identity
    scene.render.sequencer_gl_preview = "RENDERED"  # otherwise the preview shows the empty effect scene
    strip.color_tag = _COLOR
    connect(scene, [strip, source, *source.connections])
    return strip, effect_of(scene, effect_scene)  # looked up again: operators may move it in memory


def choose_source(effect: PropertyGroup, strip: Strip, source: Strip) -> None:
    """Make an effect use another movie, image or clip strip as its source.

    Args:
        strip: The effect strip that shows it, which is then connected to the source.
        source: The new source.

    Raises:
        MediaError: The source's footage cannot be read.
    """
    _take(source)
    scene, effect.source = effect.id_data, source.virtual_shutter_source
    if nearest_source(scene, effect, strip) != source:  # the identity belongs to a copy or another part, too
        own_source(source, shown_effects(scene))
        effect.source = source.virtual_shutter_source
    connect(scene, [strip, source, *source.connections])


def own_source(source: Strip, shown: list[ShownEffect]) -> None:
    """Give a source strip a new, unique identity (a text), which copies and cut parts of it do not have.

    Effects find their source by its identity, so they would otherwise take the nearest of these strips.

    Args:
        source: The source strip.
        shown: All effects with their strips and sources. The new identity is stored in those that use the strip.
    """
    source.virtual_shutter_source = uuid.uuid4().hex
    for effect in [each.effect for each in shown if each.source == source]:
        effect.source = source.virtual_shutter_source


def _take(source: Strip) -> FrameSource:
    """Make a strip the source of an effect: give it an identity if it has none, and mute it if it is transparent.

    A transparent source would show behind the effect. An opaque one stays visible, for when the effect is muted.

    Returns:
        The footage, closed. Its size and kind of alpha can still be read.

    Raises:
        MediaError: The source's footage cannot be read.
    """
    medium = source_media.spec(source).open()
    medium.close()
    source.virtual_shutter_source = source.virtual_shutter_source or uuid.uuid4().hex
    if medium.alpha != "opaque" and not source.mute:
        source.mute = source.virtual_shutter_muted = True
    return medium


def connect(scene: Scene, connected: list[Strip]) -> None:
    """Connect strips to each other and to no others, so that Blender selects and moves them together."""
    with selecting(scene, connected):
        bpy.ops.sequencer.connect(toggle=False)


@contextmanager
def selecting(scene: Scene, chosen: list[Strip]) -> Iterator[None]:
    """Select only the strips `chosen` within a `with` block, for Blender's operators; then restore the selection."""
    selected = ((strip, "select", strip in chosen) for strip in scene.sequence_editor.strips_all)
    with for_a_while(selected), bpy.context.temp_override(sequencer_scene=scene):
        yield


def copy_look(source: Strip, strip: Strip, *, keys: bool = False) -> None:
    """Copy transform, crop, flip and color (LOOK) from one strip to another.

    Args:
        source: The strip to copy from.
        strip: The strip to copy to.
        keys: Replace the F-curves of these properties with copies of the source's as well.
    """
    for name in (name for names in LOOK.values() for name in names):
        for (old, prop), (new, _prop) in zip(settings(source, name), settings(strip, name), strict=True):
            setattr(new, prop, getattr(old, prop))
        if keys:
            path = f"{strip.path_from_id()}.{name}"
            fcurves.remove_curves(strip.id_data, path)
            fcurves.copy_curves(source.id_data, f"{source.path_from_id()}.{name}", strip.id_data, path)


def settings(strip: Strip, name: str) -> list[tuple[bpy_struct, str]]:
    """Return one strip property or, if the property is a group, all writable properties in the group.

    Args:
        name: Name of the property or group, one of those in LOOK.

    Returns:
        Pairs of the struct that has a property (the strip or the group), and the property's name.
    """
    group = getattr(strip, name)
    if not isinstance(group, bpy_struct):
        return [(strip, name)]
    return [(group, prop.identifier) for prop in group.bl_rna.properties if not prop.is_readonly]


def new_footage(level: StripsTopLevel, name: str, files: list[str], channel: int, start: int, is_movie: bool) -> Strip:
    """Add a movie strip or an image strip, and return the strip.

    Args:
        level: The strips of a scene or of a meta strip, to which the new one is added.
        name: Name of the strip.
        files: The movie's path; or the paths of the pictures in order, all in one folder.
        channel: The strip's channel.
        start: Timeline frame at which the strip starts.
        is_movie: Whether `files` is a movie.
    """
    if is_movie:
        return level.new_movie(name, files[0], channel, start)
    strip = level.new_image(name, files[0], channel, start)
    for file in files[1:]:
        strip.elements.append(os.path.basename(file))
    return strip


def new_effect_scene(scene: Scene, identity: str, name: str, size: tuple[int, int]) -> Scene:
    """Add an effect scene, which the engine of this extension renders, with a camera and an empty annotation.

    Args:
        scene: The scene of the edit that will have the effect. Its frame rate is taken over.
        identity: Unique text, which effect, strip and effect scene store to find each other.
        name: Name of the effect scene and of the annotation.
        size: Width and height of the footage in pixels.
    """
    effect_scene = bpy.data.scenes.new(name)
    effect_scene.virtual_shutter.identity = identity
    effect_scene.render.engine = ENGINE
    effect_scene.render.resolution_x, effect_scene.render.resolution_y = size
    effect_scene.render.resolution_percentage = 100
    # Past the end of its scene, a Scene strip shows the last frame. Strips may become longer, by hand, retiming or a
    # keyed source time.
    effect_scene.frame_start, effect_scene.frame_end = 1, MAX_FRAME
    # A Scene strip plays at the rate of its scene. With the timeline's rate it shows one frame per timeline frame.
    effect_scene.render.fps, effect_scene.render.fps_base = scene.render.fps, scene.render.fps_base
    add_camera(effect_scene)
    new_annotation(effect_scene, name)
    return effect_scene


def add_camera(scene: Scene) -> None:
    """Add a camera to an effect scene. Without one, Blender renders a Scene strip empty and never asks the engine."""
    name = f"{scene.name} Camera"
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    camera.data.virtual_shutter_made = scene.virtual_shutter.identity
    scene.collection.objects.link(camera)
    scene.camera = camera
