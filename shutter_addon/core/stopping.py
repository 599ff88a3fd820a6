"""Work that may be broken off: whoever does it looks between two of its steps whether it is still wanted.

A step is short: a pass over a picture, a frame that is waited for. What is kept from one step to the next has to be
right, or forgotten, wherever the work ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterator
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
    waits: whether it may wait for what a thread makes; has_kept: whether something is kept"""

    soon: float
    end: float
    waits: bool = True
    has_kept: bool = False

    def __call__(self) -> bool:
        return time.monotonic() > (self.soon if self.has_kept else self.end)


# By how much the next slice is longer, so that all ends: of each, and of one that begins again what the last one did.
_LONGER, _AGAIN = 1.02, 1.5


@dataclass
class Slices:
    """The slices of time in which one thing is made: each is longer than the one before, so that it ends.

    key: of what is made; last: the last slice, None: nothing is on its way
    soon, seconds: how long that was to be, with something kept and at most"""

    key: Hashable = None
    last: Slice | None = None
    soon: float = 0.0
    seconds: float = 0.0

    def next(self, key: Hashable, first: float, least: float, *, waits: bool = True) -> Slice:
        """Begins a slice of so many seconds: the first one of a key, or another one."""
        if self.last is None or self.key != key:
            self.soon = self.seconds = first
        else:
            self.soon = max(least, self.soon * _LONGER)
            self.seconds = max(self.soon, self.seconds * (1 if self.last.has_kept else _AGAIN))
        now = time.monotonic()
        self.key, self.last = key, Slice(now + self.soon, now + self.seconds, waits)
        return self.last

    def end(self) -> None:
        """It is made."""
        self.key = self.last = None


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


def waits() -> bool:
    """Whether this step may wait for what another thread makes."""
    return not isinstance(now := _stopped.get(), Slice) or now.waits


def check() -> None:
    """StoppedError: the work that this step belongs to is to end here."""
    if _stopped.get()():
        raise StoppedError
