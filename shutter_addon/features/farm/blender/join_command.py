"""The command `join`: make a movie of frames that were rendered before, with the edit's sound and settings."""

import re
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path

from bpy.types import ImageFormatSettings, Scene

from ....blender.commands import command_line
from ....blender.data import external_files, sole_effect, strips, versions
from ....blender.output import film_output
from ....blender.output.film_output import OutputError
from ....core import threads
from ....core.farm import job_file
from ....core.frames import frame_ranges
from ....media import rendered_pictures
from ....media.rendered_pictures import RenderedPicture

HELP = "make a movie of rendered frames, with the edit's sound and settings"


def add(parser: ArgumentParser) -> None:
    option, to_path = parser.add_argument, command_line.to_path
    option("folder", metavar="FRAMES", type=to_path, help="the folder of the frames")
    option("--edit", type=to_path, required=True, metavar="FILE.blend", help="the edit that they were rendered from")
    option("--output", type=to_path, required=True, help=f"a movie ({', '.join(film_output.MOVIES)})")
    option("--frames", metavar="A:B", help="timeline frames A to B (default: all of the edit)")


def run(arguments: Namespace) -> None:
    """Run the command `join`: make a movie of frames that were rendered to a folder. It is written whole or not at all.

    Args:
        arguments: The parsed command line (see `add`).

    Raises:
        UserError: The edit cannot be opened; a sound is missing; frames are missing, damaged, different or of another
            edit; or the movie cannot be written. InterruptedRenderError: stopped by Ctrl-C or TERM.
        OSError: A folder or the job file cannot be read, or a folder or the movie cannot be written.
    """
    scene, frames = command_line.open_edit(arguments.edit, arguments.frames)
    film_output.check_movie(arguments.output, [arguments.edit, *versions.read_files(scene)])
    for fault in external_files.sound_faults(scene, frames):
        raise OutputError(fault)  # Blender would make a silent film
    version = versions.of_edit(scene)
    job_file.guard(arguments.folder, version)
    scene.frame_start, scene.frame_end = frames[0], frames[-1]
    paths = _pictures(arguments.folder, frames[:: scene.frame_step])
    size = film_output.size(scene)
    film_output.check(arguments.output, None, size)
    with film_output.progress(len(paths), "picture") as looked:
        first = _common(paths, looked, size, version.key)
    _refuse_transparency(scene, paths, first)
    _cover_edit(scene, paths, first)
    _set_output(scene, arguments.output, size)
    film_output.make_folder(arguments.output.parent)
    with film_output.progress(len(paths), "frame") as moved:
        film_output.render_frames(scene, arguments.output, moved)


AT_ONCE = 1000  # pictures per strip: Blender copies all of them for each that is added


def _pictures(folder: Path, frames: range) -> list[Path]:
    """Find the picture file of each frame in a folder. The name of a file is the number of its frame, such as 0012.png.

    Returns:
        The files, in the order of `frames`.

    Raises:
        OutputError: One of `frames` is missing, or a frame has two files.
        OSError: The folder cannot be read.
    """
    pictures: dict[int, Path] = {}
    for path in sorted(path for path in folder.iterdir() if path.suffix[1:] in film_output.FORMATS):
        if re.fullmatch(r"\d{1,9}", path.stem):
            other = pictures.setdefault(int(path.stem), path)
            if other != path:
                raise OutputError(f"{folder}: {other.name} and {path.name} are the same frame")
    if missing := [frame for frame in frames if frame not in pictures]:
        raise OutputError(f"{folder}: lacks {frame_ranges.in_words(missing)}")
    return [pictures[frame] for frame in frames]


def _common(paths: list[Path], looked: Callable, size: tuple[int, int], key: str) -> RenderedPicture:
    """Read all pictures, check that they belong together, and return the properties that they share.

    Args:
        paths: The pictures.
        looked: Called after each picture has been read.
        size: The (width, height) that all must have.
        key: Key of the version of the edit. A picture whose metadata names a version must name this one.

    Returns:
        The properties, such as size, number of channels and sample type.

    Raises:
        OutputError: A picture is damaged, differs from the first one, or has another size or version.
    """
    pool = threads.pool()
    first: RenderedPicture | None = None
    try:
        for path, picture in zip(paths, pool.map(rendered_pictures.read, paths), strict=True):
            if picture is None:
                raise OutputError(f"{path}: is damaged or cut off")
            first = first or picture
            if picture != first or path.suffix != paths[0].suffix:
                raise OutputError(f"{path}: {_described(picture)}, unlike {paths[0].name}: {_described(first)}")
            looked()
    finally:
        pool.shutdown(cancel_futures=True)
    assert first is not None  # an edit has at least one frame
    if first.size != size or first.edit not in (None, key):
        wanted = "{}×{}, version {}".format(*size, key)
        raise OutputError(f"{paths[0]}: {_described(first)}, unlike the edit: {wanted}")
    return first


