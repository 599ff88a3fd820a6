"""Threads. Only this module starts any.

docs/internals.md (Threads) lists what runs on them, and why none of it touches Blender's data, which belongs to
Blender's main thread.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from . import recent_errors
from .stopping import check, once

T = TypeVar("T")
_NAME = "Virtual Shutter"


def start(function: Callable[..., T], *arguments: object) -> Future[T]:
    """Call a function on a new thread and return its Future. Python waits for the thread before it exits."""
    executor = pool(1)
    future = executor.submit(function, *arguments)
    executor.shutdown(wait=False)
    return future


def pool(workers: int | None = None) -> ThreadPoolExecutor:
    """Return a pool of worker threads, which the caller shuts down; None: Python chooses their number."""
    return ThreadPoolExecutor(workers, _NAME)


def fulfil(future: Future[T], function: Callable[[], T]) -> bool:
    """Call a function and give its result or exception to a future. Do nothing and return False if it was cancelled."""
    if not future.set_running_or_notify_cancel():
        return False
    try:
        future.set_result(function())
    except Exception as error:
        future.set_exception(error.with_traceback(None))  # its frames may refer to textures
    return True


def daemon(function: Callable[..., object], *arguments: object) -> threading.Thread:
    """Call a function on a new daemon thread, which Python does not wait for when it exits, and return the thread.

    An exception of the function is printed, and noted for *Copy Report* (recent_errors).
    """
    thread = threading.Thread(target=_noting, args=(function, *arguments), name=_NAME, daemon=True)
    thread.start()
    return thread


def _noting(function: Callable[..., object], *arguments: object) -> None:
    """Call a function, and note an exception for reports before it is raised."""
    try:
        function(*arguments)
    except Exception as error:  # unexpected: functions report other errors themselves
        recent_errors.exception(error)
        raise


def beside(steps: Iterable[T], patience: float | None) -> Generator[T | None, None, None]:
    """Iterate over `steps` on another thread, and yield the items here as they come.

    The thread does not wait for the items to be used. If the generator is closed, it stops the thread after the current
    item, or at its next `stopping.check`, and waits until the thread has ended. An exception of `steps` is raised here.

    Args:
        steps: What to iterate over.
        patience: After this many seconds without an item, None is yielded, so that the caller can do something else and
            ask again. None: wait for each item as long as it takes.
    """
    ended, results = threading.Event(), queue.SimpleQueue[tuple[T | None, Exception | None, bool]]()
    thread = daemon(_find, steps, ended, results)
    try:
        while True:
            try:
                step, error, is_last = results.get(timeout=patience)
            except queue.Empty:
                yield None
                continue
            if error is not None:
                raise error
            if is_last:
                return
            yield step
    finally:
        ended.set()
        thread.join()


def _find(steps: Iterable, ended: threading.Event, results: queue.SimpleQueue) -> None:
    """Put the results of `steps` into a queue until `ended` is set: (result, exception, whether it is the end)."""
    try:
        with once(ended.is_set):
            for step in steps:
                results.put((step, None, False))
                check()
        results.put((None, None, True))
    except Exception as error:  # the consumer gets it
        results.put((None, error, True))
