"""Write films as movies or as folders of pictures, each file whole or not at all."""

import itertools
import os
import signal
import sys
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import bpy
from bpy.types import ImageFormatSettings, RenderSettings, Scene

from ...core import atomic_write
from ...core.messages import UserError, of_file
from ...media.rendered_pictures import is_whole_movie, is_whole_picture, whole_pictures, why_short
from ..data import requirements, strips
from ..data.property_copy import for_a_while
from ..rendering import render_job

INTERRUPTED = 130
Move = Callable[[Path, Path], object]  # moves a picture to its destination

# Suffix: container, codec, audio codec (Blender's names).
MOVIES = {
    ".mp4": ("MPEG4", "H264", "AAC"),
    ".mov": ("QUICKTIME", "H264", "AAC"),
    ".mkv": ("MKV", "H264", "AAC"),
    ".webm": ("WEBM", "WEBM", "OPUS"),
    ".avi": ("AVI", "MPEG4", "MP3"),
}


FORMATS = {"png": ("PNG", "16"), "exr": ("OPEN_EXR", "32")}  # Blender's name and bits per sample

# Metadata about the render itself. A frame's number would have as many digits as the range's last.
_STAMPS = (
    *("use_stamp_frame", "use_stamp_frame_range"),
    *("use_stamp_date", "use_stamp_time", "use_stamp_render_time", "use_stamp_memory", "use_stamp_hostname"),
    *("use_stamp_filename", "use_stamp_sequencer_strip"),
)


class OutputError(UserError, ValueError):
    """A film cannot be written. The message is one sentence for the user."""


class InterruptedRenderError(OutputError):
    """The work was stopped from outside, as by Ctrl-C. The message names the output, and what is kept of a movie."""


def is_movie(path: Path) -> bool:
    return path.suffix.lower() in MOVIES


