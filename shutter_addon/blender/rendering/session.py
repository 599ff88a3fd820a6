"""Pictures of effect scenes: renderers that keep their frames, on a device of Blender's own or one without a window."""

import threading
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import bpy
import numpy as np
import OpenImageIO

from ...compute.device import NoDeviceError
from ...compute.gpu import GPUCompositor
from ...compute.renderer import Renderer, open_compositor
from ...core.frame_state import FrameState
from ...media import MediaError, cuts
from ...media.cuts import ShotSource
from ...media.exr import write_exr
from ...media.prefetch import PrefetchSource
from ..data import effects, inbetween_settings, retiming, source_media, strips
from . import invalidation
from .blender_gpu import BlenderDevice, opens_in_background

FAULTS = (effects.EffectError, MediaError, NoDeviceError, MemoryError)

device = "auto"
weights_folder: Path | None = None

_said: set[str] = set()  # what is said once


class StoppedError(Exception):
    """A picture was not waited for, as its render ends."""


def _never() -> bool:
    return False


def _result(future: Future, stopped):
    """The future's result. StoppedError: it is not waited for any longer."""
    while not wait([future], _PATIENCE).done:
        if stopped():
            raise StoppedError
    return future.result()


# Renderers whose frames are kept: more effects than these in one frame decode their windows again for every frame.
_KEPT = 4
# Pictures whose frames are decoded in advance, and how many frames or bytes of them lie decoded at most, besides those
# on the device: enough for a long window, whose frames are decoded while its first picture is diffused and compiled.
_AHEAD, _DECODED, _DECODED_BYTES = 4, 8, 256 << 20
_PATIENCE = 0.1  # seconds between two looks at whether a picture is still wanted


@dataclass(frozen=True)
class Moment:
    """All that a picture depends on; index, direction: as Renderer.picture has them.

    Where there are in-between frames the index counts them as well."""

    renderer: Renderer
    index: int
    instant: FrameState
    direction: int

    @property
    def key(self) -> tuple:
        """Equal for moments of the same picture."""
        return self.renderer, self.index, self.direction, self.instant.key

    def picture(self) -> np.ndarray:
        """The picture, made on the renderer's device; and the frames of the next ones are decoded."""
        self.prefetch()
        result = self.renderer.picture(self.index, self.instant, self.direction)
        self.prefetch()  # and lets go of what is on the device by now
        return result

    def check(self) -> None:
        """MediaError: an in-between frame that the picture needs is missing. No frame is read."""
        if self.renderer.source.step > 1:
            for index in sorted(self.renderer.needed(self.index, self.direction, self.instant)):
                self.renderer.source.check(index)

    def prefetch(self) -> None:
        """Has the frames decoded that the picture lacks, then those of the next pictures."""
        wanted, source = {}, self.renderer.source
        for step in range(_AHEAD + 1):
            index = min(max(self.index + step * self.direction * source.step, 0), source.count - 1)
            missing = sorted(self.renderer.missing(index, self.direction, self.instant))
            # One that is not built yet would be remembered as a fault, and may come before it is needed.
            wanted |= dict.fromkeys(i for i in missing if source.step == 1 or source.has(i))
        room = _DECODED_BYTES // (source.width * source.height * 4 * np.dtype(source.dtype).itemsize)
        source.want(list(wanted)[: max(_DECODED, room)])


