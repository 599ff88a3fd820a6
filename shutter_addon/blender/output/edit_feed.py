"""Renders of the user's edit from files of finished levels, as long as they run.

Where an effect is all that is seen of an edit, Blender makes levels of the engine's floats in several passes, and
blends them over footage that nobody sees: several times the work that it has with a strip of footage. So a strip above
shows a file of the very levels that Blender would make (core.pixels.shown_levels), from a film's second frame on: a
picture by itself keeps its floats, as a script may save it as others than the edit's settings say. The edit is as it
was once the render ends, or a file is saved or loaded meanwhile: from then on the engine renders.

A movie that the command makes of footage and a recipe is known to be such an edit (`feeding`). Its levels are made by
the GPU alone, and those where rounding decides may be others than Blender's.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np
import OpenImageIO
from bpy.types import Scene, Strip

from ...core import atomic_write, stopping
from ...core.pixels.shown_levels import Display
from ...media import color
from ..data import seen_alone, strips, versions
from ..data.property_copy import for_a_while
from ..rendering import job_snapshots, pictures, render_job, sessions
from ..rendering.effect_source import FULL, in_words
from ..rendering.render_job import Where

# Rows of a tile of the file; its columns are a multiple of 16. A TIFF without tiles takes twice the time: Blender reads
# rows upwards, for which OpenImageIO then allocates 64 MB for each picture.
_ROWS, _COLUMNS = 64, 16


@dataclass
class _Film:
    """What a render has changed.

    is_own: whether renders are movies of new_edit.make_edit
    scene: session_uid of the edit; changed: what puts it back
    strip: of the file, by name; None: there is none yet
    file: of levels; None: as above
    makes_levels: as seen_alone.makes_levels; None: nobody has asked; has_failed: it was not possible
    has_begun: whether a frame is rendered"""

    is_own: ClassVar[bool] = False
    scene: int
    changed: ExitStack = field(default_factory=ExitStack)
    strip: str | None = None
    file: LevelsFile | None = None
    makes_levels: bool | None = None
    has_failed: bool = False
    has_begun: bool = False


_running: list[_Film] = []  # one at most


def feeding() -> AbstractContextManager[None]:
    """Inside, renders are movies of edits of whole_edits.make_edit, from their first frame on."""
    return for_a_while([(_Film, "is_own", True)])


def begin(scene: Scene) -> None:
    """The render of an edit begins, on the main thread."""
    end()
    if render_job.where() is Where.BACKGROUND and scene.sequence_editor is not None:
        _running.append(_Film(scene.session_uid))


def end() -> None:
    """Puts the edit back."""
    while _running:
        _running.pop().changed.close()


def before_frame(scene: Scene) -> None:
    """Prepares the edit for its current frame."""
    film = next((film for film in _running if film.scene == scene.session_uid), None)
    if film is None:
        return
    if not (film.has_begun or film.is_own):  # a picture by itself may be saved as floats afterwards
        film.has_begun = True
        return
    seen = None if film.has_failed else _seen(film, scene)
    is_fed = seen is not None and _feed(film, scene, *seen)
    shown = film.strip and scene.sequence_editor.strips_all.get(film.strip)
    if shown and shown.mute == is_fed:  # each change costs
        shown.mute = not is_fed


def _seen(film: _Film, scene: Scene) -> tuple[Strip, bool] | None:
    """As seen_alone.alone, at the current frame, where Blender makes known levels of it."""
    if film.is_own:
        is_known = not versions.colours()
        return (strips.effect_strips(scene)[0], False) if is_known else None
    if film.makes_levels is None or render_job.scripts_act():
        film.makes_levels = seen_alone.makes_levels(scene)
    return seen_alone.alone(scene, scene.frame_current, film.strip) if film.makes_levels else None


def _feed(film: _Film, scene: Scene, strip: Strip, is_blended: bool) -> bool:
    """Fills the file with the effect's levels. False: the engine has to render the frame, and to say what is wrong."""
    try:
        shown = scene.frame_current - strips.origin(strip) + strip.scene.frame_start
        snapshot, frame = job_snapshots.of(strip.scene, int(shown))
        transfer = color.blended if is_blended else color.shown
        display = None if film.is_own else Display(scene.render.dither_intensity, transfer)
        context = sessions.of_render(render_job.say, levels=film.is_own, display=display)
        with stopping.once(render_job.stopping):
            source = context.renderer(context.request(snapshot, frame, FULL)).source
            size = scene.render.resolution_x, scene.render.resolution_y
            is_known = film.is_own or source.alpha == "opaque"  # over black, what shines through is known
            if not is_known or (source.width, source.height) != size:
                return False
            levels = pictures.picture(context, snapshot, frame)
        _file(film, scene).write(levels)
        context.session.begin_next(snapshot, frame, context)
    except Exception:
        film.has_failed = True
        return False
    except BaseException as error:  # Ctrl-C, of which the engine would not hear
        render_job.fail(in_words(error))
        render_job.cancel()
    return True


def _file(film: _Film, scene: Scene) -> LevelsFile:
    """The file of the film, with a strip that shows it. OSError: it cannot be written. ValueError: there is no channel
    for the strip."""
    if film.file is None:
        film.file = film.changed.enter_context(_temporary(scene))
        film.strip = _add_strip(film, scene, film.file.path)
    return film.file


def _add_strip(film: _Film, scene: Scene, path: Path) -> str:
    editor, uid = scene.sequence_editor, scene.session_uid
    active, kept = editor.active_strip, (editor.use_cache_raw, editor.use_cache_final)
    first, last = min(scene.frame_start, scene.frame_current), max(scene.frame_end, scene.frame_current)
    channel = max((strip.channel for strip in editor.strips), default=0) + 1
    if channel > strips.CHANNELS:
        raise ValueError
    strip = editor.strips.new_image(path.name, str(path), channel, first)
    strip.right_handle, strip.blend_type = last + 1, "REPLACE"
    # Blender would keep the file's first picture, and every frame of the film.
    editor.active_strip, editor.use_cache_raw, editor.use_cache_final = active, False, False
    name = strip.name

    def remove() -> None:
        scene = strips.scene_of_uid(uid)
        editor = scene and scene.sequence_editor
        if editor and (found := editor.strips_all.get(name)) is not None:
            editor.use_cache_raw, editor.use_cache_final = kept
            editor.strips.remove(found)

    film.changed.callback(remove)
    return name


@contextmanager
def _temporary(scene: Scene) -> Iterator[LevelsFile]:
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