def size(scene: Scene) -> tuple[int, int]:
    """Return width and height in pixels of the pictures that Blender renders of a scene."""
    render = scene.render
    return tuple(n * render.resolution_percentage // 100 for n in (render.resolution_x, render.resolution_y))


def check(path: Path, file_format: str | None, size: tuple[int, int]) -> None:
    """Check that Blender can write a film of this size to such a path. Whether it may write there is not tried.

    Args:
        path: A movie, or a folder of pictures.
        file_format: The option --format, which only a folder may have; None: not given.
        size: Width and height of the pictures in pixels.

    Raises:
        OutputError: The size, the path or the option does not fit.
    """
    width, height = size
    if width < 4 or height < 4:
        raise OutputError(f"the source has {width}×{height} pixels; Blender renders no picture smaller than 4×4")
    if is_movie(path):
        if path.is_dir():
            raise OutputError(f"{path}: is a folder, not a movie")
        if file_format is not None:
            raise OutputError(f"{path}: --format is for a folder of pictures, not for a movie")
        if width % 2 or height % 2:
            raise OutputError(f"{path}: a movie has even sizes, not {width}×{height}; render to a folder of pictures")
    else:
        check_folder(path, file_format)


def check_folder(path: Path, file_format: str | None) -> None:
    """Check that a path can be meant as a folder of pictures: it is a folder, or has no suffix as files have.

    Args:
        file_format: The option --format, with which any path is a folder; None: not given.

    Raises:
        OutputError: The path looks like a file of another kind.
    """
    if path.suffix.strip(".") and not path.is_dir() and file_format is None:
        raise OutputError(f"{path}: neither a folder nor one of {', '.join(MOVIES)}")


def check_movie(output: Path, read: list[Path]) -> None:
    """Check that a path can be that of a new movie.

    Args:
        read: Files that must not be overwritten.

    Raises:
        OutputError: It has no movie's suffix, contains a backslash that is no separator, or is one of `read`.
    """
    if not is_movie(output):
        raise OutputError(f"{output}: none of {', '.join(MOVIES)}")
    blender_path(str(output))
    refuse_overwriting([output], read)


def check_writable(folder: Path) -> None:
    """Check that files can be written to a folder, or if it is missing, to the first folder above that exists.

    Raises:
        OutputError: Files cannot be written there.
    """
    place = next(path for path in (folder, *folder.parents) if path.exists())
    if not place.is_dir():
        raise OutputError(f"{place}: is a file, not a folder")
    try:
        with atomic_write.part_folder(place):  # permissions and mounts do not always tell
            pass
    except OSError as error:
        raise OutputError(f"{place}: {error.strerror or error}") from None


def refuse_overwriting(written: Iterable[Path], read: Collection[Path]) -> None:
    """Check that no file will be written twice or over one that is read, also through links.

    Args:
        written: Files that will be written.
        read: Files that will be read.

    Raises:
        OutputError: A file would be written twice, or over one of `read`.
    """
    taken = {_identity(path): path for path in read}
    places = set()
    for path in written:
        place = os.path.realpath(path)
        if place in places:
            raise OutputError(f"{path}: two files cannot have the same place")
        places.add(place)
        if (other := taken.get(_identity(path))) is not None:
            raise OutputError(f"{path}: would be written over {other}, which is read; choose another place")


def _identity(path: Path) -> tuple[int, int] | str:
    """Return a value that is equal for all paths that lead to the same file, or to the same place of a missing file."""
    try:
        status = os.stat(path)
    except OSError:
        return os.path.realpath(path)
    return status.st_dev, status.st_ino


def pictures_of(folder: Path, ending: str, frames: range) -> list[Path]:
    """Return the paths of a film's pictures in a folder, one for each frame, such as 0001.png for frame 1."""
    return [folder / f"{frame:04d}.{ending}" for frame in frames]


def blender_path(path: str) -> str:
    """Return a path with its braces doubled, since Blender takes single ones for template fields.

    Raises:
        OutputError: The path contains a backslash that is no separator: Blender cannot write there.
    """
    if os.sep == "/" and "\\" in path:
        raise OutputError(f"{path}: Blender cannot write to a path with \\")
    return path.replace("{", "{{").replace("}", "}}")


def set_output(scene: Scene, path: Path, file_format: str, *, alpha: bool) -> None:
    """Set a scene's output to a path and choose the formats: a movie by its suffix, else a folder of pictures.

    Args:
        path: A movie, or a folder of pictures that are named by frame.
        file_format: A key of FORMATS, for pictures.
        alpha: Whether pictures keep the source's transparency.

    Raises:
        OutputError: Blender cannot write there.
    """
    settings, render = scene.render.image_settings, scene.render
    set_place(render, path)
    if is_movie(path):
        container, codec, audio = MOVIES[path.suffix.lower()]
        settings.media_type = "VIDEO"
        settings.color_mode = "RGB"
        render.ffmpeg.format, render.ffmpeg.codec = container, codec
        shown_strips = (strip for shown in requirements.shown_scenes(scene) for strip in strips.all_strips(shown))
        render.ffmpeg.audio_codec = audio if any(strip.type == "SOUND" for strip in shown_strips) else "NONE"
        render.ffmpeg.constant_rate_factor = "HIGH"
        return
    _set_format(settings, file_format)
    settings.color_mode = "RGBA" if alpha else "RGB"


def set_place(render: RenderSettings, path: Path) -> None:
    """Set the path of the output, and turn off metadata about the render.

    Raises:
        OutputError: Blender cannot write there.
    """
    render.use_file_extension = not is_movie(path)
    _stamp_nothing(render)
    render.filepath = blender_path(str(path) if is_movie(path) else f"{path}{os.sep}")


def set_pictures(scene: Scene, file_format: str, note: str) -> None:
    """Set a scene's output to pictures of every frame, with the edit's color settings and a note in their metadata.

    Pictures have no note if the edit burns metadata into them.

    Args:
        file_format: A key of FORMATS.
        note: Text by which the pictures are recognized later.
    """
    settings, render = scene.render.image_settings, scene.render
    settings.media_type = "IMAGE"
    _set_format(settings, file_format)
    render.use_file_extension = render.use_overwrite = True
    render.use_placeholder = False
    scene.frame_step = 1
    if not render.use_stamp:  # burnt in metadata stays
        _stamp_nothing(render)
        render.use_stamp_note, render.stamp_note_text = True, note


def _set_format(settings: ImageFormatSettings, file_format: str) -> None:
    settings.file_format, settings.color_depth = FORMATS[file_format]
    if file_format == "exr":
        settings.exr_codec = "ZIP"  # lossless, with checksums that reveal damaged files


def _stamp_nothing(render: RenderSettings) -> None:
    """Keep date, host and the like out of pictures' metadata, so that equal pixels give equal files."""
    for name in _STAMPS:
        setattr(render, name, False)


def render_made_edit(scene: Scene, output: Path) -> None:
    """Render an edit that render_command.make_edit has made to a movie or a folder of pictures, with a progress bar.

    Raises:
        OutputError: It cannot be rendered or written. Finished pictures stay, and the finished part of a movie under
            another name.
        InterruptedRenderError: The same, after Ctrl-C or a farm's TERM.
    """
    make_folder(output.parent if is_movie(output) else output)
    # Mute sources, which their effects cover completely. Blender takes Scene strips for transparent: it would decode
    # the source and blend, 2/5 of its work.
    hidden = [(each.source, "mute", True) for each in strips.with_sources(scene)]
    with progress(scene.frame_end - scene.frame_start + 1, "frame") as moved, for_a_while(hidden):
        render_frames(scene, output, moved)


def render_frames(scene: Scene, output: Path, moved: Callable[[], None], move: Move = Path.replace) -> None:
    """Render an edit's frames to a movie, or to pictures of FORMATS in a folder that exists, by its settings.

    Blender writes into a part folder beside the files, from which finished ones are moved.

    Args:
        output: The movie or the folder.
        moved: Called after each frame. If it raises UserError or OSError, the render ends.
        move: Called with a finished picture and its final path, to move the picture there. It may raise the same.

    Raises:
        OutputError, InterruptedRenderError: As in `render_made_edit`.
        OSError: The part folder cannot be made, or the movie cannot be moved.
    """
    is_film = is_movie(output)
    faults: list[str] = []
    with atomic_write.part_folder(output.parent if is_film else output) as part:
        part_film = part / f"film{output.suffix}"
        place = blender_path(str(part_film) if is_film else f"{part}{os.sep}")
        try:
            with (
                for_a_while([(scene.render, "filepath", place), (render_job.job, "tell", faults.append)]),
                stoppable() as stopped,
                quiet(),
                # Each frame is rendered once, and caches would take gigabytes.
                for_a_while((scene.sequence_editor, name, False) for name in ("use_cache_raw", "use_cache_final")),
                _moved(part, output, scene, moved, move) as missing,
            ):
                bpy.ops.render.render(animation=True, scene=scene.name)
        except RuntimeError as error:
            raise OutputError(f"{output}: {message(error)}") from None
        rescued = _rescued(part_film, output) if is_film and (faults or stopped) else ""
        if faults:
            raise OutputError(faults[0] + rescued)
        if stopped:
            raise InterruptedRenderError(f"{output}: stopped{rescued}")
        if missing:
            raise OutputError(f"{output}: {len(missing)} frames were not written; {why_short(part)}")
        if is_film:
            count = len(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
            if not is_whole_movie(part_film, count):
                raise OutputError(f"{output}: could not be written whole ({why_short(part)})")
            part_film.replace(output)


def make_folder(folder: Path) -> None:
    """Make a folder if it is missing, and remove part folders in it that killed processes left (atomic_write.clear_up).

    Raises:
        OSError: The folder cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    atomic_write.clear_up(folder)


def _rescued(part: Path, output: Path) -> str:
    """Keep the finished part of a movie beside its output, under a new name.

    Returns:
        The end of an error message, with the number of frames and the name; "": no frame is finished, PyAV is missing,
        or the file cannot be moved.
    """
    count = whole_pictures(part)
    if count == 0:
        return ""
    numbers = (f"-{number}" if number > 1 else "" for number in itertools.count(1))
    names = (output.with_name(f"{output.stem}.part{number}{output.suffix}") for number in numbers)
    kept = next(path for path in names if not os.path.lexists(path))
    try:
        part.replace(kept)
    except OSError:  # the message is about another error
        return ""
    return f"; its first {count} frames are in {kept.name}"


def message(error: RuntimeError) -> str:
    """Return the text of an error that Blender raised, on one line, without "Error: "."""
    return " ".join(str(error).removeprefix("Error: ").split())


@contextmanager
def _moved(part: Path, output: Path, scene: Scene, update: Callable[[], None], move: Move) -> Iterator[dict[str, Path]]:
    """Move finished pictures from the folder `part` to `output` after each frame, within a `with` block.

    If `update` or `move` raises UserError or OSError, or a picture is damaged, the render ends.

    Args:
        update: Called after each frame.
        move: Called with a finished picture and its final path.

    Yields:
        A dictionary of the final paths of pictures that are not moved yet, by file name. It shrinks during the render,
        and is empty for a movie.
    """
    frames = range(scene.frame_start, scene.frame_end + 1)
    settings = scene.render.image_settings
    ending = next((name for name, (kind, _bits) in FORMATS.items() if settings.file_format == kind), "")
    missing = {path.name: path for path in pictures_of(output, ending, frames)} if ending else {}

    def moved(*_) -> None:
        try:
            update()
            os.utime(part)  # a movie's encoder may pause for long: keep others from taking the folder for abandoned
            for name in [path.name for path in part.iterdir() if path.name in missing]:
                if not is_whole_picture(part / name):
                    raise OutputError(f"{output / name}: could not be written whole; {why_short(part)}")
                move(part / name, missing.pop(name))
        except (UserError, OSError) as error:
            render_job.fail(of_file(error, output))

    with render_job.calling(bpy.app.handlers.render_write, moved):
        yield missing


@contextmanager
def progress(count: int, unit: str) -> Iterator[Callable]:
    """Show a progress bar on a terminal within a `with` block.

    Args:
        count: Number of steps until the bar is full.
        unit: Name of a step, shown beside the bar.

    Yields:
        A function that advances the bar, by one step or by its argument.
    """
    try:
        from tqdm import tqdm
    except ImportError:  # the extension was copied without its wheels
        yield lambda _count=1: None
        return
    with tqdm(total=count, unit=unit, disable=None) as bar:
        yield bar.update


@contextmanager
def stoppable() -> Iterator[list[int]]:
    """End the render after the current frame on Ctrl-C or a farm's TERM, within a `with` block.

    So movie files are closed properly. A second signal ends the process at once. No exception passes through Blender,
    which would print it and render on.

    Yields:
        A list to which the signal's number is added.
    """
    signals: list[int] = []

    def stop(number: int, _frame: object) -> None:
        if signals:
            render_job.leave(INTERRUPTED)
        signals.append(number)
        render_job.job.stopping = True

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield signals
    finally:
        for number, handler in before.items():
            signal.signal(number, handler or signal.SIG_DFL)  # None: Blender's own, which Python cannot restore


@contextmanager
def quiet() -> Iterator[None]:
    """Keep Blender's log of every saved frame off the terminal within a `with` block. Errors are still raised."""
    if sys.stdout is not None:
        with suppress(OSError):  # the reader has gone
            sys.stdout.flush()
    terminal, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(terminal, 1)
        os.close(terminal)
        os.close(nothing)
