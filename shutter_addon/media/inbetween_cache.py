"""The folder of a source's in-between frames: pictures, a manifest of what they were made of, and their checksums."""

import glob
import hashlib
import json
import os
import re
import secrets
import stat
import zlib
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from functools import lru_cache, partial
from io import BufferedReader
from pathlib import Path
from typing import NamedTuple

import numpy as np
from OpenImageIO import ImageInput, ImageSpec, geterror

from ..core import atomic_write
from ..core.frames.frame_source import FrameSource
from .completeness import is_whole_picture, why_short
from .errors import MediaError
from .files import check_name
from .folder import Folder, own_folder
from .image_writing import put
from .sequence import expanded

VERSION = 3  # raise it when in-betweens of the same frames change, or the folder's format does: older ones get stale
MANIFEST, CHECKS = "manifest.json", "checks"
MAKER = "Virtual Shutter: in-between frames"
SAMPLES = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}
WHOLE = 8 << 20  # bytes; files of a source up to this size, such as uncompressed 8-bit HD pictures, are hashed whole
BLOCKS, BLOCK = 16, 4096  # of a larger file so many blocks, of so many bytes each, are hashed

# Bytes of files that a build makes, at most. Larger ones are another program's.
LARGEST_MANIFEST = 1 << 16
LARGEST_CHECKS = 1 << 30  # 13 million frames
LARGEST_PICTURE = 1 << 33
LONGEST_LINE = 128  # bytes of a line of checks that is looked at; no build writes a longer one

_PICTURE = re.compile(r"([0-9a-f]{64})  ([0-9]{8}\.(?:png|exr))\n?")
_PAIR = re.compile(r"# ([0-9]{1,9}) (same|cut) [0-9a-f]{8}\n?")
_CHECKS = re.compile(r"[0-9a-f]{8}\.sha256")
HALF = re.compile(r"[0-9]{8}\.(?:png|exr)|" + re.escape(MANIFEST))  # half-written files in a part folder