class Studio:
    """A compositor, opened when it is first used, and the renderers of the effects that were shown last."""

    def __init__(self, open_device, threaded: bool = False):
        """threaded: the device belongs to a thread of its own; otherwise to whichever calls."""
        self._open = open_device
        self.threaded = threaded
        self._executor: ThreadPoolExecutor | None = None
        self._compositor = None
        self._renderers: dict = {}
        self.shown: dict[int, float] = {}  # by scene: the frame that was shown last
        self._begun: dict[int, tuple[tuple, Future]] = {}  # by scene: the key of a moment, its picture

    def run(self, function, *arguments, stopped=_never):
        """The result of a function that uses the device. StoppedError: it is not waited for any longer."""
        if not self.threaded:
            return function(*arguments)
        if self._executor is None:
            self._executor = ThreadPoolExecutor(1, "Virtual Shutter")
        try:
            future = self._executor.submit(function, *arguments)
        except RuntimeError:  # Python ends, and its threads take no more work
            return function(*arguments)
        return _result(future, stopped)

    def picture(self, scene, moment: Moment, stopped=_never) -> np.ndarray:
        """The moment's picture, if need be the one that was begun for it. StoppedError: it is not waited for."""
        key, begun = self._begun.pop(scene.session_uid, (None, None))
        if begun is not None:
            if key == moment.key:
                return _result(begun, stopped)
            begun.cancel()
        return self.run(moment.picture, stopped=stopped)

    def begin(self, scene, moment: Moment) -> None:
        """Begins a picture that is likely to be asked for next, while Blender does other work."""
        self._begun[scene.session_uid] = moment.key, self._executor.submit(moment.picture)

    def renderer(self, effect, source_strip, say) -> Renderer:
        """The renderer of an effect; say: called with a sentence when the device is a lesser one. One of FAULTS:
        no device, no source."""
        if self._compositor is None:
            self._compositor, message = self.run(self._open)
            if message:
                say(message)
        place, key = (
            effect.scene.session_uid,
            (source_media.media_key(source_strip), invalidation.built_key(effect, source_strip)),
        )
        old_key, renderer = self._renderers.pop(place, (None, None))
        if old_key != key:
            if renderer is not None:
                self.run(renderer.close)
            renderer = Renderer(self._compositor, _open(effect, source_strip))
        self._renderers[place] = key, renderer
        while len(self._renderers) > _KEPT:
            self.run(self._renderers.pop(next(iter(self._renderers)))[1].close)
        return renderer

    def keep(self, scenes: set[int]) -> None:
        """Closes what belongs to other scenes than those of these session_uids. A render job may take them away
        meanwhile."""
        for known in (self.shown, self._begun):
            for place in set(known) - scenes:
                known.pop(place, None)
        for place in set(self._renderers) - scenes:
            _key, renderer = self._renderers.pop(place, (None, None))
            if renderer is not None:
                self.run(renderer.close)

    def forget(self) -> None:
        """Closes all sources and frees the device."""
        self.shown.clear()
        self._begun.clear()
        for _key, renderer in self._renderers.values():
            self.run(renderer.close)
        self._renderers.clear()
        if self._compositor is not None:
            self.run(self._compositor.release)
            self._compositor = None
        if self._executor is not None:
            self._executor.shutdown()
            self._executor = None


# Blender's own GPU belongs to its main thread. Renders on another one, and without a window, have a context apart, and
# a thread for it: beside Blender's own another one cannot always be current (see GLDevice). Without moderngl there is
# no such context, and in the background Blender's own does.
_apart = Studio(lambda: open_compositor(device), threaded=True)
_window = Studio(lambda: (GPUCompositor(BlenderDevice()), None))


def in_window() -> bool:
    """Whether Blender's own GPU may be used: on the main thread of a Blender with a window."""
    return not bpy.app.background and threading.current_thread() is threading.main_thread()


def _borrows() -> bool:
    """Whether a background render is on Blender's own GPU, as it can have none apart."""
    on_main = threading.current_thread() is threading.main_thread()
    return bpy.app.background and on_main and device != "cpu" and _lacks_moderngl() and opens_in_background()


@lru_cache
def _lacks_moderngl() -> bool:
    """Whether moderngl is missing, as in a package without wheels, or made for another Python."""
    try:
        from ...compute import gl
    except ImportError:
        return True
    return False


def picture(scene, scene_frame: float, say=print, stopped=_never) -> np.ndarray:
    """The picture (H, W, 4) float32 of an effect scene at one of its frames: scene-linear, premultiplied, top row
    first. One of FAULTS: there is none, in one sentence. say: called with a sentence when the device is a lesser one,
    or cuts cannot be found. stopped: asked whether the picture is not wanted any longer; StoppedError: it is not.
    """
    if stopped():
        raise StoppedError
    edit, effect, strip = strips.find_edit(scene)
    frame = strips.timeline_frame(strip, scene_frame)
    found = moment(edit, effect, strip, frame, say)
    if found.instant.options.stop_at_cuts:
        _say_of_cuts(say)
    if weights_folder is not None:
        values = _studio().run(found.renderer.coefficients, found.instant, stopped=stopped)
        _write_weights(values, [s.name for s in effect.shutters], frame - strip.left_handle + 1)
    return _studio().picture(scene, found, stopped)


