"""The versions of the extension, of Blender, and of the edit that is open."""

from __future__ import annotations

import hashlib
import os
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from functools import cache, partial
from itertools import groupby
from pathlib import Path

import bpy
from bpy.types import Scene

from ...core import threads
from ...core.farm.job_file import EditVersion, Footage
from ...media import MediaError, derived
from ...media.files import stamp
from . import external_files, source_media, strips

MANIFEST = Path(__file__).parents[3] / "blender_manifest.toml"
_FEW = 256  # files of a sequence; of a longer one's, blocks are hashed: to read all of it would take hours
_BLOCKS = 1 << 16  # bytes of such a file, above which that is so
_READERS = 16  # threads: what takes long is that a network drive answers


def extension() -> str:
    return tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]


def blender() -> str:
    """Major, minor and micro version."""
    return ".".join(map(str, bpy.app.version))


def colours() -> str:
    """The OpenColorIO configuration that Blender has taken: of one that OpenColorIO brings, its name; of a file, its
    SHA-256 in hexadecimal; "": Blender's own, wherever it is installed. Of the tables that a file names, only the names
    count."""
    # Blender itself sets OCIO to its own file as it starts, and what it starts inherits that.
    path = os.environ.get("BLENDER_OCIO", os.environ.get("OCIO", ""))
    if path.startswith("ocio://"):
        return path
    digest = _config_digest(Path(path))
    return "" if digest == _own_config() else digest


@cache
def _own_config() -> str:
    return _config_digest(Path(bpy.utils.system_resource("DATAFILES", path="colormanagement")) / "config.ocio")


def _config_digest(path: Path) -> str:
    """ "": there is no such file; Blender then takes its own."""
    try:
        return _sha256(path)
    except OSError:
        return ""


def _sha256(path: str | Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def of_edit(scene: Scene) -> EditVersion:
    """The version of an edit, as it is in the .blend file that is open. OSError: the file is gone."""
    blend = _sha256(bpy.data.filepath)
    footage = tuple(map(_footage, _footage_files(scene)))
    return EditVersion(blend=blend, extension=extension(), blender=blender(), colours=colours(), footage=footage)


def read_files(scene: Scene) -> list[Path]:
    """All files that the edit's pictures are made of, beside the .blend file."""
    return [path for files in _footage_files(scene) for path in files]


def sounds() -> list[Path]:
    """The files of all sounds."""
    return [path for sound in bpy.data.sounds for path in external_files.named(sound)]


def stamps(scene: Scene) -> dict[Path, tuple[int, int] | None]:
    """The stamp of each of `read_files`."""
    return {path: stamp(path) for path in read_files(scene)}


def _footage_files(scene: Scene) -> Iterator[list[Path]]:
    """What the edit's pictures are made of beside the .blend file, as lists of files: of its strips, of those of the
    edits that it shows, and of all other data; without sound."""
    for shown in strips.shown_scenes(scene):
        for strip in shown.sequence_editor.strips_all:
            if strip.type in strips.SOURCES:
                with suppress(MediaError):  # it shows nothing
                    if files := source_media.files(strip):
                        yield files
    data = bpy.data
    for item in (*data.images, *data.movieclips, *data.fonts, *data.cache_files, *data.volumes, *data.libraries):
        if files := external_files.every(item):
            yield files


def _footage(files: list[Path]) -> Footage:
    """The digest of files: of an image sequence's, in order."""
    files = [path for path, _ in groupby(files)]  # a still that is held is one file
    content, missing = hashlib.sha256(), ""
    for path, digest in zip(files, digests(files), strict=True):
        missing = missing or ("" if digest else path.name)
        content.update(digest or b"missing: " + os.fsencode(path.name))
    return Footage(name=files[0].name, files=len(files), content=content.hexdigest(), missing=missing)


def digests(files: list[Path]) -> list[bytes | None]:
    """Digests of the contents of files that are read together; None for one that is missing, or cannot be read."""
    whole = derived.WHOLE if len(files) <= _FEW else _BLOCKS
    with threads.pool(_READERS) as pool:
        return list(pool.map(partial(_digest, whole=whole), files))


def _digest(path: Path, whole: int) -> bytes | None:
    """As derived.content_digest; None: the file is missing, or cannot be read."""
    try:
        return derived.content_digest(path, whole)
    except MediaError:
        return None
