"""Whole edits made from nothing: a source strip, its effect, and where the film goes."""

import math
import os
from pathlib import Path

import bpy

from . import effects, strips


def make_edit(path: Path, medium, source_recipe):
    """An edit of one source strip (an opened medium's) under one effect strip; its scene."""
    source = make_source(path, medium)
    edit = source.id_data
    strip, effect = strips.add_effect(edit, source)
    effects.apply(edit, effect, strip, source_recipe)
    strip.right_handle = length(medium, source_recipe) + 1
    edit.frame_start, edit.frame_end = strip.left_handle, strip.right_handle - 1
    edit.frame_current = edit.frame_start
    return edit


def make_source(path: Path, medium):
    """A source strip (an opened medium's), alone in an edit that fits it."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    edit = bpy.context.scene
    edit.name = "Edit"
    render = edit.render
    if medium.fps:
        render.fps = max(1, round(medium.fps))
        render.fps_base = render.fps / float(medium.fps)
    render.resolution_x, render.resolution_y = medium.width, medium.height
    render.resolution_percentage = 100
    # Dither would add noise to a still frame; Standard shows code values as the source has them.
    render.dither_intensity = 0
    edit.view_settings.view_transform = "Standard"
    return _add_source(edit.sequence_editor_create(), path, medium)


def length(medium, source_recipe) -> int:
    """How many timeline frames the edit has: the source's, and more where its time is keyed beyond them."""
    return max([medium.count, *(math.ceil(key.frame) for key in source_recipe.time)])


def _add_source(editor, path: Path, medium):
    name = path.name
    if medium.fps is not None:
        if medium.has_audio:
            editor.strips.new_sound(f"{name} Sound", str(path), 1, 1)
        return editor.strips.new_movie(name, str(path), 2, 1)
    strip = editor.strips.new_image(name, str(medium.files[0]), 2, 1)
    for file in medium.files[1:]:
        strip.elements.append(file.name)
    return strip


def make_paths_relative(edit, folder: Path) -> None:
    """Makes the edit's paths relative to the folder that it will be saved in, as far as there is such a path."""

    def relative(path):
        try:
            return bpy.path.relpath(path, start=str(folder))
        except ValueError:  # another drive
            return path

    for strip in edit.sequence_editor.strips_all:
        if strip.type == "MOVIE":
            strip.filepath = relative(strip.filepath)
        elif strip.type == "IMAGE":
            strip.directory = relative(strip.directory)
        elif strip.type == "SOUND":
            strip.sound.filepath = relative(strip.sound.filepath)
    if edit.render.filepath:
        is_folder = edit.render.filepath.endswith(os.sep)
        edit.render.filepath = relative(edit.render.filepath) + ("/" if is_folder else "")
