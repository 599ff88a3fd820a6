"""What a movie is rendered from: pictures of finished levels.

What an engine gives is scene-linear floats. Blender copies and converts those to a movie's levels in several passes,
which take more of the processor than all else that it does for a frame. So the sequencer is given each picture as an
uncompressed file of the levels that the movie will have, above the effect strip, which it then does not render.
"""

import os
import struct
import tempfile
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ...core import atomic_write
from ...core.stopping import StoppedError
from ..data import colour_configuration, snapshot, strips
from ..rendering import pictures, render_context, render_job, render_settings
from ..rendering.engine import in_words, say

# Rows of a tile of the file; its columns are a multiple of 16. A TIFF without tiles takes twice the time: Blender reads
# rows upwards, for which OpenImageIO then allocates 64 MB for each picture.
_ROWS, _COLUMNS = 64, 16


@contextmanager
def feeding(scene):
    """Inside, the movie of an edit of new_edit.make_edit is rendered from such files. It has the levels that Blender
    would give the effect's picture, but for one where rounding decides.

    Where there is no room for such a file, or another OpenColorIO configuration than Blender's makes other levels, the
    engine renders as ever."""
    with ExitStack() as until_the_end:
        if not colour_configuration.name():
            with suppress(OSError, struct.error):  # of pictures beyond the 4 GB of a TIFF
                atomic_write.clear_up(place := Path(tempfile.gettempdir()))
                folder = until_the_end.enter_context(atomic_write.part_folder(place))
                size = scene.render.resolution_x, scene.render.resolution_y
                until_the_end.enter_context(_fed(scene, LevelsFile(folder / "picture.tif", *size)))
        yield


@contextmanager
def _fed(scene, picture: "LevelsFile"):
    effect_strip = strips.effect_strips(scene)[0]
    strip = _above(effect_strip, picture.path)
    filled = partial(fill, effect_strip, picture, [])
    try:
        with render_job.calling(bpy.app.handlers.render_pre, filled):
            yield
    finally:
        scene.sequence_editor.strips.remove(strip)
        picture.close()


def _above(effect_strip, path: Path):
    """A strip of that file which covers the effect strip."""
    editor = effect_strip.id_data.sequence_editor
    channel = max(strip.channel for strip in editor.strips) + 1
    strip = editor.strips.new_image(path.name, str(path), channel, effect_strip.left_handle)
    strip.right_handle, strip.blend_type = effect_strip.right_handle, "REPLACE"
    return strip


def fill(effect_strip, picture: "LevelsFile", film: list, scene, *_) -> None:
    """Fills the file with the picture of the frame that is rendered next. film: the snapshot of all its frames, once it
    is read."""
    if not render_job.is_film(scene) or render_job.stopping():
        return
    try:
        if not film:
            effect, frames = strips.effect_of(scene, effect_strip.scene), range(scene.frame_start, scene.frame_end + 1)
            film.append(snapshot.take(scene, effect, effect_strip, frames, folder=render_settings.settings().inbetween))
        context = render_context.of_render(say, render_job.stopping, levels=True)
        picture.write(pictures.picture(context, film[0], scene.frame_current))
        context.session.begin_next(film[0], scene.frame_current, context)
    except BaseException as error:  # Blender would print it, and write the picture again that was there before
        if not isinstance(error, StoppedError):
            render_job.fail(in_words(error))
        render_job.cancel()


class LevelsFile:
    """An uncompressed TIFF of RGBA levels, whose pixels are replaced in place."""

    def __init__(self, path: Path, width: int, height: int):
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
