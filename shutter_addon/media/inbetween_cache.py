"""Folders of in-between frames, pictures and a manifest of what they are made of: how far they are built, how large
they are, and what is removed from them."""

from __future__ import annotations

import glob
import json
import os
import re
import time
from collections.abc import Callable
from contextlib import closing, suppress
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from OpenImageIO import ImageSpec

from ..core import atomic_write
from ..core.farm import claims
from ..core.frames.frame_source import FrameSource
from . import derived
from .completeness import is_whole_picture, why_short
from .errors import MediaError
from .folder import Folder, own_folder
from .image_writing import put
from .sequence import expanded

VERSION = 3  # raise it when in-betweens of the same frames change, or the folder's format does: older ones get stale
MANIFEST = "manifest.json"
LARGEST_MANIFEST = 1 << 16  # bytes; a larger one is another program's
MAKER = "Virtual Shutter: in-between frames"
SAMPLES = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}

# The names that we choose: of a frame's picture, and of the empty file of a pair that needs none.
OWN = re.compile(r"([0-9]{8})\.(png|exr|same|cut)|" + re.escape(MANIFEST))
# Where builds of the first version have noted the digests of pictures, in files of these names.
_CHECKS, _DIGESTS = "checks", re.compile(r"[0-9a-f]{8}\.sha256")
_RECENT = 2e9  # nanoseconds for which a folder that has changed may change again with the same time stamp


class State(NamedTuple):
    """How far in-between frames are built.

    name: "missing", "partial", "ready", or "stale": there are none of the source, but some of what it was before
    done, total: finished pairs of neighbouring source frames, and all pairs"""

    name: str
    done: int
    total: int


class Listed(NamedTuple):
    """What there is of a source's in-between frames, by the names of the files. None is opened.

    frames: those with a picture; kinds: {pair: "same" or "cut"} of pairs without pictures; pairs: those that are
    finished, of a kind or with all pictures"""

    frames: frozenset[int] = frozenset()
    kinds: dict[int, str] = {}  # nobody writes to it
    pairs: frozenset[int] = frozenset()


class InbetweenCache:
    """The in-between frames of one source, factor and method, in a folder of their own under `folder`.

    manifest.json: what they are made of. The folder's name ends in a hash of it, the path excepted, so a source that
    changes gets another folder.
    00000099.png or .exr: a frame, named by its index among source and in-between frames; its samples are of the
    source's type. It is written beside its place and then moved there, so what lies there is finished.
    00000012.same or .cut: an empty file of a pair of source frames that needs no pictures.

    The folder may come from a stranger: see `derived`. A picture of the right name, size and samples is taken for what
    its name says, whoever made it.

    A frame's index counts source frames and in-between frames; a pair's is that of its first source frame. What writes
    may raise OSError.
    """

    def __init__(self, source: FrameSource, folder: str | Path, factor: int, method: str) -> None:
        self.source, self.factor, self.method = source, factor, method
        made_of = {
            "maker": MAKER,
            "version": VERSION,
            "source": derived.identity(source),
            "settings": {"factor": factor, "method": method},
        }
        self.folder = Path(folder) / f"{source.path.stem[:40]}-{factor}x-{method}-{derived.key(made_of)}"
        self.manifest = {**made_of, "path": relative_path(source.path, folder)}
        self._spec = _spec(source.width, source.height, source.dtype, source.alpha)
        self._suffix = "png" if source.dtype.kind == "u" else "exr"
        self._written: list[str] = []
        self.listed = Listed()

    def load(self) -> None:
        """Looks again at what there is."""
        changed = folder_stamp(self.folder)
        is_recent = changed is not None and time.time_ns() - changed < _RECENT
        listing = _listing.__wrapped__ if is_recent else _listing
        self.listed = listing(self.folder, changed, self.factor, self._suffix, self.source.count - 1)

    def picture(self, frame: int) -> Path:
        """The path of a frame's file."""
        return self.folder / f"{frame:08d}.{self._suffix}"

    def steps(self, pair: int) -> range:
        """The in-between frames of a pair: those between source frames `pair` and `pair` + 1."""
        return _steps(pair, self.factor)

    def is_sound(self, pair: int) -> bool:
        """Whether a pair is finished now, and its pictures are whole, as far as their beginnings and ends tell."""
        is_kind = any(derived.is_kept(self._mark(pair, kind)) for kind in ("same", "cut"))
        return is_kind or all(self._is_whole(frame) for frame in self.steps(pair))

    def read(self, frame: int) -> np.ndarray:
        """A frame's picture (height, width, 4), as `write` was given it. MediaError: it is damaged or gone."""
        path = self.picture(frame)
        image = derived.opened(path, self._spec) if self._is_whole(frame) else None
        if image is None:
            raise MediaError(f"{path}: this in-between frame is damaged or gone; build in-between frames again")
        with closing(image):
            samples = image.read_image(0, 0, 0, self._spec.nchannels, self._spec.format)
            if samples is None or image.has_error:
                raise MediaError(
                    f"{path}: this in-between frame cannot be decoded; remove in-between frames, and build again"
                )
        return expanded(samples)

    def prepare(self) -> None:
        """Makes the folder and its manifest, and removes half-written files of builds that were killed."""
        text = (json.dumps(self.manifest, indent=1, sort_keys=True) + "\n").encode()
        folder = own_folder(self.folder)
        if content_of(folder, MANIFEST) != text:
            with atomic_write.writing(self.folder / MANIFEST) as part:
                part.write_bytes(text)
        for left in atomic_write.left_behind(self.folder):
            with suppress(OSError):  # another user's, or cleared by others meanwhile
                folder.remove_part(left.name, OWN.fullmatch)

    def write(self, frame: int, picture: np.ndarray) -> None:
        """Writes a frame's picture (height, width, 4) whole or not at all. MediaError: it cannot be written whole."""
        path = self.picture(frame)
        with atomic_write.writing(path) as part:
            if not write_picture(part, picture, self.source.alpha):
                reason = why_short(part.parent)
                raise MediaError(f"{self.folder}: an in-between frame could not be written whole ({reason})")
        self._written.append(path.name)

    def note(self, pair: int, kind: str) -> None:
        """Notes that a pair needs no pictures; kind: "same" or "cut"."""
        path = self._mark(pair, kind)
        with atomic_write.writing(path) as part:
            part.touch()
        self._written.append(path.name)

    def confirm(self) -> None:
        """MediaError: the source was written to since this was made. What this build has finished is removed: it may
        be of what the source has become."""
        if derived.identity(self.source) == self.manifest["source"]:
            return
        for name in self._written:
            with suppress(OSError):
                Folder(self.folder).remove(name)
        raise MediaError(f"{self.source.path}: was written to while in-between frames were built; build them again")

    def _mark(self, pair: int, kind: str) -> Path:
        return self.folder / f"{pair:08d}.{kind}"

    def _is_whole(self, frame: int) -> bool:
        path = self.picture(frame)
        if (image := derived.opened(path, self._spec)) is None:
            return False
        image.close()
        return is_whole_picture(path)


