"""What a movie is rendered from: pictures of finished levels.

What an engine gives is scene-linear floats. Blender copies and converts those to a movie's levels in several passes,
which take more of the processor than all else that it does for a frame. So the sequencer is given each picture as an
uncompressed file of the levels that the movie will have, above the effect strip, which it then does not render.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial

import bpy
from bpy.types import Scene, Strip

from ...core.stopping import StoppedError
from ..data import colour_configuration, snapshot, strips
from ..rendering import pictures, render_context, render_job, render_settings
from ..rendering.effect_source import in_words
from . import levels_file
from .levels_file import LevelsFile


@contextmanager
def feeding(scene: Scene) -> Iterator[None]:
    """Inside, the movie of an edit of new_edit.make_edit is rendered from such files. It has the levels that Blender
    would give the effect's picture, but for one where rounding decides.

    Where there is no room for such a file, or another OpenColorIO configuration than Blender's makes other levels, the
    engine renders as ever."""
    with ExitStack() as until_the_end:
        if not colour_configuration.name():
            with suppress(OSError, struct.error):
                picture = until_the_end.enter_context(levels_file.temporary(scene))
                shown, editor = strips.effect_strips(scene)[0], scene.sequence_editor
                strip = levels_file.strip_above(editor, picture.path, shown.left_handle, shown.right_handle)
                until_the_end.callback(editor.strips.remove, strip)
                filled = partial(_fill, shown, picture, [])
                until_the_end.enter_context(render_job.calling(bpy.app.handlers.render_pre, filled))
        yield


def _fill(effect_strip: Strip, picture: LevelsFile, film: list, scene: Scene, *_) -> None:
    """Fills the file with the picture of the frame that is rendered next. film: the snapshot of all its frames, once it
    is read."""
    if not render_job.is_film(scene) or render_job.stopping():
        return
    try:
        if not film:
            effect, frames = strips.effect_of(scene, effect_strip.scene), range(scene.frame_start, scene.frame_end + 1)
            film.append(snapshot.take(scene, effect, effect_strip, frames, folder=render_settings.settings().inbetween))
        context = render_context.of_render(render_job.say, render_job.stopping, levels=True)
        picture.write(pictures.picture(context, film[0], scene.frame_current))
        context.session.begin_next(film[0], scene.frame_current, context)
    except BaseException as error:  # Blender would print it, and write the picture again that was there before
        if not isinstance(error, StoppedError):
            render_job.fail(in_words(error))
        render_job.cancel()
