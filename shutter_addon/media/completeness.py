"""Checks of written files: a full disk leaves them short, and Blender does not always say so."""

from contextlib import suppress
from pathlib import Path

import OpenImageIO

from . import pyav
from .files import check_name

UNKNOWN = "nothing says why"  # why a file is short
_PNG_END = b"IEND\xaeB`\x82"
_BLEND_END = 32  # bytes of its last block
_ZSTD_TABLE_END = b"\xb1\xea\x92\x8f"


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
    if pyav.missing():
        return path.is_file() and path.stat().st_size > 0
    return whole_pictures(path) >= count


def whole_pictures(path: Path) -> int:
    """How many pictures a movie holds, without decoding them; 0: it cannot be read, or PyAV is missing."""
    if pyav.missing():
        return 0
    import av

    try:
        with av.open(str(path)) as container:
            return sum(packet.size > 0 for packet in container.demux(video=0))
    except (av.error.FFmpegError, IndexError):
        return 0


def is_whole_blend(path: Path) -> bool:
    """Whether a .blend file is complete, by its end alone: its last block, or the table behind compressed ones."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - _BLEND_END))
        end = file.read()
    return b"ENDB" in end or end.endswith(_ZSTD_TABLE_END)


def why_short(folder: Path) -> str:
    """Why files in a folder may have been cut short: what the system says to another file there."""
    probe = folder / "probe"
    try:
        probe.write_bytes(bytes(1 << 20))
    except OSError as error:
        return (error.strerror or str(error)).lower()
    finally:
        with suppress(OSError):
            probe.unlink(missing_ok=True)
    return UNKNOWN
