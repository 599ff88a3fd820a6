"""Where a film goes: a movie, or a folder of pictures; each file whole or not at all."""

import os
import shutil
import signal
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..media.written import is_whole_movie, is_whole_picture
from . import engine, strips

INTERRUPTED = 130

# Ending: container, codec, audio codec (Blender's names).
MOVIES = {
    ".mp4": ("MPEG4", "H264", "AAC"),
    ".mov": ("QUICKTIME", "H264", "AAC"),
    ".mkv": ("MKV", "H264", "AAC"),
    ".webm": ("WEBM", "WEBM", "OPUS"),
    ".avi": ("AVI", "MPEG4", "MP3"),
}
# Name: Blender's name, bits per channel.
FORMATS = {"png": ("PNG", "16"), "exr": ("OPEN_EXR", "32")}


class OutputError(ValueError):
    """This cannot be written; the message is one sentence for the user."""


def is_movie(path: Path) -> bool:
    return path.suffix.lower() in MOVIES


def check(path: Path, file_format: str | None, size) -> None:
    """OutputError: Blender cannot write a film of this size there. A new folder is made on the way."""
    width, height = size
    if width < 4 or height < 4:
        raise OutputError(f"the source has {width}×{height} pixels; Blender renders no picture smaller than 4×4")
    if is_movie(path):
        if file_format is not None:
            raise OutputError(f"{path}: --format is for a folder of pictures, not for a movie")
        if width % 2 or height % 2:
            raise OutputError(f"{path}: a movie has even sizes, not {width}×{height}; render to a folder of pictures")
    elif path.suffix and not path.is_dir() and file_format is None:
        raise OutputError(f"{path}: neither a folder nor one of {', '.join(MOVIES)}")


def set_output(edit, path: Path, file_format: str, *, alpha: bool) -> None:
    """Where and how the edit's render goes: a movie by its ending, else a folder of pictures named by frame.

    alpha: pictures keep the source's transparency."""
    settings, render = edit.render.image_settings, edit.render
    render.use_file_extension = not is_movie(path)
    if is_movie(path):
        container, codec, audio = MOVIES[path.suffix.lower()]
        settings.media_type = "VIDEO"
        settings.color_mode = "RGB"
        render.ffmpeg.format, render.ffmpeg.codec = container, codec
        has_sound = any(strip.type == "SOUND" for strip in edit.sequence_editor.strips_all)
        render.ffmpeg.audio_codec = audio if has_sound else "NONE"
        render.ffmpeg.constant_rate_factor = "HIGH"
        render.filepath = str(path)
        return
    settings.file_format, settings.color_depth = FORMATS[file_format]
    settings.color_mode = "RGBA" if alpha else "RGB"
    render.filepath = f"{path}{os.sep}"


def film(edit, output: Path) -> None:
    """Renders an edit of edits.make_edit to a movie or a folder. Blender writes into a folder beside the output, and
    what is finished moves out of it. OutputError: it cannot be written; finished pictures stay."""
    folder = output.parent if is_movie(output) else output
    folder.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=".part-", dir=folder))
    kept = edit.render.filepath
    edit.render.filepath = str(part / output.name) if is_movie(output) else f"{part}{os.sep}"
    count = edit.frame_end - edit.frame_start + 1

    def clean_up():
        shutil.rmtree(part, ignore_errors=True)

    try:
        with _leaving(clean_up), _quiet(), _lean(edit), _frames_moved(part, folder, count):
            bpy.ops.render.render(animation=True, scene=edit.name)
        if is_movie(output):
            if not is_whole_movie(part / output.name, count):
                raise OutputError(f"{output}: could not be written whole; is the disk full?")
            (part / output.name).replace(output)
    except RuntimeError as error:
        raise OutputError(f"{output}: {message(error)}") from None
    finally:
        edit.render.filepath = kept
        clean_up()


def message(error: RuntimeError) -> str:
    """What Blender reported, without its "Error: ", in one line."""
    return " ".join(str(error).removeprefix("Error: ").split())


@contextmanager
def _frames_moved(part: Path, folder: Path, count: int):
    """Moves each finished picture from `part` to `folder`, and a progress bar on."""
    with progress(count, "frame") as update:

        def moved(*_):
            update()
            for path in part.iterdir():
                if is_movie(path):
                    continue
                if not is_whole_picture(path):
                    engine.refuse(f"{folder / path.name}: could not be written whole; is the disk full?")
                path.replace(folder / path.name)

        bpy.app.handlers.render_write.append(moved)
        try:
            yield
        finally:
            bpy.app.handlers.render_write.remove(moved)


@contextmanager
def progress(count: int, unit: str):
    """A progress bar on a terminal; gives what moves it on by one."""
    try:
        from tqdm import tqdm
    except ImportError:  # a Blender that the extension was copied into without its wheels
        yield lambda: None
        return
    with tqdm(total=count, unit=unit, disable=None) as bar:
        yield bar.update


@contextmanager
def _leaving(clean_up):
    """Whatever ends the process inside Blender's render cleans up: no picture, Ctrl-C, a farm's TERM.

    No exception gets through Blender: it prints it and renders on."""
    stops = {signal.SIGINT: None, signal.SIGTERM: None}
    for number in stops:
        stops[number] = signal.signal(number, lambda *_: engine.leave(INTERRUPTED))
    engine.before_leaving.append(clean_up)
    try:
        yield
    finally:
        engine.before_leaving.remove(clean_up)
        for number, before in stops.items():
            signal.signal(number, before or signal.SIG_DFL)  # None: Blender's own, which Python cannot put back


@contextmanager
def _lean(edit):
    """Spares Blender what no frame shows.

    Each frame is rendered once: finished ones would fill gigabytes. And the source lies wholly below its effect, but
    Blender takes any Scene strip for transparent: it would decode the source and blend the two, 2/5 of all its work.
    """
    editor = edit.sequence_editor
    kept = editor.use_cache_raw, editor.use_cache_final
    shown = [strip for name in strips.shown_sources(edit) if not (strip := editor.strips_all[name]).mute]
    editor.use_cache_raw = editor.use_cache_final = False
    for strip in shown:
        strip.mute = True
    try:
        yield
    finally:
        editor.use_cache_raw, editor.use_cache_final = kept
        for strip in shown:
            strip.mute = False


@contextmanager
def _quiet():
    """Keeps Blender's log of every saved frame off the terminal; what goes wrong comes as an exception."""
    sys.stdout.flush()
    terminal, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(terminal, 1)
        os.close(terminal)
        os.close(nothing)
