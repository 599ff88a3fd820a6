"""Work that may be broken off: whoever does it looks between two of its steps whether it is still wanted.

A step is short: a pass over a picture, a frame that is waited for. What is kept from one step to the next has to be
right, or forgotten, wherever the work ends.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeVar

T = TypeVar("T")


class StoppedError(Exception):
    """The work is not wanted any longer."""


def never() -> bool:
    return False


_stopped: ContextVar[Callable[[], bool]] = ContextVar("stopped", default=never)


@contextmanager
def once(stopped: Callable[[], bool]) -> Iterator[None]:
    """Inside, on this thread, work ends once `stopped` says so."""
    token = _stopped.set(stopped)
    try:
        yield
    finally:
        _stopped.reset(token)


def check() -> None:
    """StoppedError: the work that this step belongs to is to end here."""
    if _stopped.get()():
        raise StoppedError


def in_thread(function: Callable[..., Any], *arguments: Any) -> Future:
    """What a function will return or raise, called by a thread of its own, which ends with it."""
    pool = ThreadPoolExecutor(1, "Virtual Shutter")
    future = pool.submit(function, *arguments)
    pool.shutdown(wait=False)
    return future


def beside(steps: Iterable[T], patience: float | None) -> Generator[T | None, None, None]:
    """What an iterable gives, found by a thread of its own, which goes ahead.

    patience: seconds after which it gives None where nothing was found yet; None: it waits. Closed early, it has the
    thread end at its next `check`, and waits for that."""
    ended, results = threading.Event(), queue.SimpleQueue[tuple[T | None, Exception | None, bool]]()
    thread = threading.Thread(target=_find, args=(steps, ended, results), name="Virtual Shutter", daemon=True)
    thread.start()
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
