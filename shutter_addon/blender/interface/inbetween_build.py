"""In-between frames of an effect: how far they are built, the build in a thread of its own, and their removal."""

import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from typing import NamedTuple

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Operator

from ...core import messages
from ...media import MediaError, inbetween_cache
from ...media.inbetween import build, estimate
from ..data import inbetween_settings, selection, source_media, strips, validation
from ..rendering import invalidation as finished
from ..rendering.session import FAULTS
from .operators import _OfEffect, redraw, refused

TICK = 0.25  # seconds
_FRESH = 1.0  # seconds that files are not asked again, as panels are drawn often
_KEPT = 16


class Look(NamedTuple):
    """What a panel shows of an effect's in-between frames.

    state: how far they are built
    size: bytes that the source's take, of all factors and methods
    estimate: bytes that they will take about; None while that is being found out, 0 if it cannot be"""

    state: inbetween_cache.State
    size: int
    estimate: int | None


_media: dict[tuple, tuple] = {}  # by source_media.media_key: the medium, its file not open; bytes for a factor of 2
_looks: dict[tuple, tuple[float, inbetween_cache.State, int]] = {}  # when it was looked, and what was found
_running: "Build | None" = None
_timer = None


def look(edit, effect, strip) -> Look:
    """How things are, or were a second ago. MediaError, EffectError: there is no source, or no place for frames."""
    source = strips.source_of(edit, effect, strip)
    settings = inbetween_settings.settings(effect)
    medium, doubled = _known(source)
    key = source_media.media_key(source), *settings
    when, *found = _looks.get(key, (0.0,))
    if not when or time.monotonic() - when > _FRESH:
        found = inbetween_cache.state(medium, *settings), inbetween_cache.size(settings[0], medium)
        _looks[key] = time.monotonic(), *found
        _trim(_looks)
    return Look(*found, doubled.result() * (settings[1] - 1) if doubled.done() else None)


def _known(source) -> tuple:
    """The source strip's medium, and a future of the bytes that its in-between frames take for a factor of 2."""
    key = source_media.media_key(source)
    if key not in _media:
        medium = source_media.open_media(source)
        medium.close()
        _media[key] = medium, _in_thread(_estimated, medium)
    _trim(_media)
    return _media[key]


def _trim(known: dict) -> None:
    """Lets the oldest go."""
    while len(known) > _KEPT:
        del known[next(iter(known))]


def _estimated(medium) -> int:
    with medium, suppress(MediaError, OSError):  # a build says what is wrong
        return estimate(medium, 2)
    return 0


def _in_thread(function, *arguments) -> Future:
    pool = ThreadPoolExecutor(1, "Virtual Shutter")
    future = pool.submit(function, *arguments)
    pool.shutdown(wait=False)
    return future


class Build:
    """In-between frames of an effect that are being built, by a thread that touches no bpy.

    scene: session_uid of the effect's scene; done, total: pairs of neighbouring source frames
    future: how far it came, an inbetween_cache.State; or MediaError"""

    def __init__(self, edit, effect, strip):
        """EffectError, MediaError: it cannot begin."""
        settings, medium = (
            inbetween_settings.settings(effect),
            source_media.open_media(strips.source_of(edit, effect, strip)),
        )
        self.scene = effect.scene.session_uid
        self.done, self.total = 0, medium.count - 1
        self._stopped = threading.Event()
        self.future = _in_thread(self._build, medium, *settings)

    def _build(self, medium, *settings):
        with medium:
            return build(medium, *settings, update=self._update, cancelled=self._stopped.is_set)

    def _update(self, done, _total):
        self.done = done

    def stop(self) -> None:
        """Has it end soon; what is finished is kept."""
        self._stopped.set()


def running() -> Build | None:
    """The build that runs: one at a time, as it uses the whole machine."""
    return _running


def stop() -> None:
    """Ends the build that runs, if any, and forgets what is known: when a file is loaded, and when the extension
    goes."""
    if _running is not None:
        _running.stop()
        wait([_running.future])
        _ended()
    wait([doubled for _medium, doubled in _media.values()])
    _media.clear()
    _looks.clear()
    inbetween_cache.forget()


def _started(context, build: Build) -> None:
    global _running, _timer
    _running, finished.building = build, True
    if not bpy.app.background:
        _timer = context.window_manager.event_timer_add(TICK, window=context.window)


def _ended() -> None:
    global _running, _timer
    _running, finished.building = None, False
    _looks.clear()
    _say(None)
    if _timer is not None:
        bpy.context.window_manager.event_timer_remove(_timer)
        _timer = None


