"""Render sessions: a device, and the renderers of the effects that were shown last, whose frames they keep."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
import OpenImageIO
from bpy.app.translations import pgettext_rpt as rpt_

from ...compute.memory_needs import frame_bytes
from ...compute.renderer import Renderer
from ...core import stopping
from ...core.frames import retiming
from ...core.messages import EffectError
from ...core.model.frame_state import FrameState
from ...core.pixels import following
from ...core.stopping import StoppedError, never
from ...devices.budget import MEGABYTE, Budget
from ...devices.device import NoDeviceError
from ...media import MediaError, cuts
from ...media.cuts import ShotSource
from ...media.image_writing import write_exr
from ...media.inbetween import InbetweenSource
from ...media.matte_values import MatteValues
from ...media.prefetch import PrefetchSource
from ...media.reduced import smaller
from ..data import preferences
from ..data.snapshot import Snapshot, translated
from ..data.strip_proxies import Proxy
from ..devices import available, gpu_relay
from ..devices.blender_gpu import require_context
from . import render_job

FAULTS = (EffectError, MediaError, NoDeviceError, MemoryError)

# Renderers whose frames are kept: more effects than these in one frame decode their windows again for every frame.
_KEPT = 4
# Pictures whose frames are decoded in advance, and how many frames or bytes of them lie decoded at most, besides those
# on the device: enough for a long window, whose frames are decoded while its first picture is diffused and compiled.
_AHEAD, _DECODED, _DECODED_BYTES = 4, 8, 256 << 20
# Blocks along the shorter side of a draft in which shutters follow edges.
DRAFT_ROWS = 270
_PATIENCE = 0.1  # seconds between two looks at whether a picture is still wanted
_ANSWER = 5.0  # seconds that a job waits for the window to free memory

_said: set[str] = set()  # what is said once


class _Work(NamedTuple):
    """What a session's device does.

    future: its result to come; ended: set, it ends before its next step; relayed: the main thread has its GPU"""

    future: Future
    ended: threading.Event
    relayed: bool

    def break_off(self) -> None:
        self.ended.set()
        self.future.cancel()

    def result(self, stopped):
        """As _result. Not waited for, it is broken off."""
        try:
            return _result(self.future, self.relayed, stopped)
        except StoppedError:
            self.break_off()
            raise


def _result(future: Future, relayed: bool, stopped):
    """The future's result. StoppedError: it is not waited for any longer. NoDeviceError: it cannot be waited for, as
    Blender's GPU is not current."""
    while not wait([future], 0 if in_window() else _PATIENCE).done:
        if in_window() and not gpu_relay.serve() and relayed:
            require_context()
        if stopped():
            raise StoppedError
    return future.result()


def _until(stopped, function, *arguments):
    """What a function gives, unless it is broken off."""
    with stopping.once(stopped):
        return function(*arguments)


@dataclass(frozen=True)
class RenderSettings:
    """What a command sets for its render.

    device: one of available.CHOICES, in place of the user's preference
    weights: folder for the coefficients of every picture, as EXR files
    inbetween: folder of in-between frames, in place of the effects' own
    gpu_memory: megabytes of the GPU that textures may take, in place of the user's preference; 0: as budget.allowed
    levels: pictures are those of Renderer.levels"""

    device: str | None = None
    weights: Path | None = None
    inbetween: Path | None = None
    gpu_memory: int | None = None
    levels: bool = False


@dataclass(frozen=True)
class Detail:
    """In how much detail a preview is composed.

    divisor: how many times smaller than the source's the picture is each way (media.open_source)
    proxy: what frames are read from, where it fits; in-between frames and those beside them have none"""

    divisor: int = 1
    proxy: Proxy | None = None


FULL = Detail()  # what renders are composed in


