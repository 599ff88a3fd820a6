"""A render session: a device, and the renderers of the effects that were shown last, whose frames it keeps."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, Future, wait
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core import stopping, threads
from ...core.messages import translated
from ...core.model.state_at import state_at
from ...core.pixels.matte_grid import block_means
from ...core.pixels.shown_levels import Display
from ...core.stopping import StoppedError
from ...devices.device import NoDeviceError
from ...media.matte_values import Late, MatteValues
from ..data.snapshot import Snapshot
from ..devices import available, main_thread
from ..devices.blender_gpu import require_context
from . import render_settings
from .effect_source import FAULTS, FULL, Detail, SourceKey, clip_of
from .render_job import Where, where

T = TypeVar("T")
_PATIENCE = 0.1  # seconds between two looks at whether a picture is still wanted
# Effects whose frames are kept: more than these in one frame decode their windows again for every frame.
_KEPT = 4
Place = tuple[int, bool]  # of a renderer: SourceKey.place


class Work(NamedTuple):
    """What a session's device does.

    future: its result to come; ended: set, it ends before its next step; relayed: the main thread has its GPU"""

    future: Future
    ended: threading.Event
    relayed: bool

    def break_off(self) -> None:
        self.ended.set()
        self.future.cancel()

    def result(self) -> Any:
        """As result_of. Not waited for, it is broken off."""
        try:
            return result_of(self.future, self.relayed)
        except StoppedError:
            self.break_off()
            raise


def result_of(future: Future[T], relayed: bool) -> T:
    """The future's result. StoppedError: it is not wanted any longer (`stopping.once`). NoDeviceError: it cannot be
    waited for, as Blender's GPU is not current."""
    is_window = where() is Where.WINDOW
    while not wait([future], 0 if is_window else _PATIENCE).done:
        if is_window and not main_thread.serve() and relayed:
            require_context()
        stopping.check()
    return future.result()


def broken_off(stopped: Callable[[], bool], function: Callable[..., T], *arguments: object) -> T:
    """What a function gives, unless it is broken off."""
    with stopping.once(stopped):
        return function(*arguments)


@dataclass(frozen=True)
class RenderContext:
    """For whom pictures are made, whatever they show.

    session: whose device makes them
    say: called with a sentence when the device is a lesser one, or something cannot be done
    levels: they are of 8-bit display code values (Request.levels)
    display: what shows them, whose levels are wanted (Request.display)"""

    session: RenderSession
    say: Callable[[str], None] = print
    levels: bool = False
    display: Display | None = None

    def request(self, snapshot: Snapshot, frame: float, detail: Detail | None = None) -> Request:
        """See RenderSession.request."""
        return self.session.request(snapshot, frame, self, detail)

    def renderer(self, request: Request) -> Renderer:
        """See RenderSession.renderer."""
        return self.session.renderer(request.source, self.say)


