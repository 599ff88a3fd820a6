"""Operators that build and remove in-between frames, and their panel."""

from concurrent.futures import wait

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_n as n_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import EnumProperty
from bpy.types import Context, Event, Operator, PropertyGroup, Scene, Strip, UILayout

from ...core import messages
from ...core.messages import EffectError
from ...core.model.choices import INBETWEENS
from ..data import inbetween_settings, selection, strips
from ..devices import main_thread
from ..rendering import inbetween_build, strobing
from ..rendering.effect_source import FAULTS
from .note_buttons import Button
from .operator_bases import Beside, OfEffect, redraw, report_warning, show_status
from .panel_parts import draw_progress, draw_properties, sentence

TICK = 0.25  # seconds


def stop() -> None:
    """As inbetween_build.stop; and nothing is measured any more."""
    inbetween_build.stop()
    strobing.forget()


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


def _why_busy(_effect: PropertyGroup) -> str | None:
    is_busy = inbetween_build.running() is not None
    return rpt_("In-between frames are being built; Esc stops that") if is_busy else None


def _why_no_factor(effect: PropertyGroup) -> str | None:
    return rpt_("Choose a factor first") if effect.inbetween == "1" else None


def _why_no_settings(effect: PropertyGroup) -> str | None:
    try:
        inbetween_settings.settings(effect)
    except EffectError as error:
        return str(error)
    return None


class _Building(Beside, OfEffect):
    """Builds, and shows how far it is."""

    tick = TICK

    def wanted(self) -> int | None:
        """Factor of what the strip needs; None: all of the source's, of the effect's own."""
        return None

    def begin(self, context: Context, waits: bool) -> set[str] | None:
        scene, effect, strip = selection.active(context)
        self._build = inbetween_build.start(scene, effect, strip, self.wanted())
        redraw_panels()
        if waits:
            wait([self._build.future])
            return self.end(context, False)
        return self.go_on(context)

    def goes_on(self, _context: Context) -> bool:
        if inbetween_build.running() is not self._build or self._build.future.done():
            return False
        if all(scene.session_uid != self._build.scene for scene in bpy.data.scenes):  # the effect was deleted
            self._build.stop()
        sentence = rpt_("Building in-between frames: {done} of {total}, Esc to stop")
        show_status(sentence.format(done=self._build.done, total=self._build.total))
        redraw_panels()
        return True

    def cancel(self, context: Context) -> None:
        super().cancel(context)
        if inbetween_build.running() is self._build:
            stop()

    def end(self, context: Context, is_stopped: bool) -> set[str] | None:
        if inbetween_build.running() is not self._build:  # a file was loaded
            return {"CANCELLED"}
        if is_stopped:
            self._build.stop()
        inbetween_build.ended()
        redraw(context)
        state = self._build.result()
        if state.name == "ready":
            self.report({"INFO"}, rpt_("In-between frames are built"))
            return self.built()
        sentence = rpt_("Stopped: {done} of {total} are built")
        report_warning(self, sentence.format(done=state.done, total=state.total))
        return {"CANCELLED"}

    def built(self) -> set[str] | None:
        """Called once all is built."""
        return None


class SHUTTER_OT_inbetween_build(_Building, Operator):
    """Build the in-between frames that are missing, as files that are kept (Esc stops, and keeps what is built)"""

    bl_label = "Build In-Between Frames"
    bl_options = {"REGISTER"}  # files are not undone
    needs = _why_no_factor, _why_busy, _why_no_settings


class SHUTTER_OT_smooth_streaks(_Building, Operator):
    """Build the in-between frames that smooth streaks take, and use them (Esc stops, and keeps what is built)"""

    bl_label = "Smooth Streaks"
    needs = (_why_busy,)  # what else is wrong is reported: where it is clicked, nothing is greyed out

    factor: EnumProperty(name="Factor", items=INBETWEENS[1:])

    def wanted(self) -> int | None:
        return int(self.factor)

    def built(self) -> set[str] | None:
        """The factor is set now, so that the picture never lacks frames, and nothing is left of a build that was
        stopped."""
        effects = (effect for scene in bpy.data.scenes for effect in scene.virtual_shutter.effects)
        effect = next((each for each in effects if each.scene and each.scene.session_uid == self._build.scene), None)
        if effect is None:
            return {"CANCELLED"}
        effect.inbetween = self.factor
        return None


class SHUTTER_OT_inbetween_purge(OfEffect, Operator):
    """Remove the files of all in-between frames of the effect's source, of every factor and method"""

    bl_label = "Remove In-Between Frames"
    bl_options = {"REGISTER"}
    needs = _why_busy, _why_no_settings

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


def draw_panel(layout: UILayout, scene: Scene, effect: PropertyGroup, strip: Strip) -> None:
    build = inbetween_build.running()
    if build is not None and build.scene != effect.scene.session_uid:
        build = None  # of another effect
    column = layout.column()
    column.enabled = build is None
    column.prop(effect, "inbetween", text="Factor")
    column = column.column()
    is_on = effect.inbetween != "1"
    column.active = is_on
    draw_properties(column, effect, "inbetween_method", "inbetween_place")
    if build is not None:
        draw_progress(layout, build.done, build.total)
    elif is_on:
        try:
            _draw_look(layout, inbetween_build.look(scene, effect, strip))
        except FAULTS as error:
            sentence(layout, str(error), "ERROR")
    row = layout.row(align=True)
    row.operator("shutter.inbetween_build", text="Build")
    row.operator("shutter.inbetween_purge", text="Remove")


# How a state of in-between frames is called, and its icon.
_STATES = {
    "missing": (n_("Missing"), "ERROR"),
    "partial": (n_("Partial: {done} of {total}"), "ERROR"),
    "stale": (n_("Stale: the source has changed"), "ERROR"),
    "ready": (n_("Ready"), "CHECKMARK"),
}


def _draw_look(layout: UILayout, look: inbetween_build.Look) -> None:
    words, icon = _STATES[look.state.name]
    words = iface_(words).format(done=look.state.done, total=look.state.total)
    column = layout.column(align=True)
    sentence(column, words, icon)
    if look.size:
        size = size_in_words(look.size)
        column.label(text=iface_("{size} on disk").format(size=size), icon="DISK_DRIVE", translate=False)
    if look.state.name != "ready":
        if look.estimate:
            size = size_in_words(look.estimate)
            column.label(text=iface_("About {size} when built").format(size=size), icon="BLANK1", translate=False)
        elif look.estimate is None:
            main_thread.later(redraw_panels, TICK)


def unregister() -> None:
    stop()