@lru_cache(8)
def _listing(folder: Path, _changed: int | None, factor: int, suffix: str, pairs: int) -> Listed:
    """What is listed in a folder of a source of so many pairs."""
    frames, kinds = set(), {}
    with suppress(OSError):
        for entry in Folder(folder).files():
            if not (match := OWN.fullmatch(entry.name)) or match[1] is None:
                continue
            if match[2] == suffix:
                frames.add(int(match[1]))
            elif match[2] in ("same", "cut"):
                kinds[int(match[1])] = match[2]
    full = {pair for pair in {frame // factor for frame in frames} if frames.issuperset(_steps(pair, factor))}
    return Listed(frozenset(frames), kinds, frozenset(pair for pair in full | kinds.keys() if pair < pairs))


def _steps(pair: int, factor: int) -> range:
    return range(pair * factor + 1, (pair + 1) * factor)


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


def _spec(width: int, height: int, dtype: np.dtype, alpha: str) -> ImageSpec:
    """What `write_picture` writes: size, channels and sample type."""
    return ImageSpec(width, height, 3 if alpha == "opaque" else 4, SAMPLES[dtype.name])


def folder_stamp(folder: Path) -> int | None:
    """A value that changes when files are made or removed in a folder. None: there is none, or it is a link."""
    with suppress(OSError):
        return Folder(folder).path.lstat().st_mtime_ns
    return None


def stamp(folder: str | Path, factor: int, method: str, stem: str) -> tuple:
    """A value that changes when in-between frames in `folder` are built or removed, of any source with this stem of its
    file's name.

    It asks for time stamps of caches alone, not of the sources' files."""
    caches = Path(folder).glob(f"{glob.escape(stem[:40])}-{factor}x-{method}-*")
    return tuple((path.name, folder_stamp(path)) for path in sorted(caches))


def content_of(cache: Folder, name: str) -> bytes | None:
    """A manifest's bytes; None if there is none, or it is larger than any of ours."""
    with suppress(OSError):
        return cache.read(name, LARGEST_MANIFEST)
    return None


def relative_path(path: Path, folder: str | Path) -> str:
    """The path relative to the folder, so that it holds after both are moved together."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive
        return path.absolute().as_posix()


def state(source: FrameSource, folder: str | Path, factor: int, method: str) -> State:
    """How far a source's in-between frames are built, as the names of their files tell. Only a build or a read opens
    these files.

    While nothing changes it is fast: it asks for the time stamps of the source's files and of the folder alone.
    MediaError: a file of the source is gone."""
    cache, total = InbetweenCache(source, folder, factor, method), source.count - 1
    cache.load()
    done = len(cache.listed.pairs)
    if done or not total:
        return State("ready" if done == total else "partial", done, total)
    wanted = cache.manifest["path"], cache.manifest["settings"]
    others = [manifest for name, manifest in _caches(os.path.realpath(folder)) if name != cache.folder.name]
    stale = any((manifest["path"], manifest["settings"]) == wanted for manifest in others)
    return State("stale" if stale else "missing", 0, total)


def size(folder: str | Path, source: FrameSource) -> int:
    """The bytes that `purge` would free.

    While nothing changes it is fast. MediaError: a file of the source is gone."""
    folders = [Path(folder, name) for name in _chosen(folder, source)]
    return sum(_size(each, folder_stamp(each)) for each in folders)


def purge(folder: str | Path, source: FrameSource, left: Callable[[Path, int], None] = lambda path, count: None) -> int:
    """Removes a source's in-between frames in `folder`, stale ones included. Returns the bytes freed. It removes the
    files that have names of ours, and nothing else.

    left: called with each cache's folder that is not empty after that, and the number of entries in it
    MediaError: something cannot be removed, or `folder` is a link."""
    names = _chosen(folder, source)
    try:
        top = Folder(Path(folder))
        return sum(_remove(top, name, left) for name in names)
    except (FileNotFoundError, NotADirectoryError):
        return 0
    except OSError as error:
        raise _irremovable(folder, error) from None


def forget() -> None:
    """Forgets what is remembered of sources and folders."""
    _listing.cache_clear()
    _size.cache_clear()
    derived.content_hash.cache_clear()


def _caches(folder: str | Path) -> list[tuple[str, dict]]:
    """(name, manifest) of every cache in `folder`."""
    caches = []
    with suppress(OSError):
        top = Folder(Path(folder))
        for entry in sorted(top.entries(), key=lambda entry: entry.name):
            with suppress(OSError):
                if (manifest := _manifest(top.folder(entry.name))) is not None:
                    caches.append((entry.name, manifest))
    return caches


def _manifest(cache: Folder) -> dict | None:
    """A cache's manifest; None if it is not one of ours, or does not match the folder's name."""
    with suppress(ValueError, TypeError, KeyError, AttributeError, RecursionError):
        manifest = json.loads(content_of(cache, MANIFEST) or b"")
        made_of = {key: value for key, value in manifest.items() if key != "path"}
        named = cache.path.name.endswith(f"-{derived.key(made_of)}")
        if named and made_of["maker"] == MAKER and manifest.keys() >= {"path", "source", "settings"}:
            return manifest
    return None


def _chosen(folder: str | Path, source: FrameSource) -> list[str]:
    """The names of a source's caches in `folder`, stale ones included."""
    path, made_of = relative_path(source.path, folder), derived.identity(source)
    return [name for name, each in _caches(folder) if each["path"] == path or each["source"] == made_of]


def _own(cache: Folder) -> list[os.DirEntry]:
    """The files in a cache's folder that have names of ours. The manifest is last: without it, what is left would not
    be recognised as a cache again."""
    own = [entry for entry in cache.files() if OWN.fullmatch(entry.name) or claims.is_claim(entry.name)]
    return sorted(own, key=lambda entry: entry.name == MANIFEST)


@lru_cache(64)
def _size(folder: Path, _changed: int | None) -> int:
    with suppress(OSError):
        return sum(entry.stat(follow_symlinks=False).st_size for entry in _own(Folder(folder)))
    return 0


def _remove(top: Folder, name: str, left: Callable[[Path, int], None]) -> int:
    try:
        cache = top.folder(name)
        if _manifest(cache) is None:  # another folder than a moment ago
            return 0
        for entry in cache.entries():
            with suppress(OSError):  # others' files are in it
                if entry.name == _CHECKS:
                    cache.remove_part(entry.name, _DIGESTS.fullmatch)
                elif atomic_write.is_part(entry.name):
                    cache.remove_part(entry.name, OWN.fullmatch)
        freed = sum(cache.remove(entry.name) for entry in _own(cache))
        if count := len(cache.entries()):
            left(cache.path, count)
        else:
            cache.path.rmdir()
    except OSError as error:
        raise _irremovable(top.path / name, error) from None
    return freed


def _irremovable(folder: str | Path, error: OSError) -> MediaError:
    return MediaError(f"{folder}: cannot be removed ({error.strerror or error})")
