"""Whole edits made from nothing: a source strip, its effect, and where the film goes."""

import math
import os
from contextlib import AbstractContextManager, suppress
from pathlib import Path

import bpy
from bpy.types import Scene, Strip

from ...core.frames.frame_source import FrameSource
from ...core.model.effect import Effect
from ...core.model.keyframes import SourceTime
from ...core.model.limits import MAX_FRAME
from ..data import recipe_import
from ..data.property_copy import for_a_while
from . import add_effect

_PATHS = {"MOVIE": "filepath", "IMAGE": "directory", "SOUND": "filepath"}  # the property of a strip of that type


def make_edit(path: Path, medium: FrameSource, source_recipe: Effect, folder: Path) -> Scene:
    """An edit of one source strip (an opened medium's) under one effect strip; its scene. folder: of the recipe.
    MediaError: the recipe has mattes that cannot be read."""
    source = make_source(path, medium)
    scene = source.id_data
    strip, effect = add_effect.add_effect(scene, source)
    recipe_import.apply(scene, effect, strip, source_recipe, folder)
    strip.right_handle = length(medium, source_recipe) + 1
    scene.frame_start, scene.frame_end = strip.left_handle, strip.right_handle - 1
    scene.frame_current = scene.frame_start
    return scene


def make_source(path: Path, medium: FrameSource) -> Strip:
    """A source strip (an opened medium's), alone in an edit that fits it."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.name = "Edit"
    render = scene.render
    if medium.fps:
        render.fps = max(1, round(medium.fps))
        render.fps_base = render.fps / float(medium.fps)
    render.resolution_x, render.resolution_y = medium.width, medium.height
    render.resolution_percentage = 100
    # Dither would add noise to a still frame; Standard shows code values as the source has them.
    render.dither_intensity = 0
    scene.view_settings.view_transform = "Standard"
    editor = scene.sequence_editor_create()
    # Of a file that is gone Blender would make a picture of the size that its element has: none where Python has added
    # it, but what lay in memory there.
    editor.show_missing_media = False
    is_movie = medium.fps is not None
    if is_movie and medium.has_audio:
        editor.strips.new_sound(f"{path.name} Sound", str(path), 1, 1)
    files = [str(path)] if is_movie else [str(file) for file in medium.files]
    return add_effect.new_footage(editor.strips, path.name, files, 2, 1, is_movie)


def length(medium: FrameSource, source_recipe: Effect) -> int:
    """How many timeline frames the edit has: the source's, and more where its time is keyed beyond them; as many as
    Blender has at most."""
    time = source_recipe.time
    keys = [math.ceil(frame) for frame, _ in time.keys] if isinstance(time, SourceTime) else []
    return min(max([medium.count, *keys]), MAX_FRAME)


def paths_relative(scene: Scene, folder: Path) -> AbstractContextManager[None]:
    """Inside, the edit's paths are relative to the folder that it is saved in, as far as there is such a path."""
    owners = [(scene.render, "filepath")]
    for strip in scene.sequence_editor.strips_all:
        if strip.type in _PATHS:
            owners.append((strip.sound if strip.type == "SOUND" else strip, _PATHS[strip.type]))
    owners += [(image, "filepath") for image in bpy.data.images]  # mattes
    relative = []
    for owner, name in owners:
        if path := getattr(owner, name):
            with suppress(ValueError):  # another drive
                end = "/" if path.endswith(os.sep) else ""  # which relpath leaves out behind a folder
                relative.append((owner, name, bpy.path.relpath(path, start=str(folder)) + end))
    return for_a_while(relative)
