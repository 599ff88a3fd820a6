"""A file of finished levels that Blender's sequencer shows, picture after picture."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO

from ...core import atomic_write

# Rows of a tile of the file; its columns are a multiple of 16. A TIFF without tiles takes twice the time: Blender reads
# rows upwards, for which OpenImageIO then allocates 64 MB for each picture.
_ROWS, _COLUMNS = 64, 16


@contextmanager
def temporary(scene: bpy.types.Scene) -> Iterator[LevelsFile]:
    """A file for the pictures of a scene. OSError: there is no room for it."""
    atomic_write.clear_up(place := Path(tempfile.gettempdir()))
    with atomic_write.part_folder(place) as folder:
        file = LevelsFile(folder / "picture.tif", scene.render.resolution_x, scene.render.resolution_y)
        with closing(file):
            yield file


class LevelsFile:
    """An uncompressed TIFF of RGBA levels, whose pixels are replaced in place."""

    def __init__(self, path: Path, width: int, height: int) -> None:
        """OSError: it cannot be written. After this there is room for all that is written to it."""
        self.path, self._padding = path, -width % _COLUMNS
        columns = width + self._padding
        spec = OpenImageIO.ImageSpec(width, height, 4, "uint8")
        spec.tile_width, spec.tile_height = columns, _ROWS
        spec.attribute("compression", "none")
        spec.attribute("oiio:UnassociatedAlpha", 1)
        white = np.full((height, width, 4), 255, np.uint8)
        file = OpenImageIO.ImageOutput.create(str(path))
        if not (file and file.open(str(path), spec) and file.write_image(white) and file.close()):
            raise OSError(f"{path}: cannot be written")
        # The tiles are one below the other, and nothing lies between.
        self._start = path.read_bytes().index(b"\xff" * (4 * width))
        self._file = path.open("r+b", buffering=0)

    def write(self, levels: np.ndarray) -> None:
        """levels: uint8 (H, W, 4), top row first. OSError: there is no such file any more, which Blender would show as
        a picture of one colour."""
        if self._padding:
            levels = np.pad(levels, ((0, 0), (0, self._padding), (0, 0)))
        self._file.seek(self._start)
        self._file.write(levels)
        os.utime(self.path)

    def close(self) -> None:
        self._file.close()
