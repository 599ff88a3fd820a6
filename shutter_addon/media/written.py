"""Checks of written files: a full disk leaves them short, and Blender does not always say so."""

from pathlib import Path

import OpenImageIO

from .files import check_name

_PNG_END = b"IEND\xaeB`\x82"


def is_whole_picture(path: Path) -> bool:
    """Whether a PNG or EXR file is complete, by its end alone."""
    if path.suffix.lower() == ".png":
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - len(_PNG_END)))
            return file.read() == _PNG_END
    image = OpenImageIO.ImageInput.open(check_name(path))
    if image is None:
        return False
    spec = image.spec()
    last = image.read_scanline(spec.y + spec.height - 1, 0, "half")
    image.close()
    return last is not None


def is_whole_movie(path: Path, count: int) -> bool:
    """Whether a movie holds that many pictures, without decoding them; without PyAV, whether there is anything."""
    try:
        import av
    except ImportError:
        return path.is_file() and path.stat().st_size > 0
    try:
        with av.open(str(path)) as container:
            return sum(packet.size > 0 for packet in container.demux(video=0)) >= count
    except (av.error.FFmpegError, IndexError):
        return False
