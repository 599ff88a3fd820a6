"""Frames that are made from footage and kept as files: mattes of outlines, and vectors of moments.

One rule holds for their folders: we choose the names, no link is followed, and nothing else is opened or removed. What
a frame is made of is in the name of its file, or of the folder; so what changes gets another one.
"""

from __future__ import annotations

import hashlib
import json
import stat
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from OpenImageIO import ImageInput, ImageSpec, geterror

from ..core.frames.frame_source import FrameSource
from .errors import MediaError
from .files import check_name

WHOLE = 8 << 20  # bytes; files of a source up to this size, such as uncompressed 8-bit HD pictures, are hashed whole
BLOCKS, BLOCK = 16, 4096  # of a larger file so many blocks, of so many bytes each, are hashed
_LARGER = 1 << 20  # bytes; a file that is larger than its samples by more holds something else

_SHAPE = (
    *("x", "y", "z", "width", "height", "depth", "full_x", "full_y", "full_width", "full_height"),
    *("nchannels", "channelnames", "format", "channelformats", "deep"),
)


def identity(source: FrameSource) -> dict:
    """What tells a source from others, wherever its files lie: their content, and how they are read. A change in a
    file larger than 8 MiB goes unnoticed if it keeps the size and 16 blocks of 4 KiB.

    MediaError: a file is gone."""
    content = hashlib.sha256()
    for path in source.files:
        content.update(content_digest(path))
    return {
        "content": content.hexdigest(),
        "count": source.count,
        "size": [source.width, source.height],
        "dtype": source.dtype.name,
        "transfer": source.transfer,
        "alpha": source.alpha,
        "options": source.options,
    }


def key(made_of: dict) -> str:
    """What a name has of what is made of that."""
    return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()[:12]


def content_digest(path: Path, whole: int = WHOLE) -> bytes:
    """32 bytes that tell a file's content from others'; `identity` has the same of a source's files.

    whole: files of more bytes are told by their size and by blocks spread over them. MediaError: it is gone."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):  # a pipe would never end
            raise MediaError(f"{path.name}: is no file")
        return content_hash(path, status.st_size, status.st_mtime_ns, whole)
    except OSError as error:
        raise MediaError(f"{path.name}: cannot be read ({error.strerror})") from None


@lru_cache(maxsize=1 << 17)  # a sequence of an hour and a half
def content_hash(path: Path, size: int, _mtime: int, whole: int) -> bytes:
    """The SHA-256 of a file's content; of a file over `whole`, that of its size and of blocks spread over it."""
    with path.open("rb") as file:
        if size <= whole:
            return hashlib.file_digest(file, "sha256").digest()
        digest = hashlib.sha256(str(size).encode())
        for block in range(BLOCKS):
            file.seek(max(size - BLOCK, 0) * block // (BLOCKS - 1))
            digest.update(file.read(BLOCK))
        return digest.digest()


def is_kept(path: Path) -> bool:
    """Whether a frame's file is there, which is not opened. A link is none."""
    return _bytes(path) is not None


def _bytes(path: Path) -> int | None:
    with suppress(OSError):
        status = path.lstat()
        return status.st_size if stat.S_ISREG(status.st_mode) else None
    return None


def opened(path: Path, spec: ImageSpec) -> ImageInput | None:
    """A frame's opened file. None: it is not there, is damaged, or has not exactly the size and samples of `spec`, as
    a file that somebody else has put there may have millions of pixels."""
    size = _bytes(path)
    if size is None or size > 2 * spec.image_bytes() + _LARGER:
        return None
    wishes = ImageSpec()
    wishes.attribute("oiio:UnassociatedAlpha", 1)  # no premultiplication on reading
    image = ImageInput.open(check_name(path), wishes)
    with suppress(UnicodeDecodeError):  # of names and errors in a damaged file
        if image is None:
            geterror()
        elif all(getattr(image.spec(), name) == getattr(spec, name) for name in _SHAPE):
            return image
    if image is not None:
        image.close()
    return None
