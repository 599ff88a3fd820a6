"""The folder that keeps a source's in-between frames: pictures, what they were made of, and a check of every one."""

import glob
import hashlib
import json
import os
import re
import secrets
import time
import zlib
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from OpenImageIO import ImageOutput, ImageSpec

from .errors import MediaError
from .sequence import SequenceSource
from .written import is_whole_picture

VERSION = 2  # raise it when the same frames give other in-betweens, or the folder changes: what there is gets stale
MANIFEST = "manifest.json"
MAKER = "Virtual Shutter: in-between frames"
SAMPLES = {"uint8": "uint8", "uint16": "uint16", "float16": "half", "float32": "float"}
WHOLE = 8 << 20  # bytes; a source's files up to this size, HD pictures of 8 bits without compression, are read whole
BLOCKS, BLOCK = 16, 4096  # what is read of a larger one to know it again
LEFT_BEHIND = 3600  # seconds; a picture takes less to be written, whatever the machine

_PICTURE = re.compile(r"([0-9a-f]{64})  (\d{8})\.(?:png|exr)")
_PAIR = re.compile(r"# (\d+) (same|cut) ([0-9a-f]{8})")
_PART = re.compile(r"\.(?:\d{8}|manifest)-[0-9a-f]{8}\.part\.(?:png|exr|json)")
_OURS = re.compile(rf"\d{{8}}\.(?:png|exr)|{_PART.pattern}|{re.escape(MANIFEST)}")
_finished: dict[Path, tuple] = {}  # (stamp, count of pairs) of folders that were asked for
_sizes: dict[Path, tuple] = {}  # (stamp, bytes), likewise


class State(NamedTuple):
    """How far in-between frames are built.

    name: "missing", "partial", "ready", or "stale": there are some, but of what the source was before
    done, total: pairs of neighbouring source frames"""

    name: str
    done: int
    total: int


