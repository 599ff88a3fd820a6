"""Checks of media files, their names and sizes, for movies and image sequences, and whether PyAV is there."""

import os
from functools import cache
from pathlib import Path

from ..core.frames.frame_source import FrameSource
from ..core.messages import MediaError

PIXELS = 1 << 28  # 16384×16384, FFmpeg's limit; a damaged header may claim any size
FOREIGN = "an image of a kind that Blender does not read; save it as PNG, TIFF or EXR first"

MODEL = Path(__file__).resolve().parents[2] / "models" / "u2netp.onnx"  # the network that finds subjects


@cache
def pyav_missing() -> str:
    """Return why PyAV cannot be imported (Python's message), or "" if it can.

    The zip without binary packages lacks it. A second Blender then decodes movies (blender_movie).
    """
    try:
        from .movie import MovieSource  # noqa: F401
    except ImportError as error:
        return str(error)
    return ""


def check_file(path: str | Path) -> Path:
    """Check that a path is an existing file that is not empty, and return the path.

    Raises:
        MediaError: It is missing, empty, a folder, a pipe or a device.
    """
    path = Path(path)
    if path.is_dir():
        raise MediaError(f"{path.name}: is a folder, not a file")
    if not path.exists():
        raise MediaError(f"{path.name}: no such file in {path.absolute().parent}")
    if not path.is_file():  # opening a pipe may never return
        raise MediaError(f"{path.name}: is no file, but a pipe, a socket or a device")
    if path.stat().st_size == 0:
        raise MediaError(f"{path.name}: file is empty")
    return path


def stamp(path: str | Path) -> tuple[int, int] | None:
    """Return a file's or folder's time of change and size, to notice when it changes. None: nothing is there."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):  # a name with a null character
        return None
    return status.st_mtime_ns, status.st_size


def check_sound(path: str | Path) -> None:
    """Check that a file has sound. Without PyAV this cannot be known, and any existing, non-empty file passes.

    Raises:
        MediaError: The file is missing or unreadable, or has no sound.
    """
    path = check_file(path)
    if pyav_missing():
        return
    import av

    try:
        with av.open(check_name(path)) as container:
            has_sound = bool(container.streams.audio)
    except (av.error.FFmpegError, IndexError):
        has_sound = False
    if not has_sound:
        raise MediaError(f"{path.name}: has no sound, or cannot be read")


def check_name(path: str | Path) -> str:
    """Return a path as text, as OpenImageIO and Blender need it.

    Raises:
        MediaError: The path is not UTF-8.
    """
    name = os.fspath(path)
    try:
        name.encode()
    except UnicodeEncodeError:
        sentence = "its path is not UTF-8; rename the file, or the folder that is not"
        raise MediaError(f"{name}: {sentence}") from None
    return name


def check_size(name: str, width: int, height: int) -> None:
    """Check the size of a picture in pixels.

    Args:
        name: The file's, for the message.
        width, height: The size.

    Raises:
        MediaError: It has no pixels, or more than PIXELS.
    """
    if not 0 < width * height <= PIXELS:
        raise MediaError(f"{name}: {width}×{height} are too many pixels, or none; up to 16384×16384 can be read")


def check_index(source: FrameSource, index: int) -> None:
    """Raise IndexError unless the source has a frame with this index."""
    if not 0 <= index < source.count:
        raise IndexError(f"frame {index} of {source.path.name}: it has frames 0 to {source.count - 1}")