@dataclass(frozen=True)
class FrameRequest:
    """All that a picture depends on; index, direction: as Renderer.picture has them; levels: of RenderSettings.

    Where there are in-between frames the index counts them as well."""

    renderer: Renderer
    index: int
    state: FrameState
    direction: int
    levels: bool = False

    @property
    def key(self) -> tuple:
        """Equal for requests of the same picture."""
        return self.renderer, self.index, self.direction, self.state.key, self.levels

    def picture(self) -> np.ndarray:
        """The picture, made on the renderer's device; and the frames of the next ones are decoded."""
        lacking = self._lacking()
        self._want(lacking)
        compose = self.renderer.levels if self.levels else self.renderer.picture
        result = compose(self.index, self.state, self.direction)
        self._want([missing - lacking[0] for missing in lacking[1:]])  # the rest is on the device by now
        return result

    def coefficients(self) -> np.ndarray:
        """As Renderer.coefficients; frames are decoded as for `picture`, which will read them as well."""
        self.prefetch()
        return self.renderer.coefficients(self.index, self.state, self.direction)

    def draft(self) -> FrameRequest:
        """The request as it is drawn while an editor waits: where shutters follow edges, of blocks so large that the
        picture has no more than DRAFT_ROWS of them along its shorter side."""
        options, source = self.state.options, self.renderer.source
        if not options.edge_aware:
            return self
        block = options.aggregate
        while min(source.width, source.height) > block * DRAFT_ROWS:
            block *= 2
        return replace(self, state=replace(self.state, options=replace(options, aggregate=block)))

    def check(self) -> None:
        """MediaError: an in-between frame that the picture needs is missing. No frame is read."""
        if self.renderer.source.step > 1:
            for index in sorted(self.renderer.needed(self.index, self.direction, self.state)):
                self.renderer.source.check(index)

    def prefetch(self) -> None:
        """Has the frames decoded that the picture lacks, then those of the next pictures."""
        self._want(self._lacking())

    def _lacking(self) -> list[set[int]]:
        """The frames that this picture and each of the next ones lack."""
        source = self.renderer.source
        indices = (self.index + step * self.direction * source.step for step in range(_AHEAD + 1))
        shown = (min(max(index, 0), source.count - 1) for index in indices)
        return [self.renderer.missing(index, self.direction, self.state) for index in shown]

    def _want(self, lacking: list[set[int]]) -> None:
        wanted, source = {}, self.renderer.source
        for missing in lacking:
            # One that is not built yet would be remembered as a fault, and may come before it is needed.
            wanted |= dict.fromkeys(i for i in sorted(missing) if source.step == 1 or source.has(i))
        source.want(list(wanted)[: decoded_ahead(source)])


