"""Work that may be broken off: whoever does it looks between two of its steps whether it is still wanted.

A step is short: a pass over a picture, a frame that is waited for. What is kept from one step to the next has to be
right, or forgotten, wherever the work ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


class StoppedError(Exception):
    """The work is not wanted any longer."""


def never() -> bool:
    return False


@dataclass
class Slice:
    """What tells work to end after some time, and to go on in another slice.

    soon: of time.monotonic(), when it ends once something is kept for the next one; end: when it ends all the same
    has_kept: whether something is kept"""

    soon: float
    end: float
    has_kept: bool = False

    def __call__(self) -> bool:
        return time.monotonic() > (self.soon if self.has_kept else self.end)


_stopped: ContextVar[Callable[[], bool]] = ContextVar("stopped", default=never)


@contextmanager
def once(stopped: Callable[[], bool]) -> Iterator[None]:
    """Inside, on this thread, work ends once `stopped` says so."""
    token = _stopped.set(stopped)
    try:
        yield
    finally:
        _stopped.reset(token)


def kept() -> None:
    """Notes that what this step has made is kept, should the work end here."""
    if isinstance(now := _stopped.get(), Slice):
        now.has_kept = True


def check() -> None:
    """StoppedError: the work that this step belongs to is to end here."""
    if _stopped.get()():
        raise StoppedError