class RenderSession:
    """A compositor, opened when it is first used, and the renderers of the effects that were shown last."""

    def __init__(
        self,
        choose: Callable[[], tuple[str, str | None]],
        ask_others: Callable[[], None],
        late: Late | None = None,
    ) -> None:
        """choose: gives the device, as available.choose; ask_others: called where the GPU has no room, has others free
        what they hold of it; late: see MatteValues."""
        self._choose, self._ask_others, self._late = choose, ask_others, late
        self._asks = False  # others for room, in the middle of a picture
        self._chosen: tuple[str, str | None] | None = None
        self._executor: Executor | None = None
        self._compositor: Future | None = None
        self._renderers: dict[Place, tuple[SourceKey, Renderer]] = {}
        self._requests: dict[Place, tuple[Snapshot, float, Request]] = {}  # the last ones
        self._shown: dict[int, float] = {}  # by scene: the timeline frame that was shown last
        self._begun: dict[int, tuple[tuple, Work]] = {}  # by scene: the key of a request, its picture

    @property
    def device(self) -> str:
        """Its device, a key of available.OPEN; it stays until all is forgotten. NoDeviceError: there is none."""
        if self._chosen is None:
            self._chosen = self._choose()
        return self._chosen[0]

    @property
    def threaded(self) -> bool:
        """Whether the device belongs to a thread of its own; otherwise to whichever calls."""
        return self.device != "blender"

    def run(self, function: Callable[..., T], *arguments: object) -> T:
        """The result of a function that uses the device, wanted whatever becomes of the picture that is made."""
        with stopping.once(stopping.never):
            return self._submit(function, *arguments).result()

    def _submit(self, function: Callable, *arguments: object) -> Work:
        """A function that uses the device, called after those before it."""
        ended = threading.Event()
        if self.threaded:
            if self._executor is None:
                self._executor = threads.pool(1)
            with suppress(RuntimeError):  # Python ends, and its threads take no more work
                future = self._executor.submit(broken_off, ended.is_set, function, *arguments)
                return Work(future, ended, self.device == "relayed")
        done: Future = Future()
        done.set_result(function(*arguments))
        return Work(done, ended, False)

    def request(
        self, snapshot: Snapshot, frame: float, context: RenderContext, detail: Detail | None = None
    ) -> Request:
        """What an effect strip shows at a timeline frame. One of FAULTS: it cannot be shown. StoppedError: it is not
        wanted any longer.

        detail: None: as it was the last time, for who asks for no picture"""
        if detail is None:
            known = map(self._renderers.get, ((snapshot.scene, False), (snapshot.scene, True)))
            detail = next((each[0].detail for each in known if each), FULL)
        key = SourceKey.of(snapshot, detail)
        source = self.renderer(key, context.say).source
        if (last := self._requests.get(key.place)) and last[0] is snapshot and last[1] == frame:
            request = last[2]
            if (request.source, request.levels, request.display) == (key, context.levels, context.display):
                return request
        with translated(rpt_):
            index, state, direction = state_at(snapshot.effect, clip_of(snapshot, source), frame)
        request = Request(
            index=index,
            state=state.in_blocks(max(state.options.aggregate // key.detail.divisor, 1)),
            direction=direction,
            source=key,
            levels=context.levels,
            display=context.display,
        )
        self._requests[key.place] = snapshot, frame, request
        return request

    def picture(self, request: Request) -> np.ndarray:
        """The requested picture, if need be the one that was begun for it. StoppedError: it is not wanted any
        longer."""
        key, begun = self._begun.pop(request.source.scene, (None, None))
        if begun is not None and key != request.key:
            begun.break_off()
            begun = None
        return (begun or self._begin(request)).result()

    def _begin(self, request: Request) -> Work:
        return self._submit(self.renderer(request.source).picture, request)

    def begin_next(self, snapshot: Snapshot, frame: float, context: RenderContext) -> None:
        """Begins the picture after the one at that timeline frame, where a film is rendered: if the last two were
        neighbours.

        It is shown only if it proves to be what is asked for, whatever changes meanwhile."""
        if not self.threaded:
            return
        before, self._shown[snapshot.scene] = self._shown.get(snapshot.scene, frame), frame
        step, last = snapshot.film
        if frame - before == step and frame + step <= last and frame + step in snapshot.frames:
            with suppress(*FAULTS):  # it is met again when the picture is asked for
                request = self.request(snapshot, frame + step, context, FULL)
                self._begun[snapshot.scene] = request.key, self._begin(request)

    def weights(self, request: Request) -> list[np.ndarray]:
        """Coefficients (h, w) of all shutters, and then the mattes of all layers, in blocks as large."""
        return self._submit(_weights, self.renderer(request.source), request).result()

    def renderer(self, key: SourceKey, say: Callable[[str], None] = print) -> Renderer:
        """The renderer that reads what the key says: its effect has one other at most, for plain pictures or for smooth
        ones. One of FAULTS: there is none."""
        compositor = self._opened(say)
        known = self._renderers.pop(key.place, None)
        if known is None or known[0] != key:
            if known is not None:
                self._submit(known[1].close)
            source = key.open(planes=compositor.takes_planes, keeps=self._late is None)
            known = key, Renderer(compositor, source, MatteValues.of(source, self._late))
            other = key.scene, not key.place[1]
            if other in self._renderers and not self._renderers[other][0].is_beside(key):
                self._submit(self._renderers.pop(other)[1].close)
        self._renderers[key.place] = known
        while len({scene for scene, _ in list(self._renderers)}) > _KEPT:
            self._submit(self._renderers.pop(next(iter(self._renderers)))[1].close)
        return known[1]

    def open_renderer(self, key: SourceKey) -> Renderer | None:
        """As `renderer`; None: it was not opened yet."""
        known = self._renderers.get(key.place)
        return known[1] if known and known[0] == key else None

    def _opened(self, say: Callable[[str], None]) -> Any:
        """The compositor, opened if need be."""
        if self._compositor is None:
            with stopping.once(stopping.never):
                self._compositor = self._submit(available.OPEN[self.device], render_settings.memory(), self._ask).future
            if self._chosen and (message := self._chosen[1]):
                say(message)
        try:
            return result_of(self._compositor, self.device == "relayed")
        except NoDeviceError:
            self._compositor = None
            raise

    def _ask(self) -> None:
        """Has others free what they hold. What this one holds is in use."""
        self._asks = True
        try:
            self._ask_others()
        finally:
            self._asks = False

    def free(self) -> None:
        """Frees what its renderers have on the device, unless it asks for room itself. They make it again."""
        if self._asks:
            return
        for _key, renderer in list(self._renderers.values()):
            self.run(renderer.release)

    def forget_requests(self) -> None:
        """Lets go of the last requests, and of their snapshots."""
        self._requests.clear()

    def rest(self) -> None:
        """Breaks off the pictures that were begun, and decodes nothing in advance."""
        self._drop_begun(list(self._begun))
        for _key, renderer in list(self._renderers.values()):
            renderer.source.want(())

    def _drop_begun(self, places: Iterable[int]) -> None:
        for place in places:
            _key, begun = self._begun.pop(place, (None, None))
            if begun is not None:
                begun.break_off()

    def keep(self, scenes: set[int]) -> None:
        """Closes what belongs to other scenes than those of these session_uids. A render job may take them away
        meanwhile."""
        self._drop_begun(set(self._begun) - scenes)
        for place in [place for place in list(self._requests) if place[0] not in scenes]:
            self._requests.pop(place, None)
        for place in [place for place in list(self._renderers) if place[0] not in scenes]:
            _key, renderer = self._renderers.pop(place, (None, None))
            if renderer is not None:
                self._submit(renderer.close)

    def forget(self) -> None:
        """Closes all sources and frees the device; where Blender's GPU is not current, once it is."""
        self.keep(set())
        while self._renderers:  # a render job may take up more meanwhile
            self.keep(set())
        compositor, self._compositor = self._compositor, None
        if compositor is not None:
            with suppress(NoDeviceError):
                self.run(lambda: compositor.result().release())  # behind what is left of a render that was stopped
        if self._executor is not None:
            self._executor.shutdown(wait=False)
            self._executor = None
        self._chosen = None

    def settle(self) -> None:
        """Forgets all if the device is not the one that would be chosen now."""
        try:
            if self._chosen is None or self._chosen[0] == self._choose()[0]:
                return
        except NoDeviceError:
            pass  # met again when a picture is asked for
        self.forget()


def _weights(renderer: Renderer, request: Request) -> list[np.ndarray]:
    block = request.state.options.aggregate
    mattes = [block_means(matte, block) for matte in renderer.layer_mattes(request)]
    return [*renderer.coefficients(request), *mattes]