class Cache:
    """The in-between frames of one source, factor and method, in a folder of their own under `folder`.

    manifest.json: what they are made of. The folder's name ends in a hash of that, so nothing in it ever gets stale.
    00000099.png or .exr: a frame, by its number among all frames, with the source's own samples.
    checks/*.sha256: what is finished. Each build appends to a file of its own. `sha256sum -c` reads them, run in the
    folder; comments are pairs of source frames that need no pictures, "# 12 same" or "# 12 cut", with their CRC-32.
    """

    def __init__(self, source, folder, factor, method):
        self.source, self.factor, self.method = source, factor, method
        made_of = {
            "maker": MAKER,
            "version": VERSION,
            "source": identity(source),
            "settings": {"factor": factor, "method": method},
        }
        key = hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()[:12]
        self.folder = Path(folder) / f"{source.path.stem[:40]}-{factor}x-{method}-{key}"
        self.manifest = {**made_of, "path": _relative(source.path, folder)}
        self._suffix = ".png" if source.dtype.kind == "u" else ".exr"
        self._token = secrets.token_hex(4)
        self._loaded: tuple | None = None
        self.digests: dict[int, set[str]] = {}
        self.kinds: dict[int, str] = {}

    def load(self) -> None:
        """Reads what is finished, if that has changed: digests {frame: those of its picture}, kinds {pair: "same" or
        "cut"}."""
        stamp = _stamp(self.folder)
        if stamp == self._loaded:
            return
        digests: dict[int, set[str]] = {}
        kinds: dict[int, str] = {}
        for file in (self.folder / "checks").glob("*.sha256"):
            try:
                text = file.read_text("ascii", "replace")
            except FileNotFoundError:  # removed meanwhile
                continue
            for line in text.splitlines():
                if match := _PICTURE.fullmatch(line):  # processes whose libraries differ may write other bytes
                    digests.setdefault(int(match[2]), set()).add(match[1])
                elif (match := _PAIR.fullmatch(line)) and line == pair_line(int(match[1]), match[2]):
                    kinds[int(match[1])] = match[2]
        self.digests, self.kinds, self._loaded = digests, kinds, stamp  # at once: others may ask from their threads

    def picture(self, frame: int) -> Path:
        """The file of that frame."""
        return self.folder / f"{frame:08d}{self._suffix}"

    def steps(self, pair: int) -> range:
        """The frames between source frames `pair` and `pair` + 1."""
        return range(pair * self.factor + 1, (pair + 1) * self.factor)

    def finished(self) -> set[int]:
        """The pairs that are finished, as far as the names of files tell."""
        names = {entry.name for entry in os.scandir(self.folder)} if self.folder.is_dir() else set()
        there = {frame for frame in self.digests if self.picture(frame).name in names}
        pairs = {frame // self.factor for frame in there}
        return self.kinds.keys() | {pair for pair in pairs if there.issuperset(self.steps(pair))}

    def is_sound(self, pair: int) -> bool:
        """Whether the pair is finished and all its pictures are as they were written; reads them."""
        return pair in self.kinds or all(self._is_sound(frame) for frame in self.steps(pair))

    def _is_sound(self, frame: int) -> bool:
        try:
            return _sha256(self.picture(frame)) in self.digests.get(frame, ())
        except OSError:
            return False

    def read(self, frame: int) -> np.ndarray:
        """The frame's picture (height, width, 4), as it was given. MediaError: it is damaged or gone."""
        path = self.picture(frame)
        if not self._is_sound(frame):
            raise MediaError(f"{path}: this in-between frame is damaged or gone; build in-between frames again")
        return SequenceSource(self.folder, files=[path.name]).read(0)

    def prepare(self) -> None:
        """Makes the folder, with its manifest, and clears away what killed builds left half-written.

        MediaError: it cannot be written."""
        manifest = self.folder / MANIFEST
        text = json.dumps(self.manifest, indent=1, sort_keys=True) + "\n"
        try:
            (self.folder / "checks").mkdir(parents=True, exist_ok=True)
            if not manifest.exists() or manifest.read_bytes() != text.encode():
                part = self._part(manifest)
                part.write_bytes(text.encode())
                part.replace(manifest)
            _clear(self.folder)
        except OSError as error:
            raise _unwritable(self.folder, error) from None

    def write(self, frame: int, picture: np.ndarray) -> str:
        """Writes a frame's picture (height, width, 4), whole or not at all. Gives its line for `note`.

        MediaError: it cannot be written."""
        path = self.picture(frame)
        part = self._part(path)
        try:
            write_picture(part, picture, self.source.alpha)
            digest = _sha256(part)
            part.replace(path)
        except OSError as error:
            raise _unwritable(self.folder, error) from None
        finally:
            part.unlink(missing_ok=True)
        return f"{digest}  {path.name}"

    def _part(self, path):
        return path.with_name(f".{path.stem}-{self._token}.part{path.suffix}")

    def note(self, lines: list[str]) -> None:
        """Takes down what is finished. MediaError: it cannot be written."""
        try:
            with (self.folder / "checks" / f"{self._token}.sha256").open("ab") as file:
                file.write("".join(f"{line}\n" for line in lines).encode())
        except OSError as error:
            raise _unwritable(self.folder, error) from None


def identity(source) -> dict:
    """What tells a source from others wherever its files lie: their content, and how they are read. In files larger
    than 8 MiB, what keeps the size and changes none of 16 blocks of 4 kB is not noticed.

    MediaError: a file is gone."""
    content = hashlib.sha256()
    for path in getattr(source, "files", [source.path]):
        try:
            status = path.stat()
            content.update(_content(path, status.st_size, status.st_mtime_ns))
        except OSError as error:
            raise MediaError(f"{path.name}: cannot be read ({error.strerror})") from None
    return {
        "content": content.hexdigest(),
        "count": source.count,
        "size": [source.width, source.height],
        "dtype": source.dtype.name,
        "transfer": source.transfer,
        "alpha": source.alpha,
        "options": source.options,
    }


def state(source, folder, factor, method) -> State:
    """How far a source's in-between frames are built, by the names of files; a build and a read look into them.

    Quick while nothing changes: it asks for the time stamps of the source's files and of the folder.
    MediaError: a file of the source is gone."""
    cache, total = Cache(source, folder, factor, method), source.count - 1
    stamp = _stamp(cache.folder)
    if _finished.get(cache.folder, ((),))[0] != stamp:
        cache.load()
        _finished[cache.folder] = stamp, len(cache.finished())
    done = _finished[cache.folder][1]
    if done or not total:
        return State("ready" if done == total else "partial", done, total)
    wanted = cache.manifest["path"], cache.manifest["settings"]
    others = [manifest for path, manifest in _caches(folder) if path != cache.folder]
    stale = any((manifest["path"], manifest["settings"]) == wanted for manifest in others)
    return State("stale" if stale else "missing", 0, total)


def size(folder, source=None) -> int:
    """The bytes that `purge` would free. Quick while nothing changes. MediaError: a file of the source is gone."""
    return sum(map(_size, _chosen(folder, source)))


def purge(folder, source=None) -> int:
    """Removes the in-between frames in `folder`, all or one source's, stale ones as well. Gives the bytes freed.

    Nothing else is removed, wherever it lies. MediaError: something cannot be removed."""
    return sum(map(_remove, _chosen(folder, source)))


def write_picture(path: Path, picture: np.ndarray, alpha: str) -> None:
    """Writes (height, width, 4) samples without loss, as PNG or EXR by the path's ending: RGB if alpha is "opaque",
    else RGBA as it is, premultiplied or not. Equal samples give equal bytes.

    OSError, MediaError: it cannot be written whole."""
    picture = picture[..., :3] if alpha == "opaque" else picture
    height, width, channels = picture.shape
    spec = ImageSpec(width, height, channels, SAMPLES[picture.dtype.name])
    spec["oiio:UnassociatedAlpha"] = 1
    spec["DateTime"] = "1970:01:01 00:00:00"  # of an EXR, else the time of writing
    spec["png:compressionLevel"] = 1
    spec["png:filter"] = 0x20  # "up" alone takes half the time of a choice for each row, and no more room
    spec["compression"] = "piz"
    output = ImageOutput.create(str(path))
    written = output.open(str(path), spec) and output.write_image(np.ascontiguousarray(picture))
    if not (output.close() and written and is_whole_picture(path)):
        raise MediaError(f"{path.parent}: an in-between frame could not be written whole; is the disk full?")


def pair_line(pair: int, kind: str) -> str:
    """What `Cache.note` takes down of a pair that needs no pictures; kind: "same" or "cut"."""
    text = f"{pair} {kind}"
    return f"# {text} {zlib.crc32(text.encode()):08x}"


def _stamp(folder: Path) -> tuple | None:
    """Changes with the folder's list of files and with its checks; None without a folder."""
    try:
        checks = [(entry.name, entry.stat()) for entry in os.scandir(folder / "checks")]
        return folder.stat().st_mtime_ns, *sorted((name, info.st_size, info.st_mtime_ns) for name, info in checks)
    except (FileNotFoundError, NotADirectoryError):
        return None


def stamp(folder, stem: str, factor: int, method: str) -> tuple:
    """Changes with every in-between frame that is built in `folder`, or removed, of sources whose files have that stem.

    It asks for time stamps alone, and for none of the sources'."""
    caches = Path(folder).glob(f"{glob.escape(stem[:40])}-{factor}x-{method}-*")
    return tuple((path.name, _stamp(path)) for path in sorted(caches))


def _caches(folder) -> list[tuple[Path, dict]]:
    """(folder, manifest) of every cache under `folder`."""
    found = []
    for path in sorted(Path(folder).glob(f"*/{MANIFEST}")):
        with suppress(OSError, ValueError, TypeError, KeyError):  # another program's, or damaged
            manifest = json.loads(path.read_bytes())
            if manifest["maker"] == MAKER:
                found.append((path.parent, {key: manifest[key] for key in ("path", "source", "settings")}))
    return found


def _chosen(folder, source) -> list[Path]:
    """The caches under `folder`, all or one source's."""
    path, made_of = (None, None) if source is None else (_relative(source.path, folder), identity(source))
    return [
        cache
        for cache, manifest in _caches(folder)
        if source is None or manifest["path"] == path or manifest["source"] == made_of
    ]


def _size(folder: Path) -> int:
    now = _stamp(folder)
    if _sizes.get(folder, ((),))[0] != now:
        with suppress(FileNotFoundError):  # removed meanwhile
            _sizes[folder] = now, sum(path.stat().st_size for path in _files(folder))
    return _sizes.get(folder, (now, 0))[1]


def _files(folder: Path) -> list[Path]:
    """What was made in a cache's folder."""
    return [
        path
        for path in (*folder.iterdir(), *folder.glob("checks/*.sha256"))
        if _OURS.fullmatch(path.name) or path.parent != folder
    ]


def _clear(folder: Path) -> None:
    """Removes what was left half-written; others may write here at the same time."""
    for entry in os.scandir(folder):
        with suppress(FileNotFoundError):
            if _PART.fullmatch(entry.name) and time.time() - entry.stat().st_mtime > LEFT_BEHIND:
                os.unlink(entry)


def _remove(folder: Path) -> int:
    freed = 0
    try:
        # The manifest last: without it, what is left would never be found again.
        for path in sorted(_files(folder), key=lambda path: path.name == MANIFEST):
            freed += path.stat().st_size
            path.unlink()
        for empty in (folder / "checks", folder):
            if empty.is_dir() and not any(empty.iterdir()):
                empty.rmdir()
    except OSError as error:
        raise MediaError(f"{folder}: cannot be removed ({error.strerror})") from None
    return freed


@lru_cache(maxsize=1 << 17)  # a sequence of an hour and a half
def _content(path: Path, size: int, _mtime: int) -> bytes:
    """A hash of the file, or of a large one's size and of blocks from all over it."""
    with path.open("rb") as file:
        if size <= WHOLE:
            return hashlib.file_digest(file, "sha256").digest()
        digest = hashlib.sha256(str(size).encode())
        for block in range(BLOCKS):
            file.seek(max(size - BLOCK, 0) * block // (BLOCKS - 1))
            digest.update(file.read(BLOCK))
        return digest.digest()


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _relative(path: Path, folder) -> str:
    """The path as seen from the folder, so that both may move together."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive
        return path.absolute().as_posix()


def _unwritable(folder: Path, error: OSError) -> MediaError:
    return MediaError(f"{folder}: in-between frames cannot be written there ({error.strerror or error})")
