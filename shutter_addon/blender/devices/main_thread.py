"""Functions that other threads have Blender's main thread call, where its data and its operators belong.

They wait in a queue for a timer, as Blender's manual has it: a timer itself may be registered on the main thread alone,
as Blender goes through its list of them without a lock."""

import queue
import sys
from collections.abc import Callable

import bpy

from . import gpu_relay

_TICK = 0.02  # seconds from one look at the queue to the next
_calls: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()


def soon(function: Callable[[], object]) -> None:
    """Has the main thread of a window call a function, after those before it; for any thread."""
    _calls.put(function)


def call_waiting() -> float:
    """A timer, which is there as long as the extension is: it makes the calls of gpu_relay as well."""
    for _ in range(_calls.qsize()):
        try:
            _calls.get_nowait()()
        except Exception:  # Blender would end the timer
            sys.excepthook(*sys.exc_info())  # as Blender does, which prints it and keeps ours (handlers)
    return 0.0 if gpu_relay.look() else _TICK


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


def register() -> None:
    if not bpy.app.background:
        later(call_waiting, _TICK, persistent=True)


def unregister() -> None:
    drop(*_timers)