def _described(picture: RenderedPicture) -> str:
    words = "{}×{}, {} channels of {}".format(*picture.size, picture.channels, picture.samples)
    return f"{words}, version {picture.edit or 'unknown'}"


def _refuse_transparency(scene: Scene, paths: list[Path], first: RenderedPicture) -> None:
    """Refuse PNG files with transparent pixels if the movie would show these in other colors.

    Blender lays a picture over black and then applies the view transform. But the colors of these files have had it
    applied before, so this is wrong for any view transform other than Standard.

    Args:
        scene: The scene of the edit, which has the view transform.
        paths: The pictures. EXR files, and files without an alpha channel, pass.
        first: The properties that all pictures have in common.

    Raises:
        OutputError: A picture has a transparent pixel.
    """
    is_shown_otherwise = _shown(scene).view_settings.view_transform != "Standard"
    if paths[0].suffix == ".png" and first.channels in (2, 4) and is_shown_otherwise:
        for path in paths:
            if rendered_pictures.is_transparent(path):
                words = "is transparent, which a film shows otherwise under this view"
                raise OutputError(f"{path}: {words}; render EXR, or without transparency")


def _shown(scene: Scene) -> Scene | ImageFormatSettings:
    """Return the struct that has the display and view settings of the edit's output."""
    settings = scene.render.image_settings
    return settings if settings.color_management == "OVERRIDE" else scene


def _cover_edit(scene: Scene, paths: list[Path], first: RenderedPicture) -> None:
    """Add image strips with the rendered pictures above all other strips, so that only they are seen. Sounds stay.

    A picture is repeated if the scene's frame step leaves out frames. The color management is set to suit the files.

    Args:
        scene: The scene of the edit, whose range is to be covered.
        paths: The pictures, in the order of frames.
        first: The properties that all pictures have in common.

    Raises:
        OutputError: A strip lies in the uppermost channel, or the files are PNG and no view keeps their colors.
    """
    editor = scene.sequence_editor
    editor.display_stack(None)  # Blender renders the meta strip that was open when the file was saved
    channel = max((strip.channel for strip in editor.strips), default=0) + 1
    if channel > strips.CHANNELS:
        raise OutputError("the edit has strips in the uppermost channel, where the frames are to lie; move them down")
    editor.channels[channel].mute = False
    space = _keep_colours(scene, paths[0].suffix, first)
    shown = [path for path in paths for _ in range(scene.frame_step)][: scene.frame_end + 1 - scene.frame_start]
    for start in range(0, len(shown), AT_ONCE):
        part = shown[start : start + AT_ONCE]
        strip = editor.strips.new_image(part[0].name, str(part[0]), channel, scene.frame_start + start)
        for path in part[1:]:
            strip.elements.append(path.name)
        strip.blend_type = "REPLACE"
        strip.use_float = first.samples != "uint8" or first.channels in (2, 4)
        if space:
            strip.colorspace_settings.name = space


def _keep_colours(scene: Scene, suffix: str, first: RenderedPicture) -> str | None:
    """For PNG files, set the output's view so that the movie keeps their colors, which have the edit's view already.

    For EXR files, change nothing: they are scene-linear and get the edit's view.

    Args:
        scene: The scene of the edit. 8-bit files also turn off its dither, since they have been dithered.
        suffix: The suffix of the pictures, ".png" or ".exr".
        first: The properties that all pictures have in common.

    Returns:
        The color space to give to the files' strips; None for EXR files, for which Blender's own choice is right.

    Raises:
        OutputError: The color configuration has no view Standard, which PNG files need.
    """
    if suffix == ".exr":
        return None
    shown = _shown(scene)
    try:
        shown.view_settings.view_transform = "Standard"
    except TypeError:
        raise OutputError("PNG frames need the view Standard, which this OpenColorIO configuration lacks") from None
    for name, value in sole_effect.PLAIN_VIEW.items():
        setattr(shown.view_settings, name, value)
    if first.samples == "uint8":
        scene.render.dither_intensity = 0  # they are dithered already
    return shown.display_settings.display_device


def _set_output(scene: Scene, output: Path, size: tuple[int, int]) -> None:
    """Set the scene to render to a movie file of the pictures' size, without burnt-in metadata.

    If the edit's own output is a movie, its codec settings stay, and only the container follows the path's suffix.
    Otherwise those of film_output.set_output are used.

    Args:
        scene: The scene of the edit.
        output: Path of the movie.
        size: Width and height of the pictures.

    Raises:
        OutputError: Blender cannot write there.
    """
    render = scene.render
    if render.image_settings.media_type == "VIDEO":
        render.ffmpeg.format = film_output.MOVIES[output.suffix.lower()][0]
        render.ffmpeg.use_autosplit = False
        film_output.set_place(render, output)
    else:
        film_output.set_output(scene, output, "png", alpha=False)
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    render.use_stamp = render.use_stamp_note = False
