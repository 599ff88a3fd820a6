"""The render engine of effect scenes, which Blender's sequencer asks for every frame of an effect strip."""

import inspect
from dataclasses import replace

import bpy
import mathutils
import numpy as np
from bpy.types import Depsgraph

from ...core import stopping
from ...core.messages import signed
from ...core.stopping import StoppedError
from ..data.strips import ENGINE
from . import effect_source, invalidation, job_snapshots, pictures, previews, render_job, sessions
from .render_job import Where


class VirtualShutterEngine(bpy.types.RenderEngine):
    bl_idname = ENGINE
    bl_label = "Virtual Shutter"

    def render(self, depsgraph: Depsgraph) -> None:
        if render_job.job.cancelling:
            self.report({"ERROR"}, self.bl_label)  # any error ends the other render
            return
        try:
            self._render(depsgraph, called_by_script=render_job.script_waits(inspect.currentframe()))
        except BaseException as error:  # otherwise Blender prints it, and renders the frame without the effect
            invalidation.mark_failed(depsgraph.scene.session_uid)
            if not isinstance(error, StoppedError):
                self.fail(effect_source.in_words(error))
            elif not self.test_break():
                render_job.cancel(self.test_break)

    def _render(self, depsgraph: Depsgraph, called_by_script: bool) -> None:
        scene, width, height = depsgraph.scene, self.resolution_x, self.resolution_y
        asked = None
        if render_job.where() is Where.WINDOW and not (called_by_script or render_job.runs()):
            asked = previews.for_engine(bpy.context, scene)
        if asked is None:
            shown, frame = job_snapshots.of(scene, scene.frame_current, self._stopped)
            detail, is_drawn, stopped = effect_source.FULL, False, None
        else:
            shown, frame, detail = asked.snapshot, asked.frame, asked.request.source.detail
            is_drawn, stopped = asked.is_drawn, asked.stopped
        if detail != effect_source.FULL or is_drawn:
            invalidation.mark_reduced(scene.session_uid)
        if is_drawn:
            return  # without a result, which is fastest for Blender
        last = render_job.job.film_data.pictures.get(scene.session_uid) if render_job.where() is Where.JOB else None
        if last is not None and last.shape == (height, width, 4):
            self._show(last)  # so that the render's window is not empty meanwhile
        context = sessions.of_engine(self._say)
        try:
            with stopping.once(stopped or self._stopped):
                picture = pictures.picture(context, shown, frame, detail)
        except StoppedError:
            if asked is None or stopped is None:
                raise
            previews.looking.decision = replace(asked, is_late=True)
            invalidation.mark_reduced(scene.session_uid)
            return
        picture = pictures.resized(picture, width, height, detail.divisor)
        self._show(picture)
        self.update_progress(1.0)
        if render_job.where() is Where.JOB:
            render_job.job.film_data.pictures[scene.session_uid] = picture
        context.session.begin_next(shown, frame, context)

    def _show(self, picture: np.ndarray) -> None:
        axes = [mathutils.Color(axis).from_rec709_linear_to_scene_linear() for axis in np.eye(3)]
        to_working = np.array(axes, np.float32)
        if not np.allclose(to_working, np.eye(3), atol=1e-5):  # sums of light are the same in any linear space
            colours = picture[..., :3] @ to_working
            picture = np.concatenate([colours, picture[..., 3:]], axis=-1)
        # After a result of a single pixel, Blender has room for the whole picture. A full result would be copied.
        self.end_result(self.begin_result(0, 0, 1, 1))
        # Blender's rows go up, as composed pictures do in memory, so this copies nothing.
        values = np.ascontiguousarray(picture[::-1]).ravel()
        for render_pass in self.get_result().layers[0].passes:
            if render_pass.name == "Combined":  # one for each view of a stereo edit
                render_pass.rect.foreach_set(values)

    def fail(self, sentence: str) -> None:
        """Report why there is no picture. End a running render, which would write the frame without the effect."""
        if render_job.ends_films():
            render_job.fail(sentence)
            render_job.cancel(self.test_break)
        else:
            self.report({"ERROR"}, signed(sentence))

    def _stopped(self) -> bool:
        return self.test_break() or render_job.stopping()

    def _say(self, message: str) -> None:
        if bpy.app.background:
            render_job.say(message)
        else:
            self.report({"WARNING"}, signed(message))


classes = (VirtualShutterEngine,)
