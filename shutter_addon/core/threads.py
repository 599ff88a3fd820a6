"""The one place that starts threads. docs/internals.md (Threads) lists what runs on them, and why none of it touches
Blender's data, which belongs to Blender's main thread.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from . import told
from .stopping import check, once

T = TypeVar("T")
_NAME = "Virtual Shutter"


def start(function: Callable[..., T], *arguments: object) -> Future[T]:
    """What a function will return or raise, called by a thread of its own, which ends with it. Python waits for it
    before it ends."""
    executor = pool(1)
    future = executor.submit(function, *arguments)
    executor.shutdown(wait=False)
    return future


def pool(workers: int | None = None) -> ThreadPoolExecutor:
    """So many threads that call functions, to be shut down; None: as many as Python chooses."""
    return ThreadPoolExecutor(workers, _NAME)


def fulfil(future: Future[T], function: Callable[[], T]) -> bool:
    """Has a future what a function gives or raises. Whether it was called: not where the future was cancelled."""
    if not future.set_running_or_notify_cancel():
        return False
    try:
        future.set_result(function())
    except Exception as error:
        future.set_exception(error.with_traceback(None))  # whose frames may refer to textures
    return True


def daemon(function: Callable[..., object], *arguments: object) -> threading.Thread:
    """A thread that calls a function, which goes on until it is told to end. Python ends without it, and prints what it
    raises."""
    thread = threading.Thread(target=_noting, args=(function, *arguments), name=_NAME, daemon=True)
    thread.start()
    return thread


def _noting(function: Callable[..., object], *arguments: object) -> None:
    try:
        function(*arguments)
    except Exception as error:  # that nobody expected: others find no way to whoever waits
        told.exception(error)
        raise


def beside(steps: Iterable[T], patience: float | None) -> Generator[T | None, None, None]:
    """What an iterable gives, found by a thread of its own, which goes ahead.

    patience: seconds after which it gives None where nothing was found yet; None: it waits. Closed early, it has the
    thread end at its next `stopping.check`, and waits for that."""
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
    try:
        with once(ended.is_set):
            for step in steps:
                results.put((step, None, False))
                check()
        results.put((None, None, True))
    except Exception as error:  # raised to whoever asks for the next step
        results.put((None, error, True))
