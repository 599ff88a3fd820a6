"""Operators and panel that bake an effect to a strip and unbake it."""

from dataclasses import dataclass

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, Operator, PropertyGroup, Scene, Strip, UILayout

from ....blender.data import selection, strips
from ....blender.devices import main_thread
from ....blender.interface.operator_bases import Named, operator, redraw
from ....blender.interface.panel_parts import panel, sentence
from ....blender.output import film_output
from ....core import messages
from ....core.messages import EffectError, UserError
from . import baked_film, baked_strips

TICK = 0.5  # seconds between two looks at the job
STILL = 1.0  # seconds before the panel asks again whether the bake is outdated
FORMATS = (
    ("MOVIE", "Movie", "H.264, for playback: small errors and no transparency"),
    ("OPEN_EXR", "OpenEXR", "A folder of pictures in full precision; playback is slower"),
)


@dataclass
class _Bake:
    """The bake of this Blender.

    Attributes:
        running: the job whose film is wanted.
        stopped: the last one that ended; it may still be finishing a frame.
        failure: identity of an effect, and why its bake failed.
    """

    running: baked_film.BakeJob | None = None
    stopped: baked_film.BakeJob | None = None
    failure: tuple[str, str] = "", ""


_bake = _Bake()


def _why_baking(_effect: PropertyGroup) -> str | None:
    is_busy = _bake.running is not None or (_bake.stopped is not None and not _bake.stopped.is_over())
    return rpt_("An effect is being baked") if is_busy else None


@operator("Bake to Strip", _why_baking, file_format=EnumProperty(name="Format", items=FORMATS))
def bake(self: Operator, _context: Context, effect: PropertyGroup) -> set[str] | None:
    """Render the effect in the background and add the film as a strip above it. Finished frames are kept"""
    _bake.failure = "", ""
    baked_strips.check(self.edit, self.effect_strip)
    film = baked_film.film_of(self.edit, effect, self.effect_strip, self.file_format)
    try:
        if bpy.app.background:
            baked_film.render(self.edit, effect, self.effect_strip, film, lambda: None)
        if film.is_finished():
            baked_strips.add_strip(self.edit, self.effect_strip, film)
            return None
        _bake.running = baked_film.start(self.edit, effect, self.effect_strip, film)
    except (film_output.OutputError, OSError) as error:
        raise UserError(film_output.in_words(error, film.place)) from None
    main_thread.later(_look, TICK)
    return {"CANCELLED"}  # nothing to undo yet


class SHUTTER_OT_bake_stop(Named, Operator):
    """Stop the bake. Finished frames are kept, and the next bake continues from there"""

    bl_label = "Stop Baking"

    @classmethod
    def refusal(cls, _context: Context) -> str | None:
        return None if _bake.running else rpt_("No effect is being baked")

    def execute(self, context: Context) -> set[str]:
        stop()
        redraw(context)
        return {"FINISHED"}


def _why_not_baked(_effect: PropertyGroup) -> str | None:
    return None if selection.active(bpy.context)[2].virtual_shutter_bake.identity else rpt_("The effect is not baked")


@operator("Unbake", _why_not_baked)
def unbake(self: Operator, _context: Context, _effect: PropertyGroup) -> None:
    """Remove the baked strip and show the effect again. The baked files stay"""
    baked_strips.unbake(self.edit, self.effect_strip)


def _look() -> float | None:
    """Add the strip of a finished bake."""
    if (job := _bake.running) is None:
        return None
    redraw(bpy.context)
    if not job.is_over():
        return TICK
    windows = bpy.context.window_manager.windows
    if bpy.app.is_job_running("RENDER") or any(window.modal_operators for window in windows):
        return TICK  # a render reads the strips, or the user drags one
    try:
        if (failure := job.failure()) is None:
            failure = _lay(job)
        if failure is not None:
            _bake.failure = job.effect, failure
    finally:
        stop()
    return None


def _lay(job: baked_film.BakeJob) -> str | None:
    """Put a finished film above its effect strip. Return why it is impossible, or None."""
    scene = strips.scene_of_uid(job.scene)
    parts = [s for s in strips.effect_strips(scene) if s.scene.virtual_shutter.identity == job.effect] if scene else []
    if not parts:
        return rpt_('the strip was removed during the bake; its film is "{path}"').format(path=job.film.place)
    try:
        baked_strips.add_strip(scene, next((part for part in parts if part.name == job.strip), parts[0]), job.film)
    except (EffectError, RuntimeError) as error:
        return messages.sentence(error)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo_push(message=bake.bl_label)
    return None


def stop() -> None:
    """End the running bake."""
    if (job := _bake.running) is not None:
        _bake.running, _bake.stopped = None, job
        job.end()


def forget() -> None:
    """Stop and forget errors, before another file is loaded."""
    stop()
    _bake.failure = "", ""


def draw_panel(layout: UILayout, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    job = _bake.running
    if job is not None and job.effect == effect.identity:
        row = layout.row(align=True)
        done, total = job.done(), len(job.film.frames)
        text = iface_("{done} of {total}").format(done=done, total=total)
        row.progress(factor=done / total, text=text, translate=False)
        row.operator("shutter.bake_stop", text="", icon="X")
        return
    baked, failure = _bake.failure
    if failure and baked == effect.identity:
        sentence(layout, failure, "ERROR")
    identity = strip.virtual_shutter_bake.identity
    if identity:
        _draw_state(layout, scene, effect, strip)
    row = layout.row(align=True)
    row.operator_menu_enum("shutter.bake", "file_format", text="Bake Again" if identity else "Bake to Strip")
    if identity:
        layout.operator("shutter.unbake")


def _draw_state(layout: UILayout, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    if not baked_strips.baked_of(scene, strip):
        sentence(layout, iface_("The baked strip was deleted"), "ERROR")
    elif (is_stale := baked_strips.known_stale(scene, effect, strip)) is None:
        main_thread.later(_ask_whether_stale, STILL)  # not while drawing: it reads the whole effect
    elif is_stale:
        sentence(layout, iface_("The effect has changed since it was baked"), "ERROR")
    else:
        sentence(layout, iface_("Baked, and up to date"), "CHECKMARK")


def _ask_whether_stale() -> None:
    if (active := selection.active(bpy.context)) is not None:
        baked_strips.is_stale(*active)
        redraw(bpy.context)


classes = (panel("_bake", "Bake", draw_panel),)
unregister = forget
