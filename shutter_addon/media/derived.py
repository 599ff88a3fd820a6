"""Files that are made from footage and kept: mattes of outlines, and vectors of optical flow.

In their folders, only files with the extension's own names are opened or removed, and links are never followed. The
name of a file, or of its folder, has a hash of everything that the file is made from. So after a change, another file
is used.
"""

from __future__ import annotations

import errno
import hashlib
import json
import stat
from contextlib import closing, suppress
from functools import lru_cache
from pathlib import Path

import numpy as np
from OpenImageIO import ImageInput, ImageSpec, geterror

from ..core import atomic_write
from ..core.frames.frame_source import STEP, FrameSource
from ..core.messages import MediaError
from . import flow
from .files import check_name
from .image_writing import write_exr

VECTORS = "virtual_shutter_vectors"  # the folder of StoredVectors
MATTES = "virtual_shutter_mattes"  # the folder of carried mattes
WHOLE = 8 << 20  # bytes; files of a source up to this size, such as uncompressed 8-bit HD pictures, are hashed whole
BLOCKS, BLOCK = 16, 4096  # how many blocks of a larger file are hashed, and the bytes of each
_LARGER = 1 << 20  # bytes; a file of ours is not larger than twice its samples plus this

_CHANNELS = tuple(f"value{k}" for k in range(6))  # of a file of vectors

_SHAPE = "roi", "roi_full", "channelnames", "format", "channelformats", "deep"


def identity(source: FrameSource) -> dict:
    """Describe footage by the content of its files and the way they are read, but not by their names or folders.

    Its `key` names the folder of files made from the footage, so they are found again after the footage has moved. Of a
    file with more than WHOLE bytes, only the size and some blocks count, so a change elsewhere in it goes unnoticed.

    Returns:
        Values that JSON can store, an argument for `key`.

    Raises:
        MediaError: A file is missing or cannot be read.
    """
    content = hashlib.sha256()
    for path in source.files:
        content.update(content_digest(path))
    known = {name: getattr(source, name) for name in ("count", "transfer", "alpha", "options")}
    return known | {"content": content.hexdigest(), "size": [source.width, source.height], "dtype": source.dtype.name}


def key(made_of: dict) -> str:
    """Return a short hash for the name of a file that is made from other data: 12 hexadecimal digits.

    Args:
        made_of: Everything that the file's content depends on, as values that JSON can store. Equal ones give equal
            hashes.
    """
    return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()[:12]


