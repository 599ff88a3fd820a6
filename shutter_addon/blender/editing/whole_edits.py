"""Edits for the command: new ones from a file and a recipe, and saved ones from a .blend file."""

import math
import os
from contextlib import AbstractContextManager, suppress
from pathlib import Path

import bpy
from bpy.types import Scene, Strip

from ...core.frames.frame_source import FrameSource
from ...core.messages import UserError, sentence
from ...core.model.effect import Effect
from ...core.model.keyframes import SourceTime
from ...core.model.limits import MAX_FRAME
from ..data import recipe_import, requirements
from ..data.property_copy import for_a_while
from ..output import film_output
from . import add_effect

_PATHS = {"MOVIE": "filepath", "IMAGE": "directory", "SOUND": "filepath"}  # path property of each type


def make_edit(path: Path, medium: FrameSource, source_recipe: Effect, folder: Path) -> Scene:
    """Make an edit of one source strip with an effect, and return its scene.

    Args:
        medium: the source, opened.
        folder: of the recipe.

    Raises:
        MediaError: a matte of the recipe cannot be read.
    """
    source = make_source(path, medium)
    scene = source.id_data
    strip, effect = add_effect.add_effect(scene, source)
    recipe_import.apply(scene, effect, strip, source_recipe, folder)
    strip.right_handle = length(medium, source_recipe) + 1
    scene.frame_start, scene.frame_end = strip.left_handle, strip.right_handle - 1
    scene.frame_current = scene.frame_start
    return scene


def make_source(path: Path, medium: FrameSource) -> Strip:
    """Make an edit with a single source strip from an opened medium, and return the strip."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.name = "Edit"
    render = scene.render
    if medium.fps:
        render.fps = max(1, round(medium.fps))
        render.fps_base = render.fps / float(medium.fps)
    render.resolution_x, render.resolution_y = medium.width, medium.height
    render.resolution_percentage = 100
    # Dither adds noise to a still frame. *Standard* shows the source's display values.
    render.dither_intensity = 0
    scene.view_settings.view_transform = "Standard"
    editor = scene.sequence_editor_create()
    # For a missing file Blender would show a picture whose size scripts leave uninitialized.
    editor.show_missing_media = False
    is_movie = medium.fps is not None
    if is_movie and medium.has_audio:
        editor.strips.new_sound(f"{path.name} Sound", str(path), 1, 1)
    files = [str(path)] if is_movie else [str(file) for file in medium.files]
    return add_effect.new_footage(editor.strips, path.name, files, 2, 1, is_movie)


def length(medium: FrameSource, source_recipe: Effect) -> int:
    """Return the length of the edit in timeline frames: that of the source, or up to the last key of its time."""
    time = source_recipe.time
    keys = [math.ceil(frame) for frame, _ in time.keys] if isinstance(time, SourceTime) else []
    return min(max([medium.count, *keys]), MAX_FRAME)


def paths_relative(scene: Scene, folder: Path) -> AbstractContextManager[None]:
    """Make the edit's paths relative to the folder of its file, where possible, and restore them afterwards."""
    owners = [(scene.render, "filepath")]
    for strip in scene.sequence_editor.strips_all:
        if strip.type in _PATHS:
            owners.append((strip.sound if strip.type == "SOUND" else strip, _PATHS[strip.type]))
    owners += [(image, "filepath") for image in bpy.data.images]
    relative = []
    for owner, name in owners:
        if path := getattr(owner, name):
            with suppress(ValueError):  # on another drive
                end = "/" if path.endswith(os.sep) else ""  # relpath removes it
                relative.append((owner, name, bpy.path.relpath(path, start=str(folder)) + end))
    return for_a_while(relative)


def open_edit(path: Path, name: str | None = None) -> Scene:
    """Open a .blend file without running its scripts, and return its scene of this name, or its active scene.

    Raises:
        UserError: the file cannot be opened or has no edit.
    """
    if not path.is_file():
        raise UserError(f"{path}: " + ("is no file" if path.exists() else "no such file"))
    try:
        with film_output.quiet():
            # With its windows, like `blender -b`: load_ui=False would stay set for later files.
            bpy.ops.wm.open_mainfile(filepath=str(path), use_scripts=False)
    except RuntimeError as error:
        raise UserError(f"{path}: {film_output.message(error)}") from None
    if name is not None and name not in bpy.data.scenes:
        raise UserError(f'{path}: has no scene "{sentence(name, 40)}"')
    scene = bpy.context.scene if name is None else bpy.data.scenes[name]
    if name is None and not _has_strips(scene):
        others = [other.name for other in bpy.data.scenes if _has_strips(other)]
        where = f'; make "{others[0]}" the active one, and save the file' if others else ""
        raise UserError(f'{path}: its active scene, "{scene.name}", has no strips{where}')
    for setting, wanted in (("use_sequencer", True), ("use_multiview", False)):
        if getattr(scene.render, setting) != wanted:
            name, turn = scene.render.bl_rna.properties[setting].name, "on" if wanted else "off"
            raise UserError(f'{path}: turn "{name}" {turn} in the scene "{scene.name}", and save the file')
    for owner, driver in _scripts(scene) if name is None else ():  # drivers do not matter for the effects of a scene
        words = f'a driver of the {owner.bl_rna.name.lower()} "{owner.name}" needs scripts, which are not run'
        words += f" ({sentence(driver.expression, 40)}); bake it to keyframes, and save the file"
        raise UserError(f"{path}: {words}")
    return scene


def _scripts(scene: Scene) -> list[tuple]:
    """Return (owner, driver) of each driver that needs scripts, among the data that the edit renders."""
    used = requirements.used_data(scene, range(scene.frame_start, scene.frame_end + 1))
    drivers = [(item, curve.driver) for item in used for curve in _driven(item)]
    complex_ones = [pair for pair in drivers if pair[1].type == "SCRIPTED" and not pair[1].is_simple_expression]
    if complex_ones:  # evaluation finds out which of them are valid
        with film_output.quiet():
            for other in used.intersection(bpy.data.scenes):
                for layer in other.view_layers:
                    layer.update()
    return [(owner, driver) for owner, driver in complex_ones if not driver.is_valid]


def _driven(item: bpy.types.ID) -> list:
    """Return the driver curves of an ID and of its node tree."""
    animations = (getattr(each, "animation_data", None) for each in (item, getattr(item, "node_tree", None)))
    return [curve for animation in animations if animation for curve in animation.drivers]


def _has_strips(scene: Scene) -> bool:
    return bool(scene.sequence_editor and scene.sequence_editor.strips)
