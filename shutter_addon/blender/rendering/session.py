"""A render session: a device, and the renderers of the effects that were shown last, which keep their frames."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, Future, wait
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ...compute.devices.device import NoDeviceError
from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core import stopping, threads
from ...core.messages import translated
from ...core.model.state_at import state_at
from ...core.pixels.shown_levels import Display
from ...core.stopping import StoppedError
from ...media.matte_values import Late, MatteValues
from ..data.snapshot import Snapshot
from ..devices import available, main_thread
from ..devices.blender_gpu import require_context
from . import render_settings
from .effect_source import FAULTS, FULL, Detail, SourceKey, clip_of
from .render_job import Where, where

T = TypeVar("T")
Say = Callable[[str], None]  # takes a sentence for the user
Chosen = tuple[str, str | None]  # a device, a key of available.OPEN, and why it is a lesser one
_PATIENCE = 0.1  # seconds between two looks at whether a picture is still wanted
_KEPT = 4  # effects whose frames are kept; with more in one frame, each frame decodes all windows again
Place = tuple[int, bool]  # SourceKey.place


class Work(NamedTuple):
    """A function that a session's device is running or will run.

    Attributes:
        future: Of its result.
        ended: Makes it end before its next step when it is set.
    """

    future: Future
    ended: threading.Event

    def break_off(self) -> None:
        self.ended.set()
        self.future.cancel()

    def result(self) -> Any:
        """Wait for the result and return it. Break the work off if the result is no longer wanted.

        Raises:
            StoppedError, NoDeviceError: As in result_of.
        """
        try:
            return result_of(self.future)
        except StoppedError:
            self.break_off()
            raise


def result_of(future: Future[T]) -> T:
    """Wait for a future and return its result. On the window's main thread, serve calls from other threads.

    Raises:
        StoppedError: The result is no longer wanted (stopping.once).
        NoDeviceError: The work needs Blender's GPU, which cannot be used now, so waiting would never end.
    """
    is_window = where() is Where.WINDOW
    while not wait([future], 0 if is_window else _PATIENCE).done:
        if is_window and not main_thread.serve():
            require_context()
        stopping.check()
    return future.result()


def broken_off(stopped: Callable[[], bool], function: Callable[..., T], *arguments: object) -> T:
    """Call a function and return its result. It raises StoppedError at its next step once `stopped()` returns True."""
    with stopping.once(stopped):
        return function(*arguments)


@dataclass(frozen=True)
class RenderContext:
    """For whom pictures are made: with which session, and in which form.

    Attributes:
        session: Makes them on its device.
        say: Called with a sentence for the user about a lesser device, or about what cannot be done.
        levels: Whether pictures are 8-bit display levels (Request.levels).
        display: How light becomes these levels (Request.display); None: as Request has it by default.
    """

    session: RenderSession
    say: Say = print
    levels: bool = False
    display: Display | None = None

    def request(self, snapshot: Snapshot, frame: float, detail: Detail | None = None) -> Request:
        """Return the request for an effect strip's picture at a timeline frame: what it depends on, as plain data.

        Args:
            snapshot: The effect and its source, as plain data.
            frame: The timeline frame.
            detail: The picture's detail. None: that of the effect's last picture, or full detail if there is none. This
                suffices for a caller that only reads the request and makes no picture.

        Raises:
            effect_source.FAULTS: The effect cannot be shown.
            StoppedError: The picture is no longer wanted.
        """
        session = self.session
        key = SourceKey.of(snapshot, detail or session.last_detail(snapshot.scene))
        source = session.renderer(key, self.say).source
        if (last := session.requests.get(key.place)) and last[0] is snapshot and last[1] == frame:
            request = last[2]
            if (request.source, request.levels, request.display) == (key, self.levels, self.display):
                return request
        clip = clip_of(snapshot, source)
        with translated(rpt_):
            index, state, way = state_at(snapshot.effect, clip, frame)
        state = state.in_blocks(max(state.options.aggregate // key.detail.divisor, 1))
        request = Request(index=index, state=state, direction=way, source=key, levels=self.levels, display=self.display)
        session.requests[key.place] = snapshot, frame, request
        return request

    def renderer(self, request: Request) -> Renderer:
        """Return the renderer that makes a request's picture, opened if necessary."""
        return self.session.renderer(request.source, self.say)


