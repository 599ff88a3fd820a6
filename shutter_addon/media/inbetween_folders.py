"""Folders of in-between frames: how far they are built, how large they are, and what is removed from them."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from ..core import atomic_write
from ..core.farm import claims
from ..core.frames.frame_source import FrameSource
from . import derived, inbetween_cache
from .errors import MediaError
from .folder import Folder
from .inbetween_cache import MAKER, MANIFEST, OWN, InbetweenCache, content_of, folder_stamp, relative_path

# Where builds of the first version have noted the digests of pictures, in files of these names.
_CHECKS, _DIGESTS = "checks", re.compile(r"[0-9a-f]{8}\.sha256")


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
    inbetween_cache.forget()
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
