"""Work that may be broken off: whoever does it looks between two of its steps whether it is still wanted.

A step is short: a pass over a picture, a frame that is waited for. What is kept from one step to the next has to be
right, or forgotten, wherever the work ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar


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
