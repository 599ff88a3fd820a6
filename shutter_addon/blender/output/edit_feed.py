"""Give Blender finished 8-bit pictures of an effect through a file, which is faster than through the render engine.

Where only an effect is visible, Blender would convert the engine's floats to levels in several passes and blend them
over hidden footage, which takes several times as long as showing a strip of footage. So a temporary strip on top shows
a file with the exact levels that Blender would make (core/pixels/shown_levels.py), from a film's second frame on. A
single picture keeps its floats, since a script can save it with other settings. The edit is restored when the render
ends, or when a file is saved or loaded, after which the engine renders.
"""

import os
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import OpenImageIO
from bpy.types import Scene, Strip

from ...core import atomic_write, stopping
from ...core.pixels.shown_levels import Display
from ...media import color
from ..data import sole_effect, strips
from ..rendering import job_snapshots, pictures, render_job, sessions
from ..rendering.effect_source import FULL, in_words
from ..rendering.render_job import Where

# Size of the file's tiles; columns are a multiple of 16. A TIFF without tiles takes twice the time: Blender reads rows
# upwards, for which OpenImageIO allocates 64 MB per picture.
_ROWS, _COLUMNS = 64, 16


@dataclass
class _Film:
    """What was done so far to give one render its pictures through a file (see this module).

    Attributes:
        scene: session_uid of the edit's scene.
        changed: Restores the edit and removes the file when it is closed.
        strip: Name of the temporary strip that shows the file; None: not added yet.
        file: The file with the current picture; None: not made yet.
        makes_levels: Whether the scene's output has predictable 8-bit levels (sole_effect.has_known_levels); None: not
            asked yet.
        has_begun: Whether before_frame was called for the first frame, which the engine renders.
    """

    scene: int
    changed: ExitStack = field(default_factory=ExitStack)
    strip: str | None = None
    file: "LevelsFile | None" = None
    makes_levels: bool | None = None
    has_begun: bool = False


def begin(scene: Scene) -> None:
    """Prepare to give Blender finished pictures, when a render of an edit begins. Do so only without a window."""
    end()
    if render_job.where() is Where.BACKGROUND and scene.sequence_editor is not None:
        render_job.job.film_data.feed = _Film(scene.session_uid)


def end() -> None:
    """Stop giving Blender finished pictures: remove the temporary strip and its file, and restore the edit."""
    film, render_job.job.film_data.feed = render_job.job.film_data.feed, None
    if film is not None:
        film.changed.close()


def before_frame(scene: Scene) -> None:
    """Prepare a film's next frame: if only an effect strip is visible, make its picture and show it through the file.

    Otherwise hide the temporary strip, so that Blender asks the engine. Call this before each frame. The first frame
    always goes to the engine, since it may be a single picture that is saved as floats.
    """
    film = render_job.job.film_data.feed
    if film is None or film.scene != scene.session_uid:
        return
    if not film.has_begun:  # a single picture can be saved as floats later
        film.has_begun = True
        return
    if film.makes_levels is None or render_job.scripts_act():
        film.makes_levels = sole_effect.has_known_levels(scene)
    seen = sole_effect.strip_at(scene, scene.frame_current, film.strip) if film.makes_levels else None
    is_fed = seen is not None and _feed(film, scene, *seen)
    shown = film.strip and scene.sequence_editor.strips_all.get(film.strip)
    if shown and shown.mute == is_fed:  # changes are slow
        shown.mute = not is_fed


def _feed(film: _Film, scene: Scene, strip: Strip, is_blended: bool) -> bool:
    """Make an effect's picture at the scene's current frame, and write it to the file as 8-bit values.

    Args:
        strip: The effect strip that alone is visible.
        is_blended: Whether Blender would blend that strip with one below, which changes the last bits of colors.

    Returns:
        Whether to show the file. False: the engine has to render this frame, because the picture is not opaque, has
        another size than the film, or failed. After a failure, the file is no longer used, and the engine reports it.
    """
    try:
        shown = scene.frame_current - strips.origin(strip) + strip.scene.frame_start
        snapshot, frame = job_snapshots.of(strip.scene, int(shown))
        display = Display(scene.render.dither_intensity, color.blended if is_blended else color.shown)
        context = sessions.of_render(render_job.say, display=display)
        with stopping.once(render_job.stopping):
            source = context.renderer(context.request(snapshot, frame, FULL)).source
            size = scene.render.resolution_x, scene.render.resolution_y
            if source.alpha != "opaque" or (source.width, source.height) != size:
                return False
            levels = pictures.picture(context, snapshot, frame)
        _file(film, scene).write(levels)
        context.session.begin_next(snapshot, frame, context)
    except Exception:
        end()
        return False
    except BaseException as error:  # Ctrl-C, which the engine would not get
        render_job.fail(in_words(error))
        render_job.cancel()
    return True


def _file(film: _Film, scene: Scene) -> "LevelsFile":
    """Return the file for pictures' 8-bit values. The first time, make the file, and add a strip that shows it.

    Raises:
        OSError: The file cannot be written.
        ValueError: There is no free channel for the strip.
    """
    if film.file is None:
        atomic_write.clear_up(place := Path(tempfile.gettempdir()))
        folder = film.changed.enter_context(atomic_write.part_folder(place))
        film.file = LevelsFile(folder / "picture.tif", scene.render.resolution_x, scene.render.resolution_y)
        film.changed.callback(film.file.close)
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
    # Do not let Blender cache the file's first picture, or every frame of the film.
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


class LevelsFile:
    """An uncompressed TIFF of 8-bit RGBA pixels. Each frame's picture is written over the last, for Blender to read."""

    def __init__(self, path: Path, width: int, height: int) -> None:
        """Create the file with room for all later pictures.

        Raises:
            OSError: It cannot be written.
        """
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
        # The tiles are stored one after the other, without gaps.
        self._start = path.read_bytes().index(b"\xff" * (4 * width))
        self._file = path.open("r+b", buffering=0)

    def write(self, levels: np.ndarray) -> None:
        """Replace the picture in the file.

        Args:
            levels: The picture, uint8 (H, W, 4), top row first.

        Raises:
            OSError: The file cannot be written or was deleted. Blender would show a deleted file as a single color.
        """
        if self._padding:
            levels = np.pad(levels, ((0, 0), (0, self._padding), (0, 0)))
        self._file.seek(self._start)
        self._file.write(levels)
        os.utime(self.path)

    def close(self) -> None:
        self._file.close()
