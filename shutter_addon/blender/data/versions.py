"""The versions that decide whether machines render the same frames: of the extension, Blender and the edit's files."""

import hashlib
import os
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from itertools import groupby
from pathlib import Path

import bpy
from bpy.types import Scene

from ...core import threads
from ...core.farm.job_file import EditVersion
from ...media import MediaError, derived
from . import external_files, requirements, source_media, strips

MANIFEST = Path(__file__).parents[3] / "blender_manifest.toml"
_FEW = 256  # files: of longer sequences, only blocks are hashed, because reading all would take hours
_BLOCKS = 1 << 16  # bytes: smaller files of such sequences are hashed as a whole
_READERS = 16  # threads, because a network drive answers slowly


def extension() -> str:
    return tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"]


def colours() -> str:
    """Return an identifier of the OpenColorIO configuration that Blender uses; "": it is Blender's own.

    Returns:
        The name of a configuration built into OpenColorIO ("ocio://…"), or the hash of a configuration file. The lookup
        tables that such a file refers to are not part of the hash.
    """
    # Blender sets OCIO to its own file when it starts, and its child processes inherit that.
    path = os.environ.get("BLENDER_OCIO", os.environ.get("OCIO", ""))
    if path.startswith("ocio://"):
        return path
    own = Path(bpy.utils.system_resource("DATAFILES", path="colormanagement"), "config.ocio")
    digest = _digest(Path(path), derived.WHOLE)  # None for a missing one: Blender then takes its own
    return "" if digest in (None, _digest(own, derived.WHOLE)) else digest.hex()


def of_edit(scene: Scene) -> EditVersion:
    """Return what identifies the version of the open edit, for comparing edits on several machines.

    It has the versions of the extension and of Blender, the color configuration (`colours`), and hashes of the .blend
    file and of all other files that its pictures are made from. A missing or unreadable file counts by its
    name.

    Raises:
        OSError: The .blend file was never saved, or is gone.
    """
    with open(bpy.data.filepath, "rb") as file:
        blend = hashlib.file_digest(file, "sha256").hexdigest()
    footage = hashlib.sha256()
    for files in _footage_files(scene):
        different = [path for path, _ in groupby(files)]  # a still that is held counts once
        for path, digest in zip(different, digests(different), strict=True):
            footage.update(digest or b"missing: " + os.fsencode(path.name))
    return EditVersion(extension(), ".".join(map(str, bpy.app.version)), colours(), blend, footage.hexdigest())


def read_files(scene: Scene) -> list[Path]:
    """Return all files outside the .blend file that the edit reads: those of its pictures, and all sounds."""
    sounds = map(external_files.named, bpy.data.sounds)
    return [path for files in (*_footage_files(scene), *sounds) for path in files]


def _footage_files(scene: Scene) -> Iterator[list[Path]]:
    """Yield the files that the edit's pictures are made from, a list for each strip and each data-block."""
    for shown in requirements.shown_scenes(scene):
        for strip in shown.sequence_editor.strips_all:
            if strip.type in strips.SOURCES:
                with suppress(MediaError):  # it shows nothing
                    if files := source_media.files(strip):
                        yield files
    data = bpy.data
    for item in (*data.images, *data.movieclips, *data.fonts, *data.cache_files, *data.volumes, *data.libraries):
        if files := external_files.every(item):
            yield files


def digests(files: list[Path]) -> list[bytes | None]:
    """Return a hash of each file's contents; None for a file that is missing or unreadable.

    The files are read in parallel. Of a large file, only the size and some blocks count. A file is large above
    derived.WHOLE bytes or, if there are more than _FEW files, above _BLOCKS bytes.
    """
    whole = derived.WHOLE if len(files) <= _FEW else _BLOCKS
    with threads.pool(_READERS) as pool:
        return list(pool.map(partial(_digest, whole=whole), files))


def _digest(path: Path, whole: int) -> bytes | None:
    """Return the hash of a file's contents; None: the file is missing or unreadable.

    Args:
        path: The file.
        whole: Size in bytes up to which all of a file is hashed. Of a larger one only the size and some blocks are.
    """
    try:
        return derived.content_digest(path, whole)
    except MediaError:
        return None
