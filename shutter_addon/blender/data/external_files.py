"""The files beside the .blend file that images, volumes, sounds, libraries and the like name."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy
from bpy.types import ID, Image, Strip

from ...media import MediaError
from ...media.sequence import numbered_alike, sequence_files

_MADE = "GENERATED", "VIEWER"  # sources of images that are in no file


def named(item: ID) -> list[Path]:
    """The file of an ID; of an image in tiles one for each; of a sequence the one that it names. Empty: it is packed,
    or made by Blender."""
    source = getattr(item, "source", "FILE")
    if source in _MADE or item.filepath in ("", "<builtin>") or getattr(item, "packed_file", None):
        return []
    return [absolute(item, name) for name in (_tiles(item) if source == "TILED" else [item.filepath])]


def every(item: ID) -> list[Path]:
    """As `named`, but of a sequence all files that are there, in order."""
    return [file for path in named(item) for file in _sequence(item, path)]


def absolute(owner: ID | Strip, path: str) -> Path:
    """An absolute path, where an ID or a strip of one names it."""
    library = owner.library if isinstance(owner, bpy.types.ID) else owner.id_data.library
    return Path(bpy.path.abspath(path, library=library))


def _tiles(image: Image) -> Iterator[str]:
    for tile in image.tiles:
        v, u = divmod(tile.number - 1001, 10)
        yield image.filepath.replace("<UDIM>", str(tile.number)).replace("<UVTILE>", f"u{u + 1}_v{v + 1}")


def _sequence(item: ID, path: Path) -> list[Path]:
    if not (getattr(item, "is_sequence", False) or getattr(item, "source", "") == "SEQUENCE"):
        return [path]
    try:
        # All but clips show files by their own number, those before the named one as well.
        files = sequence_files(path) if isinstance(item, bpy.types.MovieClip) else numbered_alike(path)
    except MediaError:
        return [path]
    return files or [path]
