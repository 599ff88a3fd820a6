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
    """A function call that a session has queued or is running: a handle to wait for its result, or to cancel it.

    Attributes:
        future: Gets the function's result, or the error that it raises.
        ended: Once it is set, the function raises StoppedError at its next call of stopping.check.
    """

    future: Future
    ended: threading.Event

    def break_off(self) -> None:
        self.ended.set()
        self.future.cancel()

    def result(self) -> Any:
        """Wait for the function's result and return it. Cancel the function if the caller's own work is cancelled.

        Raises:
            StoppedError, NoDeviceError: As in result_of.
            Exception: Whatever the function raised.
        """
        try:
            return result_of(self.future)
        except StoppedError:
            self.break_off()
            raise


def result_of(future: Future[T]) -> T:
    """Wait for a future and return its result.

    On the main thread of a Blender with a window, make the calls to Blender's GPU that other threads ask for meanwhile.
    The future may depend on them.

    Raises:
        StoppedError: The calling thread's work was cancelled (stopping.check).
        NoDeviceError: On that main thread: such calls wait, but Blender's GPU cannot be used now. Waiting would never
            end.
        Exception: Whatever the future's function raised.
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
    """Which session makes pictures for a caller (a preview or a render), and in which pixel format.

    Attributes:
        session: Makes the pictures on its device.
        say: Called with a sentence for the user when a slower device than wanted is opened.
        levels: Whether pictures have 8-bit sRGB values over black (Request.levels). Otherwise they are scene-linear
            float32.
        display: Converts the finished scene-linear picture to the 8-bit values of Blender's output (Request.display);
            `levels` is then False. None: no such conversion.
    """

    session: RenderSession
    say: Say = print
    levels: bool = False
    display: Display | None = None

    def request(self, snapshot: Snapshot, frame: float, detail: Detail | None = None) -> Request:
        """Return the request for an effect strip's picture at a timeline frame.

        It has all that the picture depends on, as plain data. This opens the device and the footage if necessary. The
        last request for each SourceKey.place is kept, and returned again for the same arguments.

        Args:
            snapshot: The effect and its source, as plain data.
            frame: The timeline frame, which may lie between two whole ones.
            detail: Size, proxy and smoothness of the picture. None: as RenderSession.last_detail. That is enough if the
                caller only reads the request and makes no picture.

        Raises:
            effect_source.FAULTS: The effect cannot be shown.
            StoppedError: The calling thread's work was cancelled.
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
    """A device that composes pictures, with the renderers of the effects shown last: one or two for each.

    Renderers keep the frames that they have loaded, so that the next picture needs few new ones. At most _KEPT effects
    have renderers; the ones unused for longest are closed.

    The device is opened when it is first used. Blender's own GPU ("blender") works on the calling thread, any other
    device on a thread that belongs to the session.
    """

    def __init__(self, choose: Callable[[], Chosen], ask_others: Callable[[], None], late: Late | None = None) -> None:
        """Make a session. This opens neither a device nor footage.

        Args:
            choose: Returns the key in available.OPEN of the device to use, and a sentence for the user if it is a
                slower one than wanted, else None (available.choose).
            ask_others: Called when the GPU's memory is full, so that other sessions free memory on the same GPU.
            late: Called with a matte's file and a frame number when a matte's outline is not tracked to that frame yet.
                The picture is then made with an approximate outline (MatteValues). None: making the picture includes
                the tracking, and newly computed optical flow is stored for later.
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
        """The key of the session's device in available.OPEN.

        It is chosen on the first access, and again only after `forget`.

        Raises:
            NoDeviceError: The device that the user wants is missing.
        """
        if self._chosen is None:
            self._chosen = self._choose()
        return self._chosen[0]

    @property
    def threaded(self) -> bool:
        """Whether the device has its own thread; otherwise it belongs to the calling one."""
        return self.device != "blender"

    def run(self, function: Callable[..., T], *arguments: object) -> T:
        """Call a function that uses the device, wait for it, and return its result.

        The call runs on the device's thread, after those queued before, or directly if the device has no thread.
        Cancelling the caller's work (stopping.once) neither ends the call nor the waiting.

        Args:
            arguments: Its positional arguments.
        """
        with stopping.once(stopping.never):
            return self._submit(function, *arguments).result()

    def _submit(self, function: Callable, *arguments: object) -> Work:
        """Queue a function on the device's thread. Call it here at once if the device has none, or Python exits."""
        ended = threading.Event()
        if self.threaded:
            with suppress(RuntimeError):  # at Python's exit, threads take no more work
                return Work(self._executor.submit(broken_off, ended.is_set, function, *arguments), ended)
        done: Future = Future()
        done.set_result(function(*arguments))
        return Work(done, ended)

    def picture(self, request: Request) -> np.ndarray:
        """Return the picture of a request, when the device has made it.

        If begin_next has begun the same picture, that one is used. A picture that begin_next has begun for another
        request of this effect is cancelled.

        Returns:
            (H, W, 4): float32 scene-linear, or uint8 if the request has `levels` or a `display`.

        Raises:
            effect_source.FAULTS: The picture cannot be made.
            StoppedError: The calling thread's work was cancelled.
        """
        key, begun = self._begun.pop(request.source.scene, (None, None))
        if begun is not None and key != request.key:
            begun.break_off()
            begun = None
        return (begun or self._begin(request)).result()

    def _begin(self, request: Request) -> Work:
        return self._submit(self.renderer(request.source).picture, request)

    def begin_next(self, snapshot: Snapshot, frame: float, context: RenderContext) -> None:
        """Begin a film's next picture of an effect on the device's thread, while Blender still uses the last one.

        The next timeline frame is `frame` plus the scene's frame step. Its picture is begun only if this call's frame
        follows that of the effect's last call by one step, and if the next frame lies within the film and the snapshot.
        If `picture` is asked for another one of the effect, the begun one is cancelled. Does nothing on a device
        without a thread.

        Args:
            snapshot: The effect and its source, as plain data.
            frame: Timeline frame of the picture that was just made.
            context: The pixel format of pictures. Its session is this one.
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
        """Return the detail with which an effect's renderer is open, or full detail if none is open.

        If two are open, it is that of the one without moments between filmed frames.

        Args:
            scene: session_uid of the effect scene.
        """
        known = self._renderers.get((scene, False)) or self._renderers.get((scene, True))
        return known[0].detail if known else FULL

    def renderer(self, key: SourceKey, say: Say = print) -> Renderer:
        """Return the renderer that reads what `key` tells. Open the device and the footage if necessary.

        An effect may have two open renderers: one with moments (frames computed between filmed ones) and one without.
        Opening one closes an older one of the same effect and kind that has another key.

        Args:
            key: The footage and how it is read.
            say: Called with a sentence for the user if this opens a device that is slower than the wanted one.

        Raises:
            effect_source.FAULTS: The device or the footage cannot be opened.
            StoppedError: The calling thread's work was cancelled.
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
        """Return the compositor (request.Compositor), which composes pictures on the device. Open it at the first call.

        Args:
            say: Called with a sentence for the user at the first call, if the device is a slower one than wanted.

        Raises:
            NoDeviceError: The device cannot be opened. The next call tries again.
            StoppedError: The calling thread's work was cancelled.
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