def _say(sentence: str | None) -> None:
    """In the status bar, of whichever workspace; None: what Blender says."""
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(sentence)


def redraw_panels(context) -> None:
    """Draws panels again, and no preview."""
    kinds = {"SEQUENCE_EDITOR": "UI", "PROPERTIES": "WINDOW"}
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.type == kinds.get(area.type):
                    region.tag_redraw()


def size_in_words(size: int) -> str:
    """Bytes as "340 MB", say."""
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{size / 1e6:.0f} MB" if size >= 1e6 else f"{size / 1e3:.0f} kB"


class _OfInbetweens(_OfEffect):
    """Works on files, which are not undone."""

    bl_options = {"REGISTER"}

    @classmethod
    def possible(cls, effect):
        if _running is not None:
            return refused(cls, rpt_("In-between frames are being built; Esc stops that"))
        try:
            inbetween_settings.settings(effect)
        except validation.EffectError as error:
            return refused(cls, str(error))
        return True


class SHUTTER_OT_inbetween_build(_OfInbetweens, Operator):
    """Build the in-between frames that are missing, as files that are kept (Esc stops, and keeps what is built)"""

    bl_idname = "shutter.inbetween_build"
    bl_label = "Build In-Between Frames"

    @classmethod
    def possible(cls, effect):
        if effect.inbetween == "1":
            return refused(cls, rpt_("Choose a factor first"))
        return super().possible(effect)

    def invoke(self, context, _event):
        if bpy.app.background:
            return self.execute(context)
        if not self._begin(context):
            return {"CANCELLED"}
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        return self._finish(context) if self._begin(context) else {"CANCELLED"}

    def _begin(self, context) -> bool:
        try:
            self._build = Build(*selection.active(context))
        except FAULTS as error:
            self.report({"ERROR"}, str(error))
            return False
        _started(context, self._build)
        redraw_panels(context)
        return True

    def modal(self, context, event):
        if _running is not self._build:  # a file was loaded
            return {"CANCELLED"}
        if event.type == "ESC" and event.value == "PRESS":
            self._build.stop()
            return {"RUNNING_MODAL"}
        if event.type == "TIMER":
            if self._build.future.done():
                return self._finish(context)
            if all(scene.session_uid != self._build.scene for scene in bpy.data.scenes):  # the effect was deleted
                self._build.stop()
            sentence = rpt_("Building in-between frames: {done} of {total}, Esc to stop")
            _say(sentence.format(done=self._build.done, total=self._build.total))
            redraw_panels(context)
        return {"PASS_THROUGH"}

    def cancel(self, _context):
        """Its window was closed."""
        if _running is self._build:
            stop()

    def _finish(self, context):
        wait([self._build.future])
        _ended()
        redraw(context)
        try:
            state = self._build.future.result()
        except FAULTS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if state.name == "ready":
            self.report({"INFO"}, rpt_("In-between frames are built"))
            return {"FINISHED"}
        sentence = rpt_("Stopped: {done} of {total} are built")
        self.report({"WARNING"}, sentence.format(done=state.done, total=state.total))
        return {"CANCELLED"}


class SHUTTER_OT_inbetween_purge(_OfInbetweens, Operator):
    """Remove the files of all in-between frames of the effect's source, of every factor and method"""

    bl_idname = "shutter.inbetween_purge"
    bl_label = "Remove In-Between Frames"

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(
            self,
            event,
            title=iface_("Remove In-Between Frames?"),
            message=iface_("They can be built again"),
            confirm_text=iface_("Remove"),
            icon="WARNING",
            translate=False,
        )

    def change(self, context, effect):
        edit, effect, strip = selection.active(context)
        left = []
        try:
            folder, (medium, _) = inbetween_settings.folder(effect), _known(strips.source_of(edit, effect, strip))
            freed = inbetween_cache.purge(folder, medium, lambda *place: left.append(place))
        except FAULTS as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        with suppress(OSError):  # other sources' are left there, or it never was
            folder.rmdir()
        _looks.clear()
        self.report({"INFO"}, rpt_("Removed {size}").format(size=size_in_words(freed)))
        for place, count in left:
            sentence = rpt_('"{folder}": other files stay there ({count})')
            self.report({"WARNING"}, messages.sentence(sentence.format(folder=place, count=count)))
        return None


classes = (SHUTTER_OT_inbetween_build, SHUTTER_OT_inbetween_purge)


def register():
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister():
    stop()
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
