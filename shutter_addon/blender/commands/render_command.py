"""The command `render`: render footage with a recipe, or a saved edit, through Blender's sequencer."""

import os
from argparse import ArgumentParser, Namespace
from contextlib import AbstractContextManager, suppress
from pathlib import Path

import bpy
from bpy.types import Scene

from ...core import atomic_write
from ...core.farm import job_file
from ...core.frames.frame_source import FrameSource
from ...core.model.effect import Effect
from ...core.recipes import recipe
from ...media.opening import MatteFile
from ...media.rendered_pictures import is_whole_blend, why_short
from ..data import external_files, recipe_import, versions
from ..data.property_copy import for_a_while
from ..devices import available
from ..editing import add_effect
from ..output import film_output, shared_frames
from ..rendering import render_settings
from . import command_line

HELP = "render a source through a recipe, or a saved edit"


def add(parser: ArgumentParser) -> None:
    option, to_path = parser.add_argument, command_line.to_path
    option("source", type=to_path, help="a movie, the first file of an image sequence, or a saved edit (.blend)")
    option("--recipe", type=to_path, help="the effect, a JSON file; not for a saved edit")
    option("--output", type=to_path, help=f"a folder, or a movie ({', '.join(film_output.MOVIES)})")
    option("--format", choices=tuple(film_output.FORMATS), help="of pictures in a folder: 16-bit png, float exr")
    option("--frames", metavar="A:B", help="timeline frames A to B; 1 is the strip's first")
    option("--resume", action="store_true", help="of a saved edit: only missing frames, shared with other machines")
    command_line.add_device(parser)
    option("--weights", type=to_path, metavar="DIR", help="also write the mattes of the shutters, as float EXR")
    option("--save", type=to_path, metavar="FILE.blend", help="keep the edit")


def run(arguments: Namespace) -> None:
    if arguments.source.suffix.lower() == ".blend":
        _render_edit(arguments)
    else:
        _render_source(arguments)


def _render_edit(arguments: Namespace) -> None:
    """Render the saved edit that the arguments name, unchanged, to pictures."""
    for name in ("recipe", "weights", "save"):
        if getattr(arguments, name) is not None:
            why = "is for a source and a recipe; a saved edit is rendered as it is"
            raise film_output.OutputError(f"--{name}: {why}")
    output, file_format = arguments.output, arguments.format or "png"
    if output is None:
        raise film_output.OutputError("nothing to do: give --output")
    scene, frames = command_line.open_edit(arguments.source, arguments.frames)
    scene.frame_start, scene.frame_end = frames[0], frames[-1]
    for fault in external_files.faults(scene, frames, sources=True):
        raise film_output.OutputError(fault)  # Blender would render without it
    version = versions.of_edit(scene)
    job_file.guard(output, version)
    shared_frames.check(output, arguments.format, frames, [arguments.source, *versions.read_files(scene)])
    available.choose(render_settings.wanted())  # before anything is written
    shared_frames.render(scene, output, file_format, version, resume=arguments.resume)


def _render_source(arguments: Namespace) -> None:
    """Make an edit of the footage and the recipe that the arguments name, then render it, save it, or both."""
    if arguments.recipe is None:
        raise film_output.OutputError("--recipe is missing: only a saved edit (.blend) is rendered without one")
    if arguments.resume:
        raise film_output.OutputError("--resume: is for a saved edit (.blend)")
    if arguments.output is None and arguments.save is None:
        raise film_output.OutputError("nothing to do: give --output, --save or both")
    source_recipe = command_line.recipe(arguments.recipe)
    path = arguments.source
    with command_line.open_footage(path) as medium:
        output, file_format = arguments.output, arguments.format or "png"
        if output:
            film_output.check(output, arguments.format, (medium.width, medium.height))
        frames = command_line.frames(arguments.frames, range(1, command_line.length(medium, source_recipe) + 1))
        read = path, *command_line.files(medium), arguments.recipe, *_mattes(source_recipe, arguments.recipe.parent)
        film_output.refuse_overwriting(_written(arguments, file_format, frames), read)
        scene = make_edit(path, medium, source_recipe, arguments.recipe.parent)
    scene.frame_start, scene.frame_end = frames[0], frames[-1]
    if output:
        available.choose(render_settings.wanted())  # before anything is written
        film_output.set_output(scene, output, file_format, alpha=medium.alpha != "opaque")
    if arguments.save:
        _save(scene, arguments.save)
    if output and arguments.weights:
        film_output.make_folder(arguments.weights)
    if output:
        film_output.render_made_edit(scene, output)


