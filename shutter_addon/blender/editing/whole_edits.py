"""Whole edits. Those made from nothing: a source strip, its effect, and where the film goes. And saved ones: a .blend
file's active scene, as Blender itself would render it."""

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


def is_saved(path: Path) -> bool:
    """Whether the path's name is that of a saved edit."""
    return path.suffix.lower() == ".blend"


def open_edit(path: Path, name: str | None = None) -> Scene:
    """Opens a .blend file, none of whose scripts is run: it may be a stranger's. Its scene of that name; None: the
    active one, which Blender would render. UserError: it cannot be opened, or shows no edit."""
    if not path.is_file():
        raise UserError(f"{path}: " + ("is no file" if path.exists() else "no such file"))
    try:
        with film_output.quiet():
            # With its windows, as `blender -b` does: load_ui=False would hold for all that this process opens after it.
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
    for owner, driver in _scripts(scene) if name is None else ():  # of a scene's effects drivers do not count
        words = f'a driver of the {owner.bl_rna.name.lower()} "{owner.name}" needs scripts, which are not run'
        words += f" ({sentence(driver.expression, 40)}); bake it to keyframes, and save the file"
        raise UserError(f"{path}: {words}")
    return scene


def _scripts(scene: Scene) -> list[tuple]:
    """(owner, driver) of each driver that Blender does not evaluate because it could do anything, of all that the
    edit's pictures are made of."""
    used = requirements.used_data(scene, range(scene.frame_start, scene.frame_end + 1))
    drivers = [(item, curve.driver) for item in used for curve in _driven(item)]
    scripted = ((owner, driver) for owner, driver in drivers if driver.type == "SCRIPTED")
    complex_ones = [(owner, driver) for owner, driver in scripted if not driver.is_simple_expression]
    if complex_ones:  # only once they are evaluated it is known of them
        with film_output.quiet():
            for other in used.intersection(bpy.data.scenes):
                for layer in other.view_layers:
                    layer.update()
    return [(owner, driver) for owner, driver in complex_ones if not driver.is_valid]


def _driven(item: bpy.types.ID) -> list:
    """The driver curves of an ID, and of the nodes that are its own."""
    animations = (getattr(each, "animation_data", None) for each in (item, getattr(item, "node_tree", None)))
    return [curve for animation in animations if animation for curve in animation.drivers]


def _has_strips(scene: Scene) -> bool:
    return bool(scene.sequence_editor and scene.sequence_editor.strips)