class InbetweenCache:
    """The in-between frames of one source, factor and method, in a folder of their own under `folder`.

    manifest.json: what they are made of. The folder's name ends in a hash of it, the path excepted, so a source that
    changes gets another folder.
    00000099.png or .exr: a frame, named by its index among source and in-between frames; its samples are of the
    source's type.
    checks/*.sha256: what is finished, in the format of `sha256sum`, which run in the folder checks it. Each build
    appends to a file of its own. A picture's line is written before the picture is moved to its place. A pair of source
    frames that needs no pictures is a comment, "# 12 same" or "# 12 cut", with its CRC-32.

    The folder may come from a stranger. Whatever no build makes is ignored, and links are never followed: pipes, other
    text, numbers of no frame. But a picture with a matching line is taken for what it says, whoever made it.

    A frame's index counts source frames and in-between frames; a pair's is that of its first source frame.
    digests: {frame: SHA-256 of its picture, in hexadecimal; several if builds differed}
    kinds: {pair: "same" or "cut"} of pairs without pictures
    """

    def __init__(self, source: FrameSource, folder: str | Path, factor: int, method: str) -> None:
        self.source, self.factor, self.method = source, factor, method
        made_of = {
            "maker": MAKER,
            "version": VERSION,
            "source": identity(source),
            "settings": {"factor": factor, "method": method},
        }
        self.folder = Path(folder) / f"{source.path.stem[:40]}-{factor}x-{method}-{manifest_key(made_of)}"
        self.manifest = {**made_of, "path": relative_path(source.path, folder)}
        self._spec = _spec(source.width, source.height, source.dtype, source.alpha)
        self._suffix = ".png" if source.dtype.kind == "u" else ".exr"
        self._token = secrets.token_hex(4)
        self._loaded: tuple | None = None
        self.digests: dict[int, set[str]] = {}
        self.kinds: dict[int, str] = {}

    def load(self) -> None:
        """Reads `digests` and `kinds` again, if the folder has changed."""
        stamp = folder_stamp(self.folder)
        if stamp == self._loaded:
            return
        digests: dict[int, set[str]] = {}
        kinds: dict[int, str] = {}
        with suppress(OSError):
            checks = read_checks(Folder(self.folder))
            for name, known in checks.digests.items():
                if self._is_between(frame := int(name[:8])) and name == self._name(frame):
                    digests[frame] = known
            kinds = {pair: kind for pair, kind in checks.kinds.items() if pair < self.source.count - 1}
        self.digests, self.kinds, self._loaded = digests, kinds, stamp  # together: other threads may read them

    def picture(self, frame: int) -> Path:
        """The path of a frame's file."""
        return self.folder / self._name(frame)

    def steps(self, pair: int) -> range:
        """The in-between frames of a pair: those between source frames `pair` and `pair` + 1."""
        return range(pair * self.factor + 1, (pair + 1) * self.factor)

    def has(self, frame: int) -> bool:
        """Whether a frame's picture is finished: it has a digest and a file, which is not opened."""
        with suppress(OSError):
            return frame in self.digests and stat.S_ISREG(self.picture(frame).lstat().st_mode)
        return False

    def finished(self) -> set[int]:
        """The finished pairs: those of a kind, and those whose pictures all have digests and files. None is opened."""
        names = set()
        with suppress(OSError):
            names = {entry.name for entry in Folder(self.folder).files()}
        there = {frame for frame in self.digests if self._name(frame) in names}
        pairs = {frame // self.factor for frame in there}
        return self.kinds.keys() | {pair for pair in pairs if there.issuperset(self.steps(pair))}

    def is_sound(self, pair: int) -> bool:
        """Whether a pair is finished and all its pictures match their digests. It reads them."""
        return pair in self.kinds or all((image := self._sound(frame)) and image.close() for frame in self.steps(pair))

    def read(self, frame: int) -> np.ndarray:
        """A frame's picture (height, width, 4), as `write` was given it. MediaError: it is damaged or gone."""
        path = self.picture(frame)
        if (image := self._sound(frame)) is None:
            raise MediaError(f"{path}: this in-between frame is damaged or gone; build in-between frames again")
        with closing(image):
            samples = image.read_image(0, 0, 0, self._spec.nchannels, self._spec.format)
            if samples is None or image.has_error:
                raise MediaError(
                    f"{path}: this in-between frame cannot be decoded; remove in-between frames, and build again"
                )
        return expanded(samples)

    def prepare(self) -> None:
        """Makes the folder and its manifest, and removes half-written files of builds that were killed.

        MediaError: the folder cannot be written to."""
        text = (json.dumps(self.manifest, indent=1, sort_keys=True) + "\n").encode()
        with self.writable():
            folder = own_folder(self.folder)
            own_folder(self.folder / CHECKS)
            if content_of(folder, MANIFEST) != text:
                with atomic_write.writing(self.folder / MANIFEST) as part:
                    part.write_bytes(text)
            for part in atomic_write.left_behind(self.folder):
                with suppress(OSError):  # another user's, or cleared by others meanwhile
                    folder.remove_part(part.name, HALF.fullmatch)

    def write(self, frame: int, picture: np.ndarray) -> None:
        """Writes a frame's picture (height, width, 4) whole or not at all, and its digest. MediaError: it cannot be
        written."""
        path = self.picture(frame)
        with self.writable(), atomic_write.writing(path) as part:
            if not write_picture(part, picture, self.source.alpha):
                reason = why_short(part.parent)
                raise MediaError(f"{self.folder}: an in-between frame could not be written whole ({reason})")
            # Before the picture is moved to its place: then each of our pictures there has its line, even if this
            # process is killed.
            self.note(f"{Folder(part.parent).digest(part.name, LARGEST_PICTURE)}  {path.name}")

    def note(self, line: str) -> None:
        """Appends a line to this build's checks. MediaError: it cannot be written."""
        with self.writable():
            Folder(self.folder).folder(CHECKS).append(f"{self._token}.sha256", f"{line}\n".encode())

    @contextmanager
    def writable(self) -> Iterator[None]:
        """Inside, a MediaError stands for an OSError: the folder cannot be written to."""
        try:
            yield
        except OSError as error:
            self._token = secrets.token_hex(4)  # that file may end in half a line: go on in another
            reason = error.strerror or error
            raise MediaError(f"{self.folder}: in-between frames cannot be written there ({reason})") from None

    def confirm(self) -> None:
        """MediaError: the source was written to since this was made. What this build has finished counts no longer: it
        may be of what the source has become."""
        if identity(self.source) == self.manifest["source"]:
            return
        with suppress(OSError):
            Folder(self.folder).folder(CHECKS).remove(f"{self._token}.sha256")
        raise MediaError(f"{self.source.path}: was written to while in-between frames were built; build them again")

    def _name(self, frame: int) -> str:
        return f"{frame:08d}{self._suffix}"

    def _is_between(self, frame: int) -> bool:
        return 0 < frame < (self.source.count - 1) * self.factor and frame % self.factor != 0

    def _sound(self, frame: int) -> ImageInput | None:
        """A frame's opened picture, if it matches one of its digests, and is of the source's size and samples."""
        path, digests = self.picture(frame), self.digests.get(frame)
        with suppress(OSError):
            if digests and Folder(self.folder).digest(path.name, LARGEST_PICTURE) in digests:
                return self._open(path)
        return None

    def _open(self, path: Path) -> ImageInput | None:
        """The opened image file, if it is as `write_picture` makes them for this source; else None."""
        wishes = ImageSpec()
        wishes.attribute("oiio:UnassociatedAlpha", 1)  # no premultiplication on reading
        image = ImageInput.open(check_name(path), wishes)
        with suppress(UnicodeDecodeError):  # of names and errors in a damaged file
            if image is None:
                geterror()
            elif all(getattr(image.spec(), name) == getattr(self._spec, name) for name in _SHAPE):
                return image
        if image is not None:
            image.close()
        return None


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


def write_picture(path: Path, picture: np.ndarray, alpha: str) -> bool:
    """Writes samples (height, width, 4) without loss. Returns whether the file is complete. Equal samples give equal
    bytes.

    path: ends in .png or .exr
    alpha: a source's; "opaque": RGB is written, else RGBA as it is, premultiplied or not
    OSError, MediaError: it cannot be written."""
    height, width, _ = picture.shape
    spec = _spec(width, height, picture.dtype, alpha)
    spec["oiio:UnassociatedAlpha"] = 1
    spec["DateTime"] = "1970:01:01 00:00:00"  # an EXR's; without it, it is the time of writing
    spec["png:compressionLevel"] = 1
    spec["png:filter"] = 0x20  # "up" alone: half the time of a choice for each row, and files as small
    spec["compression"] = "piz"
    return put(path, spec, picture[..., : spec.nchannels]) is None and is_whole_picture(path)


_SHAPE = (
    *("x", "y", "z", "width", "height", "depth", "full_x", "full_y", "full_width", "full_height"),
    *("nchannels", "channelnames", "format", "channelformats", "deep"),
)


def _spec(width: int, height: int, dtype: np.dtype, alpha: str) -> ImageSpec:
    """What `write_picture` writes: size, channels and sample type."""
    return ImageSpec(width, height, 3 if alpha == "opaque" else 4, SAMPLES[dtype.name])


def pair_line(pair: int, kind: str) -> str:
    """The line of checks of a pair that needs no pictures, for `InbetweenCache.note`. kind: "same" or "cut"."""
    text = f"{pair} {kind}"
    return f"# {text} {zlib.crc32(text.encode()):08x}"


def folder_stamp(folder: Path) -> tuple | None:
    """A value that changes when files are made or removed in a cache's folder, or its checks change. None: there is no
    such folder."""
    try:
        opened, changed = Folder(folder), folder.lstat().st_mtime_ns
        with suppress(OSError):
            files = [(entry.name, entry.stat(follow_symlinks=False)) for entry in opened.folder(CHECKS).entries()]
            return changed, *sorted((name, info.st_size, info.st_mtime_ns) for name, info in files)
        return (changed,)
    except OSError:
        return None


def stamp(folder: str | Path, stem: str, factor: int, method: str) -> tuple:
    """A value that changes when in-between frames in `folder` are built or removed, of any source with this stem of its
    file's name.

    It asks for time stamps of caches alone, not of the sources' files."""
    caches = Path(folder).glob(f"{glob.escape(stem[:40])}-{factor}x-{method}-*")
    return tuple((path.name, folder_stamp(path)) for path in sorted(caches))


def manifest_key(made_of: dict) -> str:
    return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()[:12]


def content_of(cache: Folder, name: str) -> bytes | None:
    """A manifest's bytes; None if there is none, or it is larger than any of ours."""
    with suppress(OSError):
        return cache.read(name, LARGEST_MANIFEST)
    return None


class Checks(NamedTuple):
    """What a cache's checks say.

    digests: {name of a picture: its digests}
    kinds: {pair: "same" or "cut"}
    own: names of the files in which every line is of our format
    unreadable: the errors of files that may not be read"""

    digests: dict[str, set[str]]
    kinds: dict[int, str]
    own: list[str]
    unreadable: list[OSError]


def read_checks(cache: Folder) -> Checks:
    checks = Checks(digests={}, kinds={}, own=[], unreadable=[])
    try:
        folder = cache.folder(CHECKS)
        for name in [entry.name for entry in folder.files() if entry.name.endswith(".sha256")]:
            try:
                with folder.open(name, LARGEST_CHECKS) as file:
                    if _read_lines(file, checks) and _CHECKS.fullmatch(name):
                        checks.own.append(name)
            except PermissionError as error:
                checks.unreadable.append(error)
            except OSError:  # removed meanwhile, or larger than any of ours
                continue
    except PermissionError as error:
        checks.unreadable.append(error)
    except OSError:  # there are no checks
        pass
    return checks


def _read_lines(file: BufferedReader, checks: Checks) -> bool:
    """Adds the lines of a file to the checks. Returns whether all of them are of our format; the last one may be cut
    off, as on a full disk."""
    ours = others = 0
    for line in iter(partial(file.readline, LONGEST_LINE), b""):
        text = line.decode("ascii", "replace")
        if match := _PICTURE.fullmatch(text):  # a picture can have several digests: libraries encode differently
            checks.digests.setdefault(match[2], set()).add(match[1])
        elif (match := _PAIR.fullmatch(text)) and text.rstrip("\n") == pair_line(int(match[1]), match[2]):
            checks.kinds[int(match[1])] = match[2]
        elif text.endswith("\n"):
            others += 1
            continue
        else:
            return ours > 0 and not others and len(line) < LONGEST_LINE
        ours += 1
    return not others


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


def relative_path(path: Path, folder: str | Path) -> str:
    """The path relative to the folder, so that it holds after both are moved together."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive
        return path.absolute().as_posix()