def make_edit(path: Path, medium: FrameSource, source_recipe: Effect, folder: Path) -> Scene:
    """Replace Blender's open file by a new edit: a strip of footage with an effect strip above it. Return its scene.

    Both strips begin at frame 1. A movie's sound gets a strip, too.

    Args:
        path: The movie, or the first file of the image sequence. The strips of its picture and sound are named after
            it.
        medium: The same footage, opened. Size, frame rate and list of files are read from it.
        source_recipe: The effect.
        folder: The recipe's folder. Paths of mattes in the recipe are relative to it.

    Raises:
        MediaError: A matte of the recipe cannot be read.
    """
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
    source = add_effect.new_footage(editor.strips, path.name, files, 2, 1, is_movie)
    strip, effect = add_effect.add_effect(scene, source)
    recipe_import.apply(scene, effect, strip, source_recipe, folder)
    strip.right_handle = command_line.length(medium, source_recipe) + 1
    scene.frame_start, scene.frame_end = strip.left_handle, strip.right_handle - 1
    scene.frame_current = scene.frame_start
    return scene


def _written(arguments: Namespace, file_format: str, frames: range) -> list[Path]:
    """Return all files that the render with these arguments writes: frames or movie, mattes, and the edit."""
    files = [arguments.save] if arguments.save else []
    if arguments.output and film_output.is_movie(arguments.output):
        files.append(arguments.output)
    elif arguments.output:
        files += film_output.pictures_of(arguments.output, file_format, frames)
        if arguments.weights:
            files += film_output.pictures_of(arguments.weights, "exr", frames)
    return files


def _mattes(source_recipe: Effect, folder: Path) -> list[Path]:
    """Return the paths of all files of the mattes in a recipe. Open each matte, to check that it can be read.

    Args:
        source_recipe: The recipe's effect.
        folder: The recipe's folder. Paths of mattes in the recipe are relative to it.

    Raises:
        MediaError: A matte is missing, cannot be read, or lacks the channel.
    """
    files = []
    for content in recipe.contents(source_recipe):
        with MatteFile(folder / content.path, content.channel).open() as matte:
            files += matte.files
    return files


def _save(scene: Scene, path: Path) -> None:
    """Save the open file to `path`, with paths relative to its folder, so that another machine can open it.

    Raises:
        OutputError: It could not be written completely. A file that was at `path` before is unchanged then.
    """
    try:
        film_output.make_folder(path.parent)
        with atomic_write.writing(path) as part:
            with film_output.quiet(), _paths_relative(scene, path.parent):
                bpy.ops.wm.save_as_mainfile(filepath=str(part), compress=True, copy=True, relative_remap=False)
            if not is_whole_blend(part):
                raise film_output.OutputError(f"{path}: could not be saved whole; {why_short(part.parent)}")
    except RuntimeError as error:
        raise film_output.OutputError(f"{path}: {film_output.message(error)}") from None
    except OSError as error:
        raise film_output.OutputError(f"{path}: {error.strerror or error}") from None


_PATHS = {"MOVIE": "filepath", "IMAGE": "directory", "SOUND": "filepath"}  # path property of each type of strip


def _paths_relative(scene: Scene, folder: Path) -> AbstractContextManager[None]:
    """Return a context manager in which paths of the scene's strips, images and output are relative to `folder`.

    Paths on another drive stay absolute. On exit, all paths are restored.
    """
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
