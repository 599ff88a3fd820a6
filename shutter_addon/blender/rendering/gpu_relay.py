"""Blender's GPU for a thread beside its main one, which is the only one that has it: a device whose calls the main
thread makes, a few at a time between redraws of the window.

An engine's own way to it (bl_use_gpu_context) holds a lock of Blender's for as long as a picture takes, and no window is
drawn meanwhile.
"""

import queue
import threading
import time
from concurrent.futures import Future
from contextlib import nullcontext

import bpy
import gpu
import numpy as np

from ...compute.passes import Pass
from .blender_gpu import BlenderDevice, Texture

# Seconds of the main thread that calls take at once, if none takes longer: as many as all else took, within these.
_LEAST, _MOST = 0.02, 0.05
_GAP = 0.005  # seconds that the main thread waits there for the next call
_MOMENT = 0.01  # seconds that the passes take for which it waits at once
_REST = 1.0  # seconds without a call, after which the main thread looks for none

_calls: queue.SimpleQueue[tuple] = queue.SimpleQueue()
_lock = threading.Lock()
_looks_until: float | None = None  # when the main thread stops to look for calls; None: it does not
_looked = 0.0  # when it looked last
_unfinished, _batch = 0, 8  # passes that may be under way, and after how many they are waited for


class RelayedTexture(Texture):
    """A texture of a RelayedDevice."""

    def release(self) -> None:
        _called(super().release)


class RelayedDevice:
    """A compute.device.Device, on any one thread but Blender's main one. What a pass raises is met at the next call of
    another method."""

    def __init__(self):
        self._passes: list[Future] = []
        self._device = self._wait_for(BlenderDevice)
        self.name, self.max_layers, self.max_size = self._device.name, self._device.max_layers, self._device.max_size

    def current(self):
        return nullcontext(self)

    def texture(self, width: int, height: int, layers: int, kind: str) -> RelayedTexture:
        made = self._wait_for(self._device.texture, width, height, layers, kind)
        return RelayedTexture(made.gpu, made.size, made.kind)

    def write(self, texture: RelayedTexture, array: np.ndarray, layer: int = 0, *, opaque: bool = False) -> None:
        self._wait_for(self._device.write, texture, array, layer, opaque=opaque)

    def read(self, texture: RelayedTexture) -> np.ndarray:
        return self._wait_for(self._device.read, texture)

    def run(
        self, program: Pass, extent: tuple[int, ...], /, *, textures=None, images=None, blocks=None, **constants
    ) -> None:
        bound = {"textures": textures, "images": images, "blocks": blocks}
        self._passes.append(_called(self._device.run, program, extent, **bound, **constants))

    def release(self) -> None:
        self._wait_for(self._device.release)

    def _wait_for(self, function, *arguments, **options):
        """What the function gives on the main thread, after all passes."""
        result = _called(function, *arguments, **options).result()
        passes, self._passes = self._passes, []
        for done in passes:
            done.result()
        return result


def serve(seconds: float = _LEAST) -> None:
    """Makes calls, on the main thread while it waits for another that may call, for these seconds or a call more."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        try:
            done, function, arguments, options = _calls.get(timeout=min(left, _GAP))
        except queue.Empty:
            return
        _keep_looking()
        try:
            done.set_result(function(*arguments, **options))
        except Exception as error:
            done.set_exception(error)
        _finish_some()


def _finish_some() -> None:
    """Waits for passes, after so many that it takes a moment: whatever is drawn or read waits for all before it."""
    global _unfinished, _batch
    _unfinished += 1
    if _unfinished >= _batch:
        start = time.monotonic()
        gpu.types.GPUTexture((1, 1)).read()
        _unfinished, _batch = (
            0,
            min(max(int(_batch * _MOMENT / (time.monotonic() - start)), _batch // 2, 1), _batch * 2),
        )


def _called(function, *arguments, **options) -> Future:
    """The function, called on the main thread after all calls before."""
    done = Future()
    _calls.put((done, function, arguments, options))
    with _lock:
        if _looks_until is None:
            _keep_looking()
            bpy.app.timers.register(_look, persistent=True)
    return done


def _keep_looking() -> None:
    global _looks_until
    _looks_until = time.monotonic() + _REST


def _look() -> float | None:
    """A timer."""
    global _looks_until, _looked
    if _has_context():
        serve(min(max(time.monotonic() - _looked, _LEAST), _MOST))
    _looked = time.monotonic()
    with _lock:
        if _calls.empty() and time.monotonic() > _looks_until:
            _looks_until = None
    return None if _looks_until is None else 0.0


def _has_context() -> bool:
    """Whether Blender's GPU is current here. It is not after a window was closed, until another one is drawn."""
    try:
        gpu.types.GPUTexture((1, 1))
    except RuntimeError:
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                area.tag_redraw()
        return False
    return True
