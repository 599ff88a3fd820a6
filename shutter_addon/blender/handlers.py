"""Handlers of Blender's events: loading, saving, changes, undo and renders. They call what has to react."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import TracebackType

import bpy
from bpy.app.handlers import persistent
from bpy.types import Depsgraph, Scene

from .. import features
from ..core import recent_errors, revision
from ..core.messages import sentence
from ..media import blender_movie
from .data import data_format, preview_areas, source_media, strips, versions
from .devices import main_thread
from .editing import reconcile as reconciling
from .editing import shown_annotations, undelete
from .interface import operator_bases, sharp_frame
from .output import edit_feed
from .rendering import invalidation, job_snapshots, render_job, sessions
from .rendering.render_job import Where

# Options of a Blender without user settings and network.
_ALONE = "--background", "--factory-startup", "--offline-mode", "-noaudio"


def _forget_file(*_) -> None:
    edit_feed.end()
    sharp_frame.forget()
    operator_bases.end_all()
    features.call("forget")
    revision.edit.replaced += 1
    sessions.forget()
    invalidation.forget()
    source_media.look_again()
    reconciling.forget()


def _after_load(*_) -> None:
    sharp_frame.listen()
    sessions.drop_removed()  # a render job may have opened some while the file was loaded
    if not data_format.is_file_newer():
        data_format.migrate()
        reconciling.tidy()
    shown_annotations.follow()
    tell(data_format.note(bpy.data.scenes))


def _after_import(imported: bpy.types.BlendImportContext, *_) -> None:
    items = [item for item in imported.import_items if item.id_type == "SCENE"]
    # The file may lack a requested name.
    tell(data_format.note(item.id for item in items if item.id is not None))


def tell(words: str | None) -> None:
    """Show the user a sentence about a loaded file: in a popup, or on stderr without a window. None: do nothing."""
    if words is None:
        return
    if bpy.app.background:
        render_job.say(words)
    else:  # a file that is being loaded has no windows yet
        main_thread.soon(partial(render_job.popup, sentence(words), title="Virtual Shutter", icon="INFO"))


def _before_save(*_) -> None:
    edit_feed.end()
    reconciling.update()  # a script may have removed strips without an update
    sharp_frame.give_back(bpy.context)
    if not data_format.is_file_newer():
        data_format.stamp_saved(versions.extension())


def _update(scene: Scene | None = None, depsgraph: Depsgraph | None = None) -> None:
    revision.changed()
    if (film := render_job.job.film) is not None and bpy.app.is_job_running("RENDER"):
        job_snapshots.look(film)
    if not render_job.job.cancelling:
        reconciling.update(scene)
    # Blender redraws previews for most changes, but not for a mask. It may crash if one is drawn while a render ends.
    if depsgraph is not None and depsgraph.id_type_updated("MASK") and not render_job.runs():
        preview_areas.redraw()


def _after_undo(*_) -> None:
    revision.changed()
    reconciling.find_lost()
    revision.edit.replaced += 1
    strips.invalidate_all()
    sessions.drop_removed()
    sharp_frame.give_back(bpy.context)
    shown_annotations.follow()


def _before_render(scene: Scene, *_) -> None:
    if render_job.job.cancelling:
        return
    is_film = render_job.begin(scene)
    if scene.render.engine == strips.ENGINE and render_job.where() is not Where.JOB:
        invalidation.drop_failed()
    if is_film and scene.render.engine != strips.ENGINE:
        if not render_job.on_main_thread(partial(_prepare, scene.session_uid, render_job.where() is Where.JOB)):
            render_job.fail("Blender's window did not answer, and the effects could not be read")
        edit_feed.begin(scene)


def _prepare(film: int, in_job: bool) -> bool:
    """Bring all effects up to date before Blender renders a film: an edit with effects, or one picture of it.

    Called on the main thread, even if another thread renders.

    Args:
        film: session_uid of the rendered scene.
        in_job: Whether a job of Blender's window renders, in another thread. The film's effects are then read now
            (job_snapshots).

    Returns:
        True, which tells the waiting thread that it is done.
    """
    revision.changed()  # a script may have changed something without an update
    sessions.close_if_device_changed()
    invalidation.drop_failed()
    invalidation.drop_reduced()
    source_media.look_again()
    if not data_format.is_file_newer():
        # In a window the last update has done that, except for views, which no handler reports.
        reconciling.follow_sources(reconciling.tidy() if bpy.app.background else reconciling.gather())
    for scene in bpy.data.scenes:
        invalidation.invalidate_changed(scene)
    if in_job:
        job_snapshots.begin(film)
    return True


def _before_frame(scene: Scene, *_) -> None:
    if render_job.is_film(scene):
        if (sentence := job_snapshots.left_out(scene)) is not None:
            render_job.fail(sentence)
        if render_job.stopping():
            render_job.cancel()
        else:
            edit_feed.before_frame(scene)


def _after_render(scene: Scene, *_) -> None:
    if not render_job.is_film(scene):
        return  # a render of an effect, for a film or a preview
    render_job.soon(invalidation.drop_failed)
    edit_feed.end()
    job_snapshots.end()
    render_job.end(scene, alone=not render_job.script_waits(inspect.currentframe()))


def _uncaught(before: Callable, kind: type, error: BaseException, trace: TracebackType | None) -> None:
    """Keep an error for *Copy Report* if the extension's code was involved, then print it as before.

    Installed as sys.excepthook: the one place where Blender hands over the errors of all operators, panels, handlers
    and timers.

    Args:
        before: The hook that was installed before.
        kind: The error's type.
        trace: The error's traceback.
    """
    recent_errors.exception(error)
    before(kind, error, trace)


HANDLERS = {
    "load_pre": _forget_file,
    "load_post": _after_load,
    "blend_import_post": _after_import,
    "save_pre": _before_save,
    "depsgraph_update_post": _update,
    "undo_pre": shown_annotations.before_undo,
    "redo_pre": shown_annotations.before_undo,
    "undo_post": _after_undo,
    "redo_post": _after_undo,
    "render_init": _before_render,
    "render_pre": _before_frame,
    "render_cancel": _after_render,
    "render_complete": _after_render,
}


def register() -> None:
    script = str(Path(__file__).with_name("data") / "decoding_process.py")  # decodes movies where PyAV is missing
    if bpy.app.binary_path:
        blender_movie.lend([bpy.app.binary_path, *_ALONE, "--python", script, "--"])
    else:  # Blender as a library
        blender_movie.lend([sys.executable, script])
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(persistent(function))
    sys.excepthook = partial(_uncaught, sys.excepthook)
    # Frames that the sequencer kept lack the effects. While an extension registers, Blender's data is not available.
    main_thread.later(strips.invalidate_all)


def unregister() -> None:
    blender_movie.lend(None)
    for name, function in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(function)
    if isinstance(ours := sys.excepthook, partial) and ours.func is _uncaught:  # not one that was installed later
        sys.excepthook = ours.args[0]
    operator_bases.end_all()
    edit_feed.end()
    sessions.forget()
    source_media.look_again()
    reconciling.forget()
    undelete.forget()
