"""What other threads have Blender's main thread do, where its data, its operators and its GPU belong.

Functions wait in a queue for a timer, as Blender's manual has it: a timer itself may be registered on the main thread
alone, as Blender goes through its list of them without a lock. Blender's GPU is lent as a device whose calls the main
thread makes, a few at a time between redraws of the window. An engine's own way to it (bl_use_gpu_context) holds a lock
of Blender's for as long as a picture takes, and no window is drawn meanwhile.
"""

import queue
import sys
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
_TICK = 0.02  # seconds from one look at the queue to the next
_calls: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()  # of any thread, for the timer


def soon(function: Callable[[], object]) -> None:
    """Has the main thread of a window call a function, after those before it; for any thread."""
    _calls.put(function)


def call_waiting() -> float:
    """A timer, which is there as long as the extension is: it makes the calls of relayed devices as well."""
    for _ in range(_calls.qsize()):
        try:
            _calls.get_nowait()()
        except Exception:  # Blender would end the timer
            sys.excepthook(*sys.exc_info())  # as Blender does, which prints it and keeps ours (handlers)
    return 0.0 if look() else _TICK


_timers: set[Callable[[], float | None]] = set()  # that Blender may have still once the extension is disabled


def later(timer: Callable[[], float | None], seconds: float = 0.0, *, persistent: bool = False) -> None:
    """Has Blender call a timer, unless it is going to; for the main thread."""
    _timers.add(timer)
    if not bpy.app.timers.is_registered(timer):
        bpy.app.timers.register(timer, first_interval=seconds, persistent=persistent)


def drop(*timers: Callable[[], float | None]) -> None:
    """Has Blender call timers no more."""
    for timer in filter(bpy.app.timers.is_registered, timers):
        bpy.app.timers.unregister(timer)


@dataclass
class _MainThread:
    """calls: that wait for it, as (future, function); until: until when it looks for more; looked: when it did last
    unfinished: passes that may be under way; batch: after how many they are waited for"""

    calls: queue.SimpleQueue[tuple[Future, Callable]]
    until: float = 0.0
    looked: float = 0.0
    unfinished: int = 0
    batch: int = 8


# Apart from `soon`: these calls are made while Blender draws as well, where no data may be changed.
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


def register() -> None:
    if not bpy.app.background:
        later(call_waiting, _TICK, persistent=True)


def unregister() -> None:
    drop(*_timers)
