"""Operators that build and remove in-between frames."""

from concurrent.futures import wait

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, Event, Operator, PropertyGroup

from ...core import messages
from ...core.messages import EffectError
from ...core.model.choices import INBETWEENS
from ..data import inbetween_settings, selection, strips
from ..rendering import inbetween_build, strobing
from .note_buttons import Button
from .operator_bases import UNDOABLE, OfEffect, is_escape, own_classes, redraw, report_warning

TICK = 0.25  # seconds
_RUNS = n_("In-between frames are being built; Esc stops that")

_timer = None


def stop() -> None:
    """As inbetween_build.stop, and the status bar is Blender's again; and nothing is measured any more."""
    inbetween_build.stop()
    strobing.forget()
    _show_end()


def _show_start(context: Context) -> None:
    global _timer
    if not bpy.app.background:
        _timer = context.window_manager.event_timer_add(TICK, window=context.window)
    redraw_panels()


def _show_end() -> None:
    global _timer
    if _timer is not None:  # Blender crashes where a text is taken from the status bar while it quits
        _say(None)
        bpy.context.window_manager.event_timer_remove(_timer)
        _timer = None


def _say(sentence: str | None) -> None:
    """In the status bar, of whichever workspace; None: what Blender says."""
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(sentence)


def redraw_panels() -> None:
    """Draws panels again, and no preview; a timer as well."""
    kinds = {"SEQUENCE_EDITOR": "UI", "PROPERTIES": "WINDOW"}
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.type == kinds.get(area.type):
                    region.tag_redraw()


def size_in_words(size: float) -> str:
    """Bytes as "340 MB", say."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.0f} MB" if size >= 1e6 else f"{size / 1e3:.0f} kB"


def time_in_words(seconds: float) -> str:
    """Seconds as "3 min", say."""
    if seconds >= 3600:
        return f"{seconds / 3600:.1f} h"
    return f"{seconds / 60:.0f} min" if seconds >= 60 else f"{max(seconds, 1):.0f} s"


def strobing_in_words(exposure: strobing.Strobing) -> str:
    """That an exposure has too few frames, and what it takes to have more."""
    sentence = rpt_("Too few frames: steps of {pixels} pixels").format(pixels=f"{exposure.step:.0f}")
    if exposure.seconds is None or exposure.size is None:
        return sentence
    size, time = size_in_words(exposure.size), time_in_words(exposure.seconds)
    return rpt_("{sentence}. In-between frames take about {time}, {size}").format(
        sentence=sentence, time=time, size=size
    )


def smoothing(exposure: strobing.Strobing) -> Button | None:
    """What helps against that; None: nothing does."""
    label = iface_("{factor}× In-Between Frames").format(factor=exposure.factor)
    return Button("shutter.smooth_streaks", label, {"factor": str(exposure.factor)}) if exposure.factor else None


class _OfInbetweens(OfEffect):
    """Works on files, which are not undone."""

    bl_options = {"REGISTER"}

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        if inbetween_build.running() is not None:
            return rpt_(_RUNS)
        try:
            inbetween_settings.settings(effect)
        except EffectError as error:
            return str(error)
        return None


class _Building(_OfInbetweens):
    """Builds, and shows how far it is."""

    def wanted(self) -> int | None:
        """Factor of what the strip needs; None: all of the source's, of the effect's own."""
        return None

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return self.tried(self._begin, context, bpy.app.background)

    def execute(self, context: Context) -> set[str]:
        return self.tried(self._begin, context, True)

    def _begin(self, context: Context, waits: bool) -> set[str]:
        scene, effect, strip = selection.active(context)
        self._build = inbetween_build.start(scene, effect, strip, self.wanted())
        _show_start(context)
        if waits:
            wait([self._build.future])
            return self._finish(context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: Event) -> set[str]:
        if inbetween_build.running() is not self._build:  # a file was loaded
            return {"CANCELLED"}
        if is_escape(event):
            self._build.stop()
            return self.tried(self._finish, context)
        if event.type == "TIMER":
            if self._build.future.done():
                return self.tried(self._finish, context)
            if all(scene.session_uid != self._build.scene for scene in bpy.data.scenes):  # the effect was deleted
                self._build.stop()
            sentence = rpt_("Building in-between frames: {done} of {total}, Esc to stop")
            _say(sentence.format(done=self._build.done, total=self._build.total))
            redraw_panels()
        return {"PASS_THROUGH"}

    def cancel(self, _context: Context) -> None:
        """Its window was closed."""
        if inbetween_build.running() is self._build:
            stop()

    def _finish(self, context: Context) -> set[str]:
        inbetween_build.ended()
        _show_end()
        redraw(context)
        state = self._build.result()
        if state.name == "ready":
            self.report({"INFO"}, rpt_("In-between frames are built"))
            return self.built()
        sentence = rpt_("Stopped: {done} of {total} are built")
        report_warning(self, sentence.format(done=state.done, total=state.total))
        return {"CANCELLED"}

    def built(self) -> set[str]:
        """Called once all is built."""
        return {"FINISHED"}


class SHUTTER_OT_inbetween_build(_Building, Operator):
    """Build the in-between frames that are missing, as files that are kept (Esc stops, and keeps what is built)"""

    bl_label = "Build In-Between Frames"

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        return rpt_("Choose a factor first") if effect.inbetween == "1" else super().why_not(effect)


class SHUTTER_OT_smooth_streaks(_Building, Operator):
    """Build the in-between frames that smooth streaks take, and use them (Esc stops, and keeps what is built)"""

    bl_label = "Smooth Streaks"
    bl_options = UNDOABLE

    factor: EnumProperty(name="Factor", items=INBETWEENS[1:])

    @classmethod
    def why_not(cls, effect: PropertyGroup) -> str | None:
        # What else is wrong is reported: where it is clicked, nothing is greyed out.
        return rpt_(_RUNS) if inbetween_build.running() is not None else None

    def wanted(self) -> int | None:
        return int(self.factor)

    def built(self) -> set[str]:
        """The factor is set now, so that the picture never lacks frames, and nothing is left of a build that was
        stopped."""
        effects = (effect for scene in bpy.data.scenes for effect in scene.virtual_shutter.effects)
        effect = next((each for each in effects if each.scene and each.scene.session_uid == self._build.scene), None)
        if effect is None:
            return {"CANCELLED"}
        effect.inbetween = self.factor
        return {"FINISHED"}


class SHUTTER_OT_inbetween_purge(_OfInbetweens, Operator):
    """Remove the files of all in-between frames of the effect's source, of every factor and method"""

    bl_label = "Remove In-Between Frames"

    def invoke(self, context: Context, event: Event) -> set[str]:
        return context.window_manager.invoke_confirm(
            self,
            event,
            title=iface_("Remove In-Between Frames?"),
            message=iface_("They can be built again"),
            confirm_text=iface_("Remove"),
            icon="WARNING",
            translate=False,
        )

    def change(self, _context: Context, effect: PropertyGroup) -> None:
        freed, left = inbetween_build.purge(effect, strips.source_of(self.edit, effect, self.effect_strip))
        self.report({"INFO"}, rpt_("Removed {size}").format(size=size_in_words(freed)))
        for place, count in left:
            sentence = rpt_('"{folder}": other files stay there ({count})')
            report_warning(self, messages.sentence(sentence.format(folder=place, count=count)))


classes = own_classes(globals())
TIMERS = (redraw_panels,)


def unregister() -> None:
    stop()