def content_digest(path: Path, whole: int = WHOLE) -> bytes:
    """Return a hash of a file's content, 32 bytes.

    Args:
        path: The file.
        whole: The most bytes of a file that is hashed completely. Of a larger file, the hash covers only the size and
            BLOCKS blocks, spread evenly over it.

    Raises:
        MediaError: The file is missing, cannot be read or is no regular file.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):  # a pipe would never end
            raise MediaError(f"{path.name}: is no file")
        return _hash(path, status.st_size, status.st_mtime_ns, whole)
    except OSError as error:
        raise MediaError(f"{path.name}: cannot be read ({error.strerror})") from None


@lru_cache(maxsize=1 << 17)  # a sequence of an hour and a half
def _hash(path: Path, size: int, _mtime: int, whole: int) -> bytes:
    """Return the SHA-256 of a file's content or, above `whole` bytes, of its size and of blocks spread over it.

    Results are cached: a file is read again only if its size or the time of its last change differs.

    Args:
        path: The file.
        size: Its size in bytes.
        _mtime: The time of its last change in nanoseconds.
        whole: The most bytes of a file that is hashed completely.
    """
    with path.open("rb") as file:
        if size <= whole:
            return hashlib.file_digest(file, "sha256").digest()
        digest = hashlib.sha256(str(size).encode())
        for block in range(BLOCKS):
            file.seek(max(size - BLOCK, 0) * block // (BLOCKS - 1))
            digest.update(file.read(BLOCK))
        return digest.digest()


def size_of(path: Path) -> int | None:
    """Return the size of a file in bytes without opening it, or None if there is no file. A link is no file."""
    with suppress(OSError):
        status = path.lstat()
        return status.st_size if stat.S_ISREG(status.st_mode) else None
    return None


def opened(path: Path, spec: ImageSpec) -> ImageInput | None:
    """Open a picture file that the extension has written earlier, but only if its header is as expected.

    Args:
        path: The file.
        spec: The size, channels and sample type that the file must have. Without this check, a file that somebody else
            has put there could take any amount of memory.

    Returns:
        The opened file, which the caller has to close; its samples may still be damaged. None: the file is missing, a
        link, far too large or unreadable, or its header differs from `spec`.
    """
    size = size_of(path)
    if size is None or size > 2 * spec.image_bytes() + _LARGER:
        return None
    image = ImageInput.open(check_name(path))
    with suppress(UnicodeDecodeError):  # of names and errors in a damaged file
        if image is None:
            geterror()
        elif all(getattr(image.spec(), name) == getattr(spec, name) for name in _SHAPE):
            return image
    if image is not None:
        image.close()
    return None


def read(path: Path, spec: ImageSpec, description: str = "") -> np.ndarray | None:
    """Return the samples of a picture file that the extension has written earlier.

    Args:
        path: The file.
        spec: The size, channels and sample type that the file must have.
        description: The text with which the "ImageDescription" in the file's metadata must begin. "": any will do.

    Returns:
        An array (height, width, channels), of the type of `spec`. None: the file is missing or damaged, or does not
        match `spec` or `description`.
    """
    if (image := opened(path, spec)) is None:
        return None
    with closing(image), suppress(UnicodeDecodeError):
        is_ours = image.spec().get_string_attribute("ImageDescription").startswith(description)
        samples = image.read_image(0, 0, 0, spec.nchannels, spec.format) if is_ours else None
        if samples is not None and not image.has_error:
            return samples
        image.geterror()
    return None


def own_folder(path: Path) -> None:
    """Make a folder for files of the extension if it is missing. The folder around it may be a link to another disk.

    Raises:
        OSError: It cannot be made, or it is a link itself.
    """
    path.mkdir(parents=True, exist_ok=True)
    refuse_link(path)


def refuse_link(path: Path) -> None:
    """Raise OSError if a path is a symbolic link or a junction, which could lead to files of other users."""
    if path.is_symlink() or path.is_junction():
        raise OSError(errno.ELOOP, "it is a link, and none is followed")


class StoredVectors:
    """Finds the optical flow between two pictures, and keeps it in a folder, where it is found the next time.

    A file's name is a hash of the two pictures, so equal pictures are not computed again.
    """

    def __init__(self, folder: Path, writes: bool) -> None:
        """Prepare to read and write files of optical flow in a folder.

        Args:
            folder: The folder, which need not exist yet.
            writes: Whether computed flow is written there. A failure is no error, but nothing more is written after it.
        """
        self._folder, self._writes = folder, writes
        self._is_new = True  # nothing was written yet

    def found(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the optical flow between two grey pictures (H, W) uint8 in both directions, as flow.found does."""
        digest = hashlib.blake2b(f"{flow.VERSION} {first.shape}".encode(), digest_size=16)
        for picture in (first, second):
            digest.update(picture)
        path = self._folder / f"{digest.hexdigest()}.exr"
        values = self._kept(path, first.shape)
        if values is None:
            values = flow.found(first, second)
            self._keep(path, values)
        return values

    def _kept(self, path: Path, shape: tuple[int, ...]) -> np.ndarray | None:
        """Read stored vectors for pictures of a shape (H, W). None: the file is missing, damaged or does not fit."""
        height, width = (-(-n // STEP) for n in shape)
        spec = ImageSpec(width, height, len(_CHANNELS), "half")
        spec.channelnames = _CHANNELS
        values = None if self._folder.is_symlink() else read(path, spec)
        return None if values is None or not np.isfinite(values).all() else values

    def _keep(self, path: Path, values: np.ndarray) -> None:
        """Store vectors in a file, unless `writes` is False. After one failure, no more are stored."""
        if not self._writes:
            return
        try:
            own_folder(self._folder)
            if self._is_new:
                atomic_write.clear_up(self._folder)
                self._is_new = False
            write_exr(path, values, _CHANNELS)
        except (OSError, MediaError):  # it is found again the next time
            self._writes = False
