"""Blender's GPU for a thread beside its main one, which is the only one that has it: a device whose calls the main
thread makes, a few at a time between redraws of the window.

An engine's own way to it (bl_use_gpu_context) holds a lock of Blender's for as long as a picture takes, and no window
is drawn meanwhile.
"""

import queue
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from typing import Any, TypeVar

import bpy
import gpu

from ...core import threads
from ...devices.device import Device
from ...devices.passes import Pass
from .blender_gpu import BlenderDevice, has_context

T = TypeVar("T")
# Seconds of the main thread that calls take at once, if none takes longer: as many as all else took, within these.
_LEAST, _MOST = 0.02, 0.05
_GAP = 0.005  # seconds that the main thread waits there for the next call
_MOMENT = 0.01  # seconds that the passes take for which it waits at once
_AHEAD = 4  # passes that wait for the main thread at most: they are run, too, where the picture is not wanted any more
_REST = 1.0  # seconds without a call, after which the main thread looks for none


@dataclass
class _MainThread:
    """calls: that wait for it, as (future, function); until: until when it looks for more; looked: when it did last
    unfinished: passes that may be under way; batch: after how many they are waited for"""

    calls: queue.SimpleQueue[tuple[Future, Callable]]
    until: float = 0.0
    looked: float = 0.0
    unfinished: int = 0
    batch: int = 8


# Apart from main_thread's queue: these calls are made while Blender draws as well, where no data may be changed.
_main = _MainThread(queue.SimpleQueue())


class RelayedDevice(BlenderDevice):
    """A devices.device.Device, on any one thread but Blender's main one. What a pass raises is met later, at
    the latest when something is made, sent or read next.

    Its own textures are lists of one, which the main thread empties: on Vulkan Blender crashes where another frees one.
    """

    def __init__(self, *memory: Any) -> None:
        super().__init__(*memory)
        self._passes: list[Future] = []

    def current(self) -> AbstractContextManager[BlenderDevice]:
        """See Device. Whether Blender's GPU is current is for the main thread to see."""
        return self._cleared()

    def _make(self, *arguments: Any) -> list:
        return self._wait_for(lambda: [BlenderDevice._make(self, *arguments)])

    def _free(self, own: list) -> None:
        _called(own.clear)

    send = Device.send  # what others make would have to be freed there, too

    def _send(self, stored: list, *arguments: Any) -> None:
        self._wait_for(lambda: BlenderDevice._send(self, *stored, *arguments))

    def _read(self, texture: list, *arguments: Any) -> None:
        self._wait_for(lambda: BlenderDevice._read(self, *texture, *arguments))

    def _dispatch(self, program: Pass, groups: tuple[int, ...], textures: dict, images: dict, *given: Mapping) -> None:
        def dispatch() -> None:
            bound = ({name: own[0] for name, own in kind.items()} for kind in (textures, images))
            BlenderDevice._dispatch(self, program, groups, *bound, *given)

        self._passes.append(_called(dispatch))
        if len(self._passes) > _AHEAD:
            self._passes.pop(0).result()

    def release(self) -> None:
        self._wait_for(lambda: BlenderDevice.release(self))

    def _wait_for(self, function: Callable[[], T]) -> T:
        """What the function gives on the main thread, after all passes."""
        result = _called(function).result()
        passes, self._passes = self._passes, []
        for done in passes:
            done.result()
        return result


def ask(function: Callable[[], None], seconds: float) -> None:
    """Has the main thread call a function, and waits for its end, but no longer than that: then it is not called any
    more, unless it has begun."""
    asked = _called(function)
    try:
        asked.result(seconds)
    except TimeoutError:
        asked.cancel()


def serve(seconds: float = _LEAST) -> bool:
    """Makes calls, on the main thread while it waits for another that may call, for these seconds or a call more.
    False: there are some, but Blender's GPU is not current."""
    if not has_context():
        _redraw()
        time.sleep(_GAP)
        return _main.calls.empty()
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        try:
            done, function = _main.calls.get(timeout=min(left, _GAP))
        except queue.Empty:
            return True
        _keep_looking()
        if threads.fulfil(done, function):
            with suppress(RuntimeError):  # the GPU is full: that is met by who needs it
                _finish_some()
    return True


def _finish_some() -> None:
    """Waits for passes, after so many that it takes a moment: whatever is drawn or read waits for all before it."""
    _main.unfinished += 1
    if _main.unfinished >= _main.batch:
        start = time.monotonic()
        gpu.types.GPUTexture((1, 1)).read()
        quick = _MOMENT / max(time.monotonic() - start, 1e-4)
        _main.unfinished, _main.batch = 0, max(1, int(_main.batch * min(max(quick, 0.5), 2.0)))


def _called(function: Callable[[], T]) -> Future[T]:
    """The function, called on the main thread after all calls before."""
    done: Future[T] = Future()
    _keep_looking()
    _main.calls.put((done, function))
    return done


def _keep_looking() -> None:
    _main.until = time.monotonic() + _REST


def look() -> bool:
    """Makes calls, on the main thread while it waits for nothing. Whether it has to look again at once."""
    if _main.calls.empty() and time.monotonic() >= _main.until:
        return False
    serve(min(max(time.monotonic() - _main.looked, _LEAST), _MOST))
    _main.looked = time.monotonic()
    return True


def _redraw() -> None:
    """Has all windows drawn, after which Blender's GPU is current."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            area.tag_redraw()
