"""Get the snapshot (plain data) of the effect whose picture is to be made, read when Blender's data may be read.

On Blender's main thread, an effect is read when its picture is asked for. In the background, the second frame of a film
reads it for all later ones, unless a script that runs at frames may change it. A job of the window renders on a thread
while the user goes on working: its effects are read on the main thread when it begins, at every frame of the film.
What is missing then (a strip that was pasted later, frames that a retimed effect strip skips to) is read on the main
thread when it is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core.messages import EffectError
from ...core.stopping import StoppedError
from ..data import requirements, snapshot, strips
from ..data.snapshot import Snapshot
from . import effect_source, invalidation, render_job, sessions
from .render_job import Where, job


def begin(film: int) -> None:
    """Store snapshots of all effects that a film shows, or their errors, in job.film_data.taken. Call `look`, too.

    Call this on the main thread, before the other thread renders.

    Args:
        film: session_uid of the rendered scene.
    """
    end()
    film_scene = strips.scene_of_uid(film)
    for scene, effect, parts in shown_effects(film_scene) if film_scene else ():
        uid, is_film = effect.scene.session_uid, scene == film_scene
        if uid in job.film_data.taken:  # a copied scene: the first counts, as in strips.find_effect
            continue
        try:
            taken = [snapshot.take(scene, effect, part, asked_frames(scene, [part], is_film)) for part in parts]
            shown = [range(part.left_handle, part.right_handle) for part in parts]
            job.film_data.taken[uid] = list(zip(shown, taken, strict=True))
        except effect_source.FAULTS as error:
            job.film_data.taken[uid] = error
    look(film)


def _part_at(parts: list[tuple[range, Snapshot]], scene_frame: float) -> Snapshot:
    """Return the snapshot of the part of a cut strip that shows a frame of the effect scene; else the first part's.

    Args:
        parts: Timeline frames and snapshot of each part of the strip.
    """
    frame = parts[0][1].timeline_frame(scene_frame)
    return next((taken for shown, taken in parts if shown.start <= frame < shown.stop), parts[0][1])


def end() -> None:
    """Forget a render's data (all of FilmData but `feed`). On a job's thread, also stop making pictures ahead."""
    job.film_data = render_job.FilmData(feed=job.film_data.feed)
    sessions.end_job()


def look(film: int) -> None:
    """Update job.film_data.left_out: at which frames the sequencer leaves effects out, and why.

    Call this on the main thread when data changes during a render on another thread: the user may delete a camera, for
    example.

    Args:
        film: session_uid of the rendered scene.
    """
    scene = strips.scene_of_uid(film)
    job.film_data.left_out = requirements.left_out(scene) if scene else []


def left_out(scene: Scene) -> str | None:
    """Return why the sequencer leaves an effect out of a film's current frame; None: it leaves none out."""
    reasons = job.film_data.left_out if render_job.where() is Where.JOB else requirements.left_out(scene)
    return next((why for frames, why in reasons if scene.frame_current in frames), None)


def of(effect_scene: Scene, scene_frame: float, ended: Callable[[], bool] | None = None) -> tuple[Snapshot, float]:
    """Return the snapshot (plain data) for a frame of an effect scene, and the timeline frame that shows it.

    Args:
        ended: Called to tell whether the result is no longer wanted; None: wait as long as on_main_thread.

    Raises:
        effect_source.FAULTS: The effect cannot be shown.
        StoppedError: It is no longer wanted, or without `ended`, the main thread has not answered in time.
    """
    uid = effect_scene.session_uid
    if render_job.where() is Where.JOB:
        parts = job.film_data.taken.get(uid)
        taken = _part_at(parts, scene_frame) if isinstance(parts, list) else parts
        if taken is None or (isinstance(taken, Snapshot) and taken.timeline_frame(scene_frame) not in taken.frames):
            taken = render_job.on_main_thread(lambda: _late(uid, scene_frame), ended)
        if taken is None:
            raise StoppedError
        if isinstance(taken, Exception):
            raise taken.with_traceback(None)
        return taken, taken.timeline_frame(scene_frame)
    scene, effect, strip = strips.find_effect(effect_scene, scene_frame)
    frame = strips.timeline_frame(strip, scene_frame)
    taken_by = _of_film if bpy.app.background else invalidation.current
    return taken_by(scene, effect, strip, frame), frame


def _of_film(scene: Scene, effect: PropertyGroup, strip: Strip, frame: float) -> Snapshot:
    """Return the snapshot for a timeline frame in the background: a kept one if it has the frame, else a new one.

    The first snapshot of a strip in a render has only this frame and the next. The second one has all frames at which
    the film shows the effect, and is kept, unless a script that runs at frames may change the edit.
    """
    key, frames = (effect.scene.session_uid, strip.name), {frame, frame + scene.frame_step}
    is_again = key in job.film_data.read and not render_job.scripts_act()
    if is_again and (known := job.film_data.read[key]) is not None and frame in known.frames:
        return known
    if is_again:
        parts = [part for part in strips.effect_strips(scene) if part.scene == effect.scene]
        frames |= asked_frames(scene, parts, scene.session_uid == render_job.job.film)
    taken = snapshot.take(scene, effect, strip, frames)
    if render_job.runs():
        job.film_data.read[key] = taken if is_again else None
    return taken


def _late(uid: int, scene_frame: float) -> Snapshot:
    """Take the snapshot for one frame, which was not taken when the render began. Called on the main thread.

    Args:
        uid: session_uid of the effect scene.
        scene_frame: Frame of the effect scene.

    Raises:
        effect_source.FAULTS: The effect cannot be shown, or was deleted.
    """
    if (effect_scene := strips.scene_of_uid(uid)) is None:
        raise EffectError(rpt_("the effect was deleted while it was rendered"))
    scene, effect, strip = strips.find_effect(effect_scene, scene_frame)
    return snapshot.take(scene, effect, strip, (strips.timeline_frame(strip, scene_frame),))


def shown_effects(film: Scene) -> Iterator[tuple[Scene, PropertyGroup, list[Strip]]]:
    """Yield the effects in a film's scene and in scenes inside it, each as (scene, effect, its effect strips)."""
    for scene in requirements.shown_scenes(film):
        shown = strips.effect_strips(scene)
        for effect in scene.virtual_shutter.effects:
            if parts := [strip for strip in shown if strip.scene == effect.scene]:
                yield scene, effect, parts


def asked_frames(scene: Scene, parts: list[Strip], is_film: bool) -> set[float]:
    """Return the timeline frames at which the engine may be asked for an effect's strips, plus one or two on each side.

    Args:
        scene: The scene that has the strips.
        parts: The effect strips: all parts of a cut one, or one of them.
        is_film: Whether `scene` is the rendered one: then frames outside its frame range are left out. The
            range is extended to the current frame.
    """
    first, last = scene.frame_start, scene.frame_end
    asked = set()
    for strip in parts:
        low, high = strip.left_handle, strip.right_handle
        if is_film:
            low, high = max(low, min(first, scene.frame_current)), min(high, max(last, scene.frame_current) + 1)
        start = strips.timeline_frame(strip, 0)  # a strip may begin between frames
        asked |= {start + number for number in range(math.floor(low - start) - 1, math.ceil(high - start) + 2)}
    return asked