def _say_of_cuts(say) -> None:
    if package := cuts.missing_package():
        sentence = f"Stop at Cuts finds none, and windows run across them: the Python package {package} is missing"
        if sentence not in _said:
            _said.add(sentence)
            say(sentence)


def begin_next(scene, scene_frame: float) -> None:
    """Begins the picture after the one at that frame, where a film is rendered: if the last two were neighbours.

    It is shown only if it proves to be what is asked for, whatever changes meanwhile."""
    studio = _studio()
    if studio.threaded:
        step = scene_frame - studio.shown.get(scene.session_uid, scene_frame)
        studio.shown[scene.session_uid] = scene_frame
        with suppress(*FAULTS):  # it is met again when the picture is asked for
            edit, effect, strip = strips.find_edit(scene)
            frame = strips.timeline_frame(strip, scene_frame) + step
            if step == edit.frame_step and frame <= edit.frame_end:
                studio.begin(scene, moment(edit, effect, strip, frame))


def moment(edit, effect, strip, frame: float, say=print) -> Moment:
    """What an effect strip shows at a timeline frame. One of FAULTS: it cannot be shown."""
    source = strips.source_of(edit, effect, strip)
    renderer = _studio().renderer(effect, source, say)
    instant = effects.instant(edit, effect, strip, frame)
    if effect.use_source_time:
        time, backward = effects.source_time(edit, effect, frame)
        index = retiming.nearest(time - 1, renderer.source)
    else:
        index = retiming.source_frame(source, frame, renderer.source, edit.render.fps / edit.render.fps_base)
        backward = source.use_reverse_frames
    return Moment(renderer, index, instant, -1 if backward else 1)


def pairs(edit, effect, strip, frames) -> set[int]:
    """The pairs of neighbouring source frames whose in-betweens are needed to show an effect strip at these timeline
    frames, each by its first. It reads what it must to find cuts. One of FAULTS: they cannot be shown."""
    factor, found = inbetween_settings.factor(effect), set()
    for frame in frames:
        shown = moment(edit, effect, strip, frame)
        needed = shown.renderer.needed(shown.index, shown.direction, shown.instant, known=False)
        found |= {index // factor for index in needed if index % factor}
        shown.renderer.source.release()  # what it read is not shown here
    return found


def _open(effect, source_strip) -> ShotSource:
    """An effect's source, in-between frames included. EffectError, MediaError: there is none."""
    medium = source_media.open_media(source_strip)
    try:
        return ShotSource(PrefetchSource(inbetween_settings.source(medium, effect)), inbetween_settings.factor(effect))
    except FAULTS:
        medium.close()
        raise


def _studio() -> Studio:
    return _window if in_window() or _borrows() else _apart


def drop_removed() -> None:
    """Closes the sources of effect scenes that are gone, and frees their frames."""
    scenes = {scene.session_uid for scene in bpy.data.scenes}
    _apart.keep(scenes)
    _window.keep(scenes)


def forget(*_) -> None:
    """Closes all sources and frees the devices: when a file is loaded, and when the extension goes."""
    _apart.forget()
    _window.forget()


def resized(picture: np.ndarray, width: int, height: int) -> np.ndarray:
    """The picture at the size the sequencer asks for (it renders previews smaller)."""
    if picture.shape[:2] == (height, width):
        return picture
    small = OpenImageIO.ImageBufAlgo.resize(
        OpenImageIO.ImageBuf(np.ascontiguousarray(picture)), roi=OpenImageIO.ROI(0, width, 0, height)
    )
    return small.get_pixels(OpenImageIO.FLOAT).reshape(height, width, 4)


def _write_weights(coefficients: np.ndarray, names: list[str], frame: float) -> None:
    """Coefficients (N, h, w) as a float EXR, a channel per shutter."""
    write_exr(weights_folder / f"{round(frame):04d}.exr", np.moveaxis(coefficients, 0, -1), names)
