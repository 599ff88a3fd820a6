"""A file of finished levels that Blender's sequencer shows, picture after picture."""

from __future__ import annotations

import os
import struct
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...core import atomic_write

# Rows of a tile of the file; its columns are a multiple of 16. A TIFF without tiles takes twice the time: Blender reads
# rows upwards, for which OpenImageIO then allocates 64 MB for each picture.
_ROWS, _COLUMNS = 64, 16


@contextmanager
def temporary(scene: bpy.types.Scene) -> Iterator[LevelsFile]:
    """A file for the pictures of a scene. OSError, struct.error (beyond the 4 GB of a TIFF): there is no room for
    it."""
    atomic_write.clear_up(place := Path(tempfile.gettempdir()))
    with atomic_write.part_folder(place) as folder:
        file = LevelsFile(folder / "picture.tif", scene.render.resolution_x, scene.render.resolution_y)
        with closing(file):
            yield file


class LevelsFile:
    """An uncompressed TIFF of RGBA levels, whose pixels are replaced in place."""

    def __init__(self, path: Path, width: int, height: int) -> None:
        """OSError: it cannot be written. After this there is room for all that is written to it."""
        self.path = path
        self._padding, tiles = -width % _COLUMNS, -(-height // _ROWS)
        self._head = _tiff_head(width, height, width + self._padding, tiles)
        path.write_bytes(self._head + bytes(4 * (width + self._padding) * _ROWS * tiles))
        self._file = path.open("r+b", buffering=0)

    def write(self, levels: np.ndarray) -> None:
        """levels: uint8 (H, W, 4), top row first. OSError: there is no such file any more, which Blender would show as
        a picture of one colour."""
        if self._padding:
            levels = np.pad(levels, ((0, 0), (0, self._padding), (0, 0)))
        self._file.seek(len(self._head))
        self._file.write(levels)
        os.utime(self.path)

    def close(self) -> None:
        self._file.close()


def _tiff_head(width: int, height: int, columns: int, tiles: int) -> bytes:
    """All of a little-endian TIFF before its pixels: so many tiles, so many columns wide, one below the other."""
    short, long, count, size = 3, 4, 11, 4 * columns * _ROWS
    depths = 8 + 2 + 12 * count + 4  # behind the header of 8 bytes, the number of fields, the fields, and their end
    places = depths + 8
    pixels = places + 8 * tiles if tiles > 1 else places
    starts, sizes = [pixels + tile * size for tile in range(tiles)], [size] * tiles
    table = struct.pack(f"<{2 * tiles}I", *starts, *sizes) if tiles > 1 else b""
    fields = [
        *((256, long, 1, width), (257, long, 1, height)),
        *((258, short, 4, depths), (259, short, 1, 1), (262, short, 1, 2)),  # bits of samples, not compressed, RGB
        *((277, short, 1, 4), (322, long, 1, columns), (323, long, 1, _ROWS)),  # channels, columns, rows
        (324, long, tiles, places if table else pixels),  # where the tiles are
        (325, long, tiles, places + 4 * tiles if table else size),  # their bytes
        (338, short, 1, 2),  # straight alpha
    ]
    packed = b"".join(struct.pack("<HHII", *field) for field in fields) + bytes(4) + struct.pack("<4H", 8, 8, 8, 8)
    return struct.pack("<2sHIH", b"II", 42, 8, count) + packed + table