def decoded_ahead(source) -> int:
    """How many frames of a source may lie decoded on the host, besides a window that is kept there."""
    return max(_DECODED, _DECODED_BYTES // frame_bytes(source))


def decoded_bytes(source, window: int) -> int:
    """Bytes that decoded frames take on the host at most: those of a window of so many frames, and of the next
    pictures, as far as there is room."""
    return min(decoded_ahead(source), window + _AHEAD * source.step) * frame_bytes(source)


class RenderSession:
    """A compositor, opened when it is first used, and the renderers of the effects that were shown last."""

    def __init__(self, choose: Callable[[], tuple[str, str | None]], ask_others: Callable[[], None]):
        """choose: gives the device, as available.choose; ask_others: called where the GPU has no room, has others free
        what they hold of it."""
        self._choose, self._ask_others = choose, ask_others
        self._asks = False  # others for room, in the middle of a picture
        self._chosen: tuple[str, str | None] | None = None
        self._executor: ThreadPoolExecutor | None = None
        self._compositor: Future | None = None
        self._renderers: dict = {}
        self._requests: dict[int, tuple[Snapshot, float, FrameRequest]] = {}  # by scene: the last one
        self._shown: dict[int, float] = {}  # by scene: the timeline frame that was shown last
        self._begun: dict[int, tuple[tuple, _Work]] = {}  # by scene: the key of a request, its picture

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

    def run(self, function, *arguments, stopped=never):
        """The result of a function that uses the device. StoppedError: it is not waited for any longer, and ends."""
        return self._submit(function, *arguments, stopped=stopped).result(stopped)

    def _submit(self, function, *arguments, stopped=never) -> _Work:
        """A function that uses the device, called after those before it. stopped: asked where it is called at once."""
        ended = threading.Event()
        if self.threaded:
            if self._executor is None:
                self._executor = ThreadPoolExecutor(1, "Virtual Shutter")
            with suppress(RuntimeError):  # Python ends, and its threads take no more work
                return _Work(
                    self._executor.submit(_until, ended.is_set, function, *arguments), ended, self.device == "relayed"
                )
        done = Future()
        done.set_result(_until(stopped, function, *arguments))
        return _Work(done, ended, False)

    def request(
        self, snapshot: Snapshot, frame: float, say=print, detail: Detail | None = None, stopped=never
    ) -> FrameRequest:
        """What an effect strip shows at a timeline frame; say: called with a sentence when the device is a lesser one.
        One of FAULTS: it cannot be shown. StoppedError: the device is not waited for any longer.

        detail: None: as it was the last time, for who asks for no picture"""
        renderer = self._renderer(snapshot, say, detail, stopped)
        known = self._requests.get(snapshot.scene)
        if known is not None and known[0] is snapshot and known[1] == frame and known[2].renderer is renderer:
            return known[2]
        state = _in_blocks(snapshot.state(frame), self._renderers[snapshot.scene][0][1].divisor)
        index, backward = source_index(snapshot, frame, renderer.source)
        direction = -1 if backward else 1
        with translated():
            state = following.followed(
                snapshot.effect,
                state,
                frame,
                index,
                direction,
                renderer.source,
                lambda other: source_index(snapshot, other, renderer.source)[0],
            )
        found = FrameRequest(renderer, index, state, direction, _settings.levels)
        self._requests[snapshot.scene] = snapshot, frame, found
        return found

    def picture(self, scene: int, request: FrameRequest, stopped=never) -> np.ndarray:
        """The requested picture, if need be the one that was begun for it. StoppedError: it is not waited for."""
        key, begun = self._begun.pop(scene, (None, None))
        if begun is not None and key != request.key:
            begun.break_off()
            begun = None
        return (begun or self._submit(request.picture, stopped=stopped)).result(stopped)

    def begin_next(self, snapshot: Snapshot, frame: float, stopped=never) -> None:
        """Begins the picture after the one at that timeline frame, where a film is rendered: if the last two were
        neighbours.

        It is shown only if it proves to be what is asked for, whatever changes meanwhile."""
        if not self.threaded:
            return
        before, self._shown[snapshot.scene] = self._shown.get(snapshot.scene, frame), frame
        step, last = snapshot.film
        if frame - before == step and frame + step <= last and frame + step in snapshot.frames:
            with suppress(*FAULTS):  # it is met again when the picture is asked for
                request = self.request(snapshot, frame + step, detail=FULL, stopped=stopped)
                self._begun[snapshot.scene] = request.key, self._submit(request.picture)

    def coefficients(self, request: FrameRequest, stopped=never) -> np.ndarray:
        """As Renderer.coefficients."""
        return self.run(request.coefficients, stopped=stopped)

    def _renderer(self, snapshot: Snapshot, say, detail: Detail | None, stopped) -> Renderer:
        """The renderer of the effect's source in that detail: the only one that the effect has."""
        compositor = self._opened(say, stopped)
        old_key, renderer = self._renderers.pop(snapshot.scene, ((None, FULL), None))
        key = (snapshot.source, snapshot.inbetween, snapshot.built), detail or old_key[1]
        if old_key != key:
            if renderer is not None:
                self._submit(renderer.close)
            source = open_source(snapshot, key[1], planes=compositor.takes_planes)
            renderer = Renderer(compositor, source, MatteValues.of(source))
        self._renderers[snapshot.scene] = key, renderer
        while len(self._renderers) > _KEPT:
            self._submit(self._renderers.pop(next(iter(self._renderers)))[1].close)
        return renderer

    def _opened(self, say, stopped):
        """The compositor, opened if need be."""
        if self._compositor is None:
            self._compositor = self._submit(available.OPEN[self.device], memory(), self._ask).future
            if message := self._chosen[1]:
                say(message)
        try:
            return _result(self._compositor, self.device == "relayed", stopped)
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

    def _drop_begun(self, places) -> None:
        for place in places:
            _key, begun = self._begun.pop(place, (None, None))
            if begun is not None:
                begun.break_off()

    def keep(self, scenes: set[int]) -> None:
        """Closes what belongs to other scenes than those of these session_uids. A render job may take them away
        meanwhile."""
        self._drop_begun(set(self._begun) - scenes)
        for known in (self._shown, self._requests):
            for place in set(known) - scenes:
                known.pop(place, None)
        for place in set(self._renderers) - scenes:
            _key, renderer = self._renderers.pop(place, (None, None))
            if renderer is not None:
                self._submit(renderer.close)

    def forget(self) -> None:
        """Closes all sources and frees the device; where Blender's GPU is not current, once it is. A render job may
        take up more meanwhile."""
        self._drop_begun(list(self._begun))
        for known in (self._shown, self._requests):
            known.clear()
        while self._renderers:
            _place, (_key, renderer) = self._renderers.popitem()
            self._submit(renderer.close)
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


_settings = RenderSettings()


@contextmanager
def using(settings: RenderSettings):
    """Inside, renders have these settings."""
    global _settings
    before, _settings = _settings, settings
    try:
        yield
    finally:
        _settings = before


def settings() -> RenderSettings:
    """Those of the render that runs."""
    return _settings


def wanted() -> str:
    """The device that the command asks for, else the user's preference: one of available.CHOICES."""
    return _settings.device or preferences.device()


def _wanted_memory() -> int:
    """The megabytes that the command sets, else the user's preference; 0: as many as are allowed."""
    return preferences.gpu_memory() if _settings.gpu_memory is None else _settings.gpu_memory


def memory() -> Budget:
    """What the textures of both sessions may take together: it is one GPU, which OpenGL knows best, where it may be
    asked; else the first device tells."""
    global _budget
    if _budget is None:
        megabytes = _wanted_memory()
        asks = not megabytes and wanted() in ("auto", "gpu", "opengl")
        _budget = megabytes, Budget(megabytes * MEGABYTE or (available.opengl().memory if asks else None))
    return _budget[1]


def _ask_window() -> None:
    """Has the window free what it shows, for a job: it is not drawn meanwhile, and makes it again."""
    if render_job.in_job():
        gpu_relay.ask(_window.free, _ANSWER)


def _ask_offscreen() -> None:
    """Has renders free what they keep for the next one, unless one runs."""
    if not render_job.runs():
        _offscreen.free()


_budget: tuple[int, Budget] | None = None  # with the megabytes that it was made for

# What the window itself shows is made on its main thread, on its GPU. Renders have a device apart and a thread for it:
# beside Blender's own GL context another one cannot always be current (see GLDevice). In the background Blender's GPU
# belongs to the main thread, and has none.
_offscreen = RenderSession(lambda: available.choose(wanted()), _ask_window)
_window = RenderSession(lambda: ("blender", None), _ask_offscreen)
# For a thread whose pictures the window waits for, where _offscreen has them made by the window.
_waited_for = RenderSession(lambda: available.choose(wanted(), window_waits=True), lambda: None)
_SESSIONS = _offscreen, _window, _waited_for


def device_names() -> tuple[str, str]:
    """What the preview of a window is composed on, and its renders, as these call themselves. NoDeviceError: there is
    none for renders as the user wants it."""
    return available.name("blender"), available.name(available.choose(wanted())[0])


def in_window() -> bool:
    """Whether this is the main thread of a Blender with a window."""
    return not bpy.app.background and threading.current_thread() is threading.main_thread()


def here() -> RenderSession:
    """The session of whoever calls: the window's own for what its main thread draws, else one for renders, a script's
    on the main thread among them: there Blender's GPU need not be current. NoDeviceError: these have none."""
    if in_window() and not render_job.ends_films():
        return _window
    return _waited_for if render_job.window_waits() and _offscreen.device == "relayed" else _offscreen


def settle() -> None:
    """Before a render, on the main thread: its device and its memory are what the user wants now."""
    global _budget
    if _budget is not None and _budget[0] != _wanted_memory():
        forget()
        _budget = None
    _waited_for.forget()  # its frames take the machine's own memory
    _offscreen.settle()


def _in_blocks(state: FrameState, divisor: int) -> FrameState:
    """The state with its blocks of pixels as large in a smaller picture."""
    options = state.options
    if divisor == 1 or options.aggregate == 1:
        return state
    return replace(state, options=replace(options, aggregate=max(options.aggregate // divisor, 1)))


def picture(
    snapshot: Snapshot, frame: float, say: Callable[[str], None] = print, stopped=never, detail: Detail = FULL
) -> np.ndarray:
    """The picture (H, W, 4) of an effect strip at a timeline frame, top row first: scene-linear float32, premultiplied,
    or levels, if the settings ask for them. One of FAULTS: there is none, in one sentence. say: called with a sentence
    when the device is a lesser one, or cuts cannot be found. stopped: asked whether the picture is not wanted any
    longer; StoppedError: it is not.
    """
    if stopped():
        raise StoppedError
    if render_job.window_waits():  # for a film of which Blender does not say that it begins
        _waited_for.settle()
    request = here().request(snapshot, frame, say, detail, stopped)
    if request.state.options.stop_at_cuts:
        _say_of_cuts(say)
    if _settings.weights is not None:
        names = [shutter.name for shutter in snapshot.effect.shutters]
        place = _settings.weights / f"{round(frame - snapshot.first + 1):04d}.exr"
        write_exr(place, np.moveaxis(here().coefficients(request, stopped), 0, -1), names)
    result = here().picture(snapshot.scene, request, stopped)
    for sentence in shortages(request):
        _say_once(sentence, say)
    return result


def _say_once(sentence: str, say) -> None:
    if sentence not in _said:
        _said.add(sentence)
        say(sentence)


def _say_of_cuts(say) -> None:
    if package := cuts.missing_package():
        sentence = f"Stop at Cuts finds none, and exposures run across them: the Python package {package} is missing"
        _say_once(sentence, say)


def shortages(request: FrameRequest) -> list[str]:
    """Sentences about what is slow in pictures as requested, for the GPU has no room."""
    if not (found := request.renderer.shortages()):
        return []
    source = request.renderer.source
    words = {"width": source.width, "height": source.height, "frames": request.state.options.window}
    words["limit"] = memory().limit // MEGABYTE
    sentences = {
        "window": rpt_(
            "the {limit} MB that may be taken of the GPU are too few for {frames} frames of {width}×{height}: all are"
            " sent for every picture, which is slow"
        ),
        "diffusion": rpt_(
            "the {limit} MB that may be taken of the GPU are too few to diffuse {width}×{height}: NumPy does it, which"
            " is slow"
        ),
    }
    return [sentences[name].format(**words) for name in sorted(found)]


def pairs(snapshot: Snapshot) -> set[int]:
    """The pairs of neighbouring source frames whose in-betweens are needed to show an effect strip at the snapshot's
    frames, each by its first. It reads what it must to find cuts. One of FAULTS: they cannot be shown."""
    factor, found = snapshot.inbetween.factor, set()
    for frame in sorted(snapshot.frames):
        shown = here().request(snapshot, frame)
        needed = shown.renderer.needed(shown.index, shown.direction, shown.state, known=False)
        found |= {index // factor for index in needed if index % factor}
        shown.renderer.source.release()  # what it read is not shown here
    return found


def source_index(snapshot: Snapshot, frame: float, source: ShotSource) -> tuple[int, bool]:
    """Which frame of an effect's source is shown at a timeline frame, in-between frames counted, and whether the source
    runs backward there. EffectError: it cannot be known."""
    if snapshot.effect.time is not None:
        time, backward = snapshot.effect.time.at(frame)
        return retiming.nearest(time - 1, source.step, source.count), backward
    with translated():
        return retiming.source_frame(snapshot.timing, frame, source), snapshot.timing.use_reverse_frames


def open_source(snapshot: Snapshot, detail: Detail = FULL, *, planes: bool = False) -> ShotSource:
    """An effect's source, in-between frames included; planes: as of PrefetchSource. EffectError, MediaError: there is
    none."""
    if snapshot.inbetween is None:
        return ShotSource(PrefetchSource(snapshot.source.open(detail.divisor, detail.proxy), planes=planes))
    medium = snapshot.source.open()
    try:
        source = InbetweenSource(medium, *snapshot.inbetween)
        return ShotSource(PrefetchSource(smaller(source, detail.divisor)), snapshot.inbetween.factor)
    except FAULTS:
        medium.close()
        raise


def end_job() -> None:
    """Lets go of what a job of the window has begun, and of its snapshots. A script's next still may go on from the
    one before."""
    if render_job.in_job():
        _offscreen.rest()
    _offscreen.forget_requests()


def drop_removed() -> None:
    """Closes the sources of effect scenes that are gone, and frees their frames."""
    scenes = {scene.session_uid for scene in bpy.data.scenes}
    for session in _SESSIONS:
        session.keep(scenes)


def forget(*_) -> None:
    """Closes all sources and frees the devices: when a file is loaded, and when the extension goes."""
    for session in _SESSIONS:
        session.forget()


def resized(picture: np.ndarray, width: int, height: int, divisor: int = 1) -> np.ndarray:
    """The picture at the size that Blender asks for: the scene's own, or what a resolution below 100 % makes of it; of
    one that was composed `divisor` times smaller the pixels are repeated."""
    if divisor > 1:
        picture = picture.repeat(divisor, axis=0).repeat(divisor, axis=1)[:height, :width]
    if picture.shape[:2] == (height, width):
        return picture
    small = OpenImageIO.ImageBufAlgo.resize(
        OpenImageIO.ImageBuf(np.ascontiguousarray(picture)), roi=OpenImageIO.ROI(0, width, 0, height)
    )
    return small.get_pixels(OpenImageIO.FLOAT).reshape(height, width, 4)
