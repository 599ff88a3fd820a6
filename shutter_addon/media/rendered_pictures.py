"""Check files that were written: whether they are complete, and which edit a rendered picture belongs to.

Blender does not always report a full disk.
"""

import struct
import zlib
from contextlib import closing, suppress
from pathlib import Path
from typing import NamedTuple

from OpenImageIO import ImageInput, geterror

from ..core.farm import job_file
from .files import check_name, pyav_missing

UNKNOWN = "the cause is unknown"  # why a file is cut off
_BLEND_END = 32  # bytes of the last block
_ZSTD_TABLE_END = b"\xb1\xea\x92\x8f"
_SIGNATURE = b"\x89PNG\r\n\x1a\n"


class RenderedPicture(NamedTuple):
    """The properties of a rendered picture.

    Attributes:
        size: (width, height) in pixels.
        channels: The number of channels.
        samples: The type of samples as OpenImageIO names it, such as "uint16".
        edit: The key of the version of the edit that the picture is from (job_file.key_in), found in its metadata.
            None: it has none.
    """

    size: tuple[int, int]
    channels: int
    samples: str
    edit: str | None


def read(path: Path, edit: str | None = None) -> RenderedPicture | None:
    """Return the properties of a PNG or EXR file, if it exists and is complete.

    A PNG is checked by its checksums. An EXR is decoded, which finds missing data; damaged data are found with
    certainty only with ZIP and ZIPS compression, which have checksums.

    Args:
        path: The file.
        edit: The key of the edit's version that the picture must be from. None: any.

    Returns:
        The properties. None: the file is missing, damaged or from another version of the edit.
    """
    image = ImageInput.open(check_name(path)) if path.is_file() else None
    if image is None:
        geterror()
        return None
    with closing(image), suppress(OSError, UnicodeDecodeError):  # UnicodeDecodeError: of names in a damaged file
        spec = image.spec()
        key = job_file.key_in(spec.get_string_attribute("Note"))
        if edit not in (None, key):
            return None
        is_png = path.suffix.lower() == ".png"
        if _is_sound_png(path) if is_png else image.read_image(spec.format) is not None:
            size = spec.width, spec.height
            return RenderedPicture(size=size, channels=spec.nchannels, samples=str(spec.format), edit=key)
    return None


def is_transparent(path: Path) -> bool:
    """Return whether a picture file has a pixel that is not opaque. Its last channel is taken for alpha.

    If it cannot be read, return False.
    """
    image = ImageInput.open(check_name(path))
    last = image.spec().nchannels - 1 if image else 0
    alpha = image.read_image(0, 0, last, last + 1, "float") if image else None
    return alpha is not None and bool(alpha.min() < 1)


def _is_sound_png(path: Path) -> bool:
    """Return whether a file is a complete PNG whose chunks match their checksums."""
    data, place, name = memoryview(path.read_bytes()), len(_SIGNATURE), b""
    if data[:place] != _SIGNATURE:
        return False
    while name != b"IEND":
        if len(data) < place + 8:
            return False
        length, name = struct.unpack_from(">I4s", data, place)
        end = place + 8 + length
        if data[end : end + 4] != zlib.crc32(data[place + 4 : end]).to_bytes(4):
            return False
        place = end + 4
    return True


def is_whole_picture(path: Path) -> bool:
    """Return whether a PNG or EXR file is complete: a PNG by its checksums, an EXR by its last row."""
    if path.suffix.lower() == ".png":
        return _is_sound_png(path)
    image = ImageInput.open(check_name(path))
    if image is None:
        return False
    with closing(image):
        spec = image.spec()
        return image.read_scanline(spec.y + spec.height - 1, 0, "half") is not None


def is_whole_movie(path: Path, count: int) -> bool:
    """Return whether a movie file has at least `count` pictures, without decoding them.

    Without PyAV, return whether the file is not empty.
    """
    if pyav_missing():
        return path.is_file() and path.stat().st_size > 0
    return whole_pictures(path) >= count


def whole_pictures(path: Path) -> int:
    """Return how many pictures a movie file has, without decoding them. 0: it cannot be read, or PyAV is missing."""
    if pyav_missing():
        return 0
    import av

    try:
        with av.open(str(path)) as container:
            return sum(packet.size > 0 for packet in container.demux(video=0))
    except (av.error.FFmpegError, IndexError):
        return 0


def is_whole_blend(path: Path) -> bool:
    """Return whether a .blend file is complete, by its last block or, if compressed, by the table at its end."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - _BLEND_END))
        end = file.read()
    return b"ENDB" in end or end.endswith(_ZSTD_TABLE_END)


def why_short(folder: Path) -> str:
    """Return why files in a folder may be cut off, such as a full disk: the error of writing another file there."""
    probe = folder / "probe"
    try:
        probe.write_bytes(bytes(1 << 20))
    except OSError as error:
        return (error.strerror or str(error)).lower()
    finally:
        with suppress(OSError):
            probe.unlink(missing_ok=True)
    return UNKNOWN