class RenderSession:
    """A device that composes pictures, and the renderers of the effects that were shown last, which keep their frames.

    The device is opened when it is first used. If it can be used from any thread, it works on a thread of its own.
    """

    def __init__(self, choose: Callable[[], Chosen], ask_others: Callable[[], None], late: Late | None = None) -> None:
        """Make a session, without opening anything.

        Args:
            choose: Returns the device and why it is a lesser one, as available.choose.
            ask_others: Called when the GPU's memory is full, to free what other sessions have there.
            late: Called for mattes that are not tracked yet, as in MatteValues; None: pictures wait until they are.
        """
        self._choose, self._ask_others, self._late = choose, ask_others, late
        self._frees_others = False  # whether others free memory, in the middle of a picture
        self._chosen: Chosen | None = None
        self._executor: Executor = threads.pool(1)
        self._compositor: Future | None = None
        self._renderers: dict[Place, tuple[SourceKey, Renderer]] = {}
        self.requests: dict[Place, tuple[Snapshot, float, Request]] = {}  # the last ones, with their snapshots
        self._shown: dict[int, float] = {}  # last timeline frame by scene
        self._begun: dict[int, tuple[tuple, Work]] = {}  # key and work of the begun picture by scene

    @property
    def device(self) -> str:
        """The device's name, a key of available.OPEN. The device is chosen once, and again only after `forget`.

        Raises:
            NoDeviceError: The wanted device is missing.
        """
        if self._chosen is None:
            self._chosen = self._choose()
        return self._chosen[0]

    @property
    def threaded(self) -> bool:
        """Whether the device has its own thread; otherwise it belongs to the calling one."""
        return self.device != "blender"

    def run(self, function: Callable[..., T], *arguments: object) -> T:
        """Call a function that uses the device, wait for its turn, and return its result.

        The call goes on even if the picture being made is no longer wanted.
        """
        with stopping.once(stopping.never):
            return self._submit(function, *arguments).result()

    def _submit(self, function: Callable, *arguments: object) -> Work:
        """Queue a function on the device's thread, or call it here at once if the device has none."""
        ended = threading.Event()
        if self.threaded:
            with suppress(RuntimeError):  # at Python's exit, threads take no more work
                return Work(self._executor.submit(broken_off, ended.is_set, function, *arguments), ended)
        done: Future = Future()
        done.set_result(function(*arguments))
        return Work(done, ended)

    def picture(self, request: Request) -> np.ndarray:
        """Return the picture of a request, (H, W, 4), which begin_next may have begun already.

        Raises:
            effect_source.FAULTS: It cannot be made.
            StoppedError: It is no longer wanted.
        """
        key, begun = self._begun.pop(request.source.scene, (None, None))
        if begun is not None and key != request.key:
            begun.break_off()
            begun = None
        return (begun or self._begin(request)).result()

    def _begin(self, request: Request) -> Work:
        return self._submit(self.renderer(request.source).picture, request)

    def begin_next(self, snapshot: Snapshot, frame: float, context: RenderContext) -> None:
        """Begin the picture of a film's next frame, if the last two pictures were of successive frames.

        The result is used only if exactly this picture is asked for next. Does nothing on a device without a thread.

        Args:
            frame: Timeline frame of the last picture.
        """
        if not self.threaded:
            return
        before, self._shown[snapshot.scene] = self._shown.get(snapshot.scene, frame), frame
        step, last = snapshot.film
        if frame - before == step and frame + step <= last and frame + step in snapshot.frames:
            with suppress(*FAULTS):  # raised again when the picture is asked for
                request = context.request(snapshot, frame + step, FULL)
                self._begun[snapshot.scene] = request.key, self._begin(request)

    def last_detail(self, scene: int) -> Detail:
        """Return the detail of an effect's last pictures; without any, full detail.

        Args:
            scene: session_uid of the effect scene.
        """
        known = self._renderers.get((scene, False)) or self._renderers.get((scene, True))
        return known[0].detail if known else FULL

    def renderer(self, key: SourceKey, say: Say = print) -> Renderer:
        """Return the renderer for a key, opened if necessary.

        An effect may have two: one with moments between frames, and one without.

        Raises:
            effect_source.FAULTS: The device or the footage cannot be opened.
        """
        compositor = self._opened(say)
        known = self._renderers.pop(key.place, None)
        if known is None or known[0] != key:
            if known is not None:
                self._submit(known[1].close)
            source = key.open(planes=compositor.takes_planes, keeps=self._late is None)
            mattes = MatteValues(source.width, source.height, source.step, self._late)
            known = key, Renderer(compositor, source, mattes)
        self._renderers[key.place] = known
        while len({scene for scene, _ in list(self._renderers)}) > _KEPT:
            self._submit(self._renderers.pop(next(iter(self._renderers)))[1].close)
        return known[1]

    def open_renderer(self, key: SourceKey) -> Renderer | None:
        """Return the renderer for a key if it is open, else None."""
        known = self._renderers.get(key.place)
        return known[1] if known and known[0] == key else None

    def _opened(self, say: Say) -> Any:
        """Return the compositor, which composes pictures on the device, opened if necessary.

        Args:
            say: Called with a sentence about why the device is a lesser one than wanted.
        """
        if self._compositor is None:
            with stopping.once(stopping.never):
                self._compositor = self._submit(available.OPEN[self.device], render_settings.memory(), self._ask).future
            if self._chosen and (message := self._chosen[1]):
                say(message)
        try:
            return result_of(self._compositor)
        except NoDeviceError:
            self._compositor = None
            raise

    def _ask(self) -> None:
        """Have other sessions free their GPU memory. Keep that of this session, which is in use."""
        self._frees_others = True
        try:
            self._ask_others()
        finally:
            self._frees_others = False

    def free(self) -> None:
        """Free the renderers' GPU memory, unless this session itself asks others for room. Frames load again later."""
        if self._frees_others:
            return
        for _key, renderer in list(self._renderers.values()):
            self.run(renderer.release)

    def rest(self) -> None:
        """Stop making a film's next picture and reading frames ahead. Renderers stay open."""
        self._drop_begun(list(self._begun))
        for _key, renderer in list(self._renderers.values()):
            renderer.source.want(())

    def _drop_begun(self, places: Iterable[int]) -> None:
        for place in places:
            _key, begun = self._begun.pop(place, (None, None))
            if begun is not None:
                begun.break_off()

    def keep(self, scenes: set[int]) -> None:
        """Close the renderers of all effects but those whose effect scenes have these session_uids."""
        self._drop_begun(set(self._begun) - scenes)
        for place in [place for place in (*self.requests, *self._renderers) if place[0] not in scenes]:
            self.requests.pop(place, None)
            _key, renderer = self._renderers.pop(place, (None, None))
            if renderer is not None:
                self._submit(renderer.close)

    def forget(self) -> None:
        """Close all footage and free the device. Blender's GPU is freed when it can next be used."""
        self.keep(set())
        while self._renderers:  # a render job may open more meanwhile
            self.keep(set())
        compositor, self._compositor = self._compositor, None
        if compositor is not None:
            with suppress(NoDeviceError):
                self.run(lambda: compositor.result().release())  # after the rest of a stopped render
        ended, self._executor = self._executor, threads.pool(1)
        ended.shutdown(wait=False)
        self._chosen = None

    def close_if_device_changed(self) -> None:
        """Close everything (`forget`) if another device would be chosen now, as after a change of the preferences."""
        with suppress(NoDeviceError):  # raised again when a picture is asked for
            if self._chosen is None or self._chosen[0] == self._choose()[0]:
                return
        self.forget()
