"""Folders of in-between frames: how far they are built, how large they are, and what is removed from them."""

import json
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

from ..core import atomic_write, threads
from ..core.farm import claims
from ..core.frames.frame_source import FrameSource
from .errors import MediaError
from .folder import Folder
from .inbetween_cache import (
    CHECKS,
    HALF,
    LARGEST_PICTURE,
    MAKER,
    MANIFEST,
    Checks,
    InbetweenCache,
    content_hash,
    content_of,
    folder_stamp,
    identity,
    manifest_key,
    read_checks,
    relative_path,
)

READERS = 4  # threads that check pictures before they are removed

_KEPT = 64  # folders of which the following is remembered
_finished: dict[Path, tuple] = {}  # {folder: (stamp, finished pairs)}
_sizes: dict[Path, tuple] = {}  # {folder: (stamp, bytes)}


class State(NamedTuple):
    """How far in-between frames are built.

    name: "missing", "partial", "ready", or "stale": there are none of the source, but some of what it was before
    done, total: finished pairs of neighbouring source frames, and all pairs"""

    name: str
    done: int
    total: int


def state(source: FrameSource, folder: str | Path, factor: int, method: str) -> State:
    """How far a source's in-between frames are built, as the names of their files tell. Only a build or a read opens
    these files.

    While nothing changes it is fast: it asks for the time stamps of the source's files and of the folder alone.
    MediaError: a file of the source is gone."""
    cache, total = InbetweenCache(source, folder, factor, method), source.count - 1

    def finished() -> int:
        cache.load()
        return len(cache.finished())

    done = _remembered(_finished, cache.folder, finished)
    if done or not total:
        return State("ready" if done == total else "partial", done, total)
    wanted = cache.manifest["path"], cache.manifest["settings"]
    others = [manifest for name, manifest in _caches(os.path.realpath(folder)) if name != cache.folder.name]
    stale = any((manifest["path"], manifest["settings"]) == wanted for manifest in others)
    return State("stale" if stale else "missing", 0, total)


def size(folder: str | Path, source: FrameSource | None = None) -> int:
    """The bytes that `purge` would free. Pictures that have changed count as well, though it does not remove them.

    While nothing changes it is fast. MediaError: a file of the source is gone."""
    folder = Path(folder)
    return sum(_remembered(_sizes, folder / name, partial(_size, folder / name)) for name in _chosen(folder, source))


def purge(
    folder: str | Path, source: FrameSource | None = None, left: Callable[[Path, int], None] = lambda path, count: None
) -> int:
    """Removes in-between frames in `folder`, of one source or of all, stale ones included. Returns the bytes freed.

    It removes nothing else: pictures are read, and removed if they match their digests.
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
    _finished.clear()
    _sizes.clear()
    content_hash.cache_clear()


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
        named = cache.path.name.endswith(f"-{manifest_key(made_of)}")
        if named and made_of["maker"] == MAKER and manifest.keys() >= {"path", "source", "settings"}:
            return manifest
    return None


def _chosen(folder: str | Path, source: FrameSource | None) -> list[str]:
    """The names of the caches in `folder`: of one source, stale ones included, or of all."""
    path, made_of = (None, None) if source is None else (relative_path(source.path, folder), identity(source))
    return [
        name
        for name, manifest in _caches(folder)
        if source is None or manifest["path"] == path or manifest["source"] == made_of
    ]


def _pictures(cache: Folder, checks: Checks) -> list[os.DirEntry]:
    """The files in a cache's folder with the name of a picture that has a digest."""
    return [
        entry
        for entry in cache.files()
        if entry.name in checks.digests and entry.stat(follow_symlinks=False).st_size <= LARGEST_PICTURE
    ]


def _other_files(cache: Folder, checks: Checks) -> Iterator[tuple[Folder, str]]:
    """Our other files in a cache's folder, as (folder, name), in the order in which they are removed. The manifest is
    last: without it, what is left would not be recognised as a cache again."""
    yield from ((cache, entry.name) for entry in cache.files() if claims.is_claim(entry.name))
    for entry in cache.entries():
        if atomic_write.is_part(entry.name):
            with suppress(OSError):
                part = cache.folder(entry.name)
                yield from ((part, file.name) for file in part.files() if HALF.fullmatch(file.name))
    if checks.own:
        folder = cache.folder(CHECKS)
        yield from ((folder, name) for name in checks.own)
    yield cache, MANIFEST


def _size(folder: Path) -> int:
    with suppress(OSError):
        cache = Folder(folder)
        checks = read_checks(cache)
        if not checks.unreadable:
            pictures = sum(entry.stat(follow_symlinks=False).st_size for entry in _pictures(cache, checks))
            return pictures + sum((place.path / name).lstat().st_size for place, name in _other_files(cache, checks))
    return 0


def _remove(top: Folder, name: str, left: Callable[[Path, int], None]) -> int:
    try:
        cache = top.folder(name)
        if _manifest(cache) is None:  # another folder than a moment ago
            return 0
        checks = read_checks(cache)
        if checks.unreadable:
            raise checks.unreadable[0]
        with threads.pool(READERS) as pool:
            names = [entry.name for entry in _pictures(cache, checks)]
            freed = sum(pool.map(partial(_remove_picture, cache, checks), names))
        freed += sum(place.remove(file) for place, file in _other_files(cache, checks))
        for entry in cache.entries():
            if entry.name == CHECKS or atomic_write.is_part(entry.name):
                with suppress(OSError):  # it is not empty: others' files are in it
                    Path(entry.path).rmdir()
        if count := len(cache.entries()):
            left(cache.path, count)
        else:
            cache.path.rmdir()
    except OSError as error:
        raise _irremovable(top.path / name, error) from None
    return freed


def _remove_picture(cache: Folder, checks: Checks, name: str) -> int:
    ours = cache.digest(name, LARGEST_PICTURE) in checks.digests[name]
    return cache.remove(name) if ours else 0


def _remembered(known: dict[Path, tuple], folder: Path, find: Callable[[], int]) -> int:
    """The result of `find` for a folder, from `known` unless the folder has changed. `known` keeps _KEPT folders."""
    now = folder_stamp(folder)
    if known.get(folder, ((),))[0] != now:
        known.pop(folder, None)
        while len(known) >= _KEPT:
            del known[next(iter(known))]
        known[folder] = now, find()
    return known[folder][1]


def _irremovable(folder: str | Path, error: OSError) -> MediaError:
    return MediaError(f"{folder}: cannot be removed ({error.strerror or error})")
