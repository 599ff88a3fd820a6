"""Calls from other threads to Blender's main thread, which alone may use Blender's data, operators and GPU.

Functions wait in a queue, which a timer empties, as Blender's manual recommends. Timers may be registered only on the
main thread: Blender iterates over them without a lock. RelayedDevice is Blender's GPU for other threads: the main
thread makes its calls, a few at a time between redraws. With an engine's bl_use_gpu_context, Blender would hold a lock
while a picture is made, and draw no window meanwhile.
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

from ...compute.devices.device import Device
from ...compute.devices.passes import Pass
from ...core import threads
from .blender_gpu import BlenderDevice, has_context

T = TypeVar("T")
# The main thread spends as many seconds on calls as on everything else, within these limits.
_LEAST, _MOST = 0.02, 0.05
_GAP = 0.005  # seconds that the main thread then waits for the next call
_MOMENT = 0.01  # seconds that a batch of passes takes, before the main thread waits for it
_AHEAD = 4  # the most passes that wait for the main thread; they run even if the picture is no longer wanted
_REST = 1.0  # seconds without a call, after which the main thread stops looking
_TICK = 0.02  # seconds between two looks at the queue


@dataclass
class _MainThread:
    """What Blender's main thread has to do for other threads. Times are in seconds of time.monotonic.

    Attributes:
        functions: Functions given to `soon`. Only the timer calls them.
        calls: Pairs (future, function) of relayed devices and `ask`. The main thread also calls them while it waits for
            another thread, even while Blender draws, when no Blender data may change.
        timers: Timers to remove when the extension is disabled.
        until: Time until which more calls are expected, so that the main thread looks for them without a pause.
        looked: Time at which `look` last finished making calls.
        unfinished: Number of calls made since the main thread last waited for the GPU.
        batch: Value of `unfinished` at which the main thread waits for the GPU.
    """

    functions: queue.SimpleQueue[Callable[[], object]]
    calls: queue.SimpleQueue[tuple[Future, Callable]]
    timers: set[Callable[[], float | None]]
    until: float = 0.0
    looked: float = 0.0
    unfinished: int = 0
    batch: int = 8


_main = _MainThread(queue.SimpleQueue(), queue.SimpleQueue(), set())  # Blender has one main thread


def soon(function: Callable[[], object]) -> None:
    """Have the main thread call a function when it next can, after functions given before. Any thread may ask.

    Only in a Blender with a window, because in the background no timer runs.
    """
    _main.functions.put(function)


def call_waiting() -> float:
    """Call the functions that were given to `soon`, then make calls that other threads wait for (`look`).

    This is the timer that Blender calls. An error of a function is printed.

    Returns:
        Seconds until Blender calls it again.
    """
    for _ in range(_main.functions.qsize()):
        try:
            _main.functions.get_nowait()()
        except Exception:  # Blender would end the timer
            sys.excepthook(*sys.exc_info())  # as Blender does: prints the error, and ours are kept (handlers)
    return 0.0 if look() else _TICK


def later(timer: Callable[[], float | None], seconds: float = 0.0, *, persistent: bool = False) -> None:
    """Register a timer of Blender, unless it is registered already. To be called on the main thread.

    Args:
        timer: Function that Blender calls. It returns the seconds until its next call, or None for no more calls.
        seconds: Seconds until the first call.
        persistent: Whether the timer goes on when another file is loaded.
    """
    _main.timers.add(timer)
    if not bpy.app.timers.is_registered(timer):
        bpy.app.timers.register(timer, first_interval=seconds, persistent=persistent)


def drop(*timers: Callable[[], float | None]) -> None:
    """Unregister timers that `later` registered, as far as they still run."""
    for timer in filter(bpy.app.timers.is_registered, timers):
        bpy.app.timers.unregister(timer)


class RelayedDevice(BlenderDevice):
    """Blender's GPU as a Device for a thread other than the main one. The main thread makes the GPU calls for it.

    Passes are queued, so their errors are raised later: at the latest when a texture is made, filled or read. Instead
    of a GPU texture, private methods handle a list that contains one. The main thread empties the list to free the
    texture: on Vulkan, Blender crashes if another thread frees it.
    """

    def __init__(self, *memory: Any) -> None:
        super().__init__(*memory)
        self._passes: list[Future] = []

    def current(self) -> AbstractContextManager[BlenderDevice]:
        """Return a context in which passes run. The main thread checks whether Blender's GPU can be used."""
        return self._cleared()

    def _make(self, *arguments: Any) -> list:
        return self._wait_for(lambda: [BlenderDevice._make(self, *arguments)])

    def _free(self, own: list) -> None:
        _called(own.clear)

    send = Device.send  # BlenderDevice.send makes a texture, which only the main thread could free

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
        """Have the main thread call a function after all passes queued so far, wait for it, and return its result.

        An error of the function, or else of one of these passes, is raised here.
        """
        result = _called(function).result()
        passes, self._passes = self._passes, []
        for done in passes:
            done.result()
        return result


def ask(function: Callable[[], None], seconds: float) -> None:
    """Have the main thread call a function, and wait at most `seconds`. Then cancel the call if it has not begun."""
    asked = _called(function)
    try:
        asked.result(seconds)
    except TimeoutError:
        asked.cancel()


def serve(seconds: float = _LEAST) -> bool:
    """Make calls of other threads on the main thread, such as while it waits for the result of one of these threads.

    Args:
        seconds: Time after which no further call is begun. It ends earlier if no call comes for _GAP seconds.

    Returns:
        False if calls wait but cannot be made, because Blender's GPU cannot be used yet.
    """
    if not has_context():
        for window in bpy.context.window_manager.windows:  # so that Blender's GPU can be used again
            for area in window.screen.areas:
                area.tag_redraw()
        time.sleep(_GAP)
        return _main.calls.empty()
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        try:
            done, function = _main.calls.get(timeout=min(left, _GAP))
        except queue.Empty:
            return True
        _main.until = time.monotonic() + _REST
        if threads.fulfil(done, function):
            with suppress(RuntimeError):  # the GPU is full: the next call that needs memory raises it
                _finish_some()
    return True


def _finish_some() -> None:
    """Count a call that was made. After each batch of calls, wait until the GPU has finished all passes.

    Otherwise passes would pile up, and Blender's drawing would have to wait for all of them. The batch's size adapts so
    that the wait takes about _MOMENT seconds.
    """
    _main.unfinished += 1
    if _main.unfinished >= _main.batch:
        start = time.monotonic()
        gpu.types.GPUTexture((1, 1)).read()
        quick = _MOMENT / max(time.monotonic() - start, 1e-4)
        _main.unfinished, _main.batch = 0, max(1, int(_main.batch * min(max(quick, 0.5), 2.0)))


def _called(function: Callable[[], T]) -> Future[T]:
    """Queue a function for the main thread, and return the future of its result."""
    done: Future[T] = Future()
    _main.until = time.monotonic() + _REST
    _main.calls.put((done, function))
    return done


def look() -> bool:
    """Make the calls that other threads wait for, on the main thread.

    It spends as much time on them as has passed since it last did, within _LEAST to _MOST seconds. It does nothing if
    no call waits and none came for _REST seconds.

    Returns:
        Whether more calls are expected, so that this should be called again at once.
    """
    if _main.calls.empty() and time.monotonic() >= _main.until:
        return False
    serve(min(max(time.monotonic() - _main.looked, _LEAST), _MOST))
    _main.looked = time.monotonic()
    return True


def register() -> None:
    if not bpy.app.background:
        later(call_waiting, _TICK, persistent=True)


def unregister() -> None:
    drop(*_main.timers)
