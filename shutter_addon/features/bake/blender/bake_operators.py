"""Operators and a panel that bake an effect to a strip, which plays without computing the effect, and unbake it.

Baked strips are movie or image strips with a rendered effect, above the muted effect strip. Both strips have the same
bake identity, which cuts and copies keep.
"""

import uuid
from dataclasses import dataclass

import bpy
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, MetaStrip, Operator, PropertyGroup, Scene, SequenceEditor, Strip, UILayout

from ....blender.data import effect_version, external_files, fcurves, selection, strips
from ....blender.devices import main_thread
from ....blender.editing import add_effect, match_source
from ....blender.interface.operator_bases import Named, operator, redraw
from ....blender.interface.panel_parts import panel, sentence
from ....blender.output import film_output
from ....core import messages, revision
from ....core.messages import EffectError, UserError, of_file
from . import baked_film

TICK = 0.5  # seconds between two looks at the job
STILL = 1.0  # seconds before the panel asks again whether the bake is outdated
FORMATS = (
    ("MOVIE", "Movie", "H.264, for playback: small errors and no transparency"),
    ("OPEN_EXR", "OpenEXR", "A folder of pictures in full precision; playback is slower"),
)


@dataclass
class _Bake:
    """The state of baking in this Blender.

    Attributes:
        running: The bake that is running in another process; None: none.
        stopped: The bake that was stopped last, which may still be finishing a frame; None: none was.
        failure: The identity of the effect whose bake failed last, and a sentence that says why; empty texts: none
            failed since the last bake began.
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
    if match_source.effects_on(self.edit, self.effect_strip):
        words = rpt_('"{strip}" is the input of another strip, which would not show the baked one')
        raise EffectError(words.format(strip=self.effect_strip.name))
    _channel(self.edit, self.effect_strip)  # there has to be one
    film = baked_film.film_of(self.edit, effect, self.effect_strip, self.file_format)
    try:
        if bpy.app.background:
            baked_film.render(self.edit, effect, self.effect_strip, film, lambda: None)
        if film.is_finished():
            add_strip(self.edit, self.effect_strip, film)
            return None
        _bake.running = baked_film.start(self.edit, effect, self.effect_strip, film)
    except (film_output.OutputError, OSError) as error:
        raise UserError(of_file(error, film.place)) from None
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
    scene, strip = self.edit, self.effect_strip
    parts = effect_parts(scene, strip)
    for baked in baked_of(scene, strip):
        (baked.parent_meta() or scene.sequence_editor).strips.remove(baked)
    for part in parts:
        _move(part.parent_meta() or scene.sequence_editor, part, part.virtual_shutter_bake.channel)
        part.mute = False
        part.property_unset("virtual_shutter_bake")


def _look() -> float | None:
    """See whether the running bake has ended: if it made the film, add the baked strip, else note why it failed.

    This waits while Blender renders or the user drags something. It is a timer of Blender: the result says after how
    many seconds Blender calls it again, and None ends it.
    """
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
    """Add the baked strip of a bake that has finished. Return why that is impossible; None: it was added."""
    scene = strips.scene_of_uid(job.scene)
    parts = [s for s in strips.effect_strips(scene) if s.scene.virtual_shutter.identity == job.effect] if scene else []
    if not parts:
        return rpt_('the strip was removed during the bake; its film is "{path}"').format(path=job.film.place)
    try:
        add_strip(scene, next((part for part in parts if part.name == job.strip), parts[0]), job.film)
    except (EffectError, RuntimeError) as error:
        return messages.sentence(error)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo_push(message=bake.bl_label)
    return None


def stop() -> None:
    """End the running bake. Finished frames are kept."""
    if (job := _bake.running) is not None:
        _bake.running, _bake.stopped = None, job
        job.end()


def forget() -> None:
    """End the running bake and forget why one failed, before another file is loaded."""
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
    if not baked_of(scene, strip):
        sentence(layout, iface_("The baked strip was deleted"), "ERROR")
    elif (has_changed := revision.known("bake", _place(scene, effect, strip))) is None:
        main_thread.later(_ask_whether_stale, STILL)  # not while drawing: is_stale reads the whole effect
    elif has_changed:
        sentence(layout, iface_("The effect has changed since it was baked"), "ERROR")
    else:
        sentence(layout, iface_("Baked, and up to date"), "CHECKMARK")


def _ask_whether_stale() -> None:
    if (active := selection.active(bpy.context)) is not None:
        is_stale(*active)
        redraw(bpy.context)


def add_strip(scene: Scene, strip: Strip, film: baked_film.Film) -> Strip:
    """Show a finished film in place of the effect: add a baked strip, mute the effect strip, and connect both.

    A baked strip of an older bake is removed if it overlaps the effect strip. The baked strip lies above the effect
    strip, unless other strips lie between them. Then it takes the effect strip's channel, so that these stay above it,
    and the effect strip moves up to a free channel.

    Args:
        scene: The scene of the edit.
        strip: The effect strip.

    Returns:
        The baked strip.

    Raises:
        EffectError: No channel above the effect strip is free.
    """
    owner = strip.parent_meta() or scene.sequence_editor
    for older in [baked for baked in baked_of(scene, strip) if strips.overlap(baked, strip)]:
        owner.strips.remove(older)
        _move(owner, strip, strip.virtual_shutter_bake.channel)
    home = strip.channel
    name, start = data_("{strip} Baked").format(strip=strip.name), round(strips.origin(strip)) + film.frames.start
    is_movie = film.kind == "MOVIE"
    files = [external_files.relative(str(path)) for path in ([film.place] if is_movie else film.pictures)]
    baked = add_effect.new_footage(owner.strips, name, files, _channel(scene, strip), start, is_movie)
    baked.left_handle, baked.right_handle = strip.left_handle, strip.right_handle
    if any(home < each.channel < baked.channel and strips.overlap(each, strip) for each in owner.strips):
        # Strips above the effect have to stay above its film.
        spare = baked.channel
        _move(owner, strip, _channel(scene, strip))
        _move(owner, baked, home)
        _move(owner, strip, spare)
    add_effect.copy_look(strip, baked, keys=True)
    if baked.color_multiply == strips.IN_CODE_VALUES:  # films do not need it
        baked.color_multiply = 1
    baked.blend_type, baked.blend_alpha = strip.blend_type, strip.blend_alpha
    alpha = [f"{each.path_from_id()}.blend_alpha" for each in (strip, baked)]
    fcurves.copy_curves(scene, alpha[0], scene, alpha[1])
    match_source.append_modifiers(scene, strip, baked)
    strip.mute = True
    identity = uuid.uuid4().hex
    for each in (strip, baked):
        noted = each.virtual_shutter_bake
        noted.identity, noted.version, noted.channel = identity, film.version, home
        noted.first, noted.count = film.frames.start, len(film.frames)
    baked.color_tag = strip.color_tag
    add_effect.connect(scene, [baked, strip, *strip.connections])
    return baked


def _channel(scene: Scene, strip: Strip) -> int:
    """Return the lowest unmuted channel above an effect strip where no other strip overlaps its time.

    Raises:
        EffectError: There is none.
    """
    owner = strip.parent_meta() or scene.sequence_editor
    for channel in range(strip.channel + 1, strips.CHANNELS + 1):
        if _is_free(owner, strip, channel) and not owner.channels[channel].mute:
            return channel
    words = rpt_('no channel above "{strip}" has room for the baked strip')
    raise EffectError(words.format(strip=strip.name))


def _is_free(owner: SequenceEditor | MetaStrip, strip: Strip, channel: int) -> bool:
    return not any(other.channel == channel and strips.overlap(other, strip) for other in owner.strips)


def _move(owner: SequenceEditor | MetaStrip, strip: Strip, channel: int) -> None:
    """Move a strip to a channel, but only if there is room; otherwise Blender would shift it in time."""
    if _is_free(owner, strip, channel):
        strip.channel = channel


def baked_of(scene: Scene, strip: Strip) -> list:
    """Return the baked strips of an effect strip at the time they were baked for, not copies moved elsewhere."""
    start = round(strips.origin(strip))
    parts = [other for other in selection.of_bake(scene, strip) if other.type in strips.SOURCES]
    return [part for part in parts if round(strips.origin(part)) - part.virtual_shutter_bake.first == start]


def effect_parts(scene: Scene, strip: Strip) -> list:
    """Return all effect strips into which a baked effect strip was cut, itself included; []: it is not baked."""
    start = round(strips.origin(strip))
    parts = (other for other in selection.of_bake(scene, strip) if round(strips.origin(other)) == start)
    return [part for part in parts if part.type == "SCENE"]


def is_stale(scene: Scene, effect: PropertyGroup, strip: Strip) -> bool:
    """Tell whether a bake of an effect is out of date: the effect has changed since, or cannot be rendered any more.

    It is also out of date if the effect strip shows frames that were not baked. The result is cached until something in
    the file changes.

    Args:
        scene: The scene of the edit.
        strip: The effect strip.
    """
    place = _place(scene, effect, strip)
    return revision.until_change("bake", place, lambda: effect_version.is_changed(scene, effect, strip))


def _place(scene: Scene, effect: PropertyGroup, strip: Strip) -> tuple:
    return scene.session_uid, effect.identity, strip.name


classes = (panel("_bake", "Bake", draw_panel, bl_order=2),)
unregister = forget
