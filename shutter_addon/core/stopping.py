"""Cancelling work: it checks between short steps whether it is still wanted.

A step is a pass over a picture, or waiting for a frame. Work can end after any step, so state that is kept between
steps has to be valid.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


class StoppedError(Exception):
    """The work is no longer wanted."""


def never() -> bool:
    return False


@dataclass
class Slice:
    """A time slice, after which work ends to continue in the next slice.

    Attributes:
        soon: Time of time.monotonic() when work ends if it has kept something for the next slice.
        end: Time when it ends in any case.
        waits: Whether work may wait for another thread's results.
        has_kept: Whether something was kept.
    """

    soon: float
    end: float
    waits: bool = True
    has_kept: bool = False

    def __call__(self) -> bool:
        return time.monotonic() > (self.soon if self.has_kept else self.end)


# Growth of the next slice, so that all work ends: normally, and for a slice that starts over.
_LONGER, _AGAIN = 1.02, 1.5


@dataclass
class Slices:
    """The time slices in which one result is made, each longer than the one before.

    Attributes:
        key: Of the result.
        last: The last slice; None: nothing is being made.
        soon, seconds: The last slice's duration with something kept, and at most.
    """

    key: Hashable = None
    last: Slice | None = None
    soon: float = 0.0
    seconds: float = 0.0

    def next(self, key: Hashable, first: float, least: float, *, waits: bool = True) -> Slice:
        """Begin a slice of `first` seconds for a new key, or a longer one."""
        if self.last is None or self.key != key:
            self.soon = self.seconds = first
        else:
            self.soon = max(least, self.soon * _LONGER)
            self.seconds = max(self.soon, self.seconds * (1 if self.last.has_kept else _AGAIN))
        now = time.monotonic()
        self.key, self.last = key, Slice(now + self.soon, now + self.seconds, waits)
        return self.last

    def end(self) -> None:
        """Mark the result as made."""
        self.key = self.last = None


_stopped: ContextVar[Callable[[], bool]] = ContextVar("stopped", default=never)


@contextmanager
def once(stopped: Callable[[], bool]) -> Iterator[None]:
    """In this context and thread, stop work when `stopped` returns true."""
    token = _stopped.set(stopped)
    try:
        yield
    finally:
        _stopped.reset(token)


def kept() -> None:
    """Note that this step's result is kept if work ends here."""
    if isinstance(now := _stopped.get(), Slice):
        now.has_kept = True


def waits() -> bool:
    """Return whether this step may wait for another thread's results."""
    return not isinstance(now := _stopped.get(), Slice) or now.waits


def check() -> None:
    """Raise StoppedError if the current work has to end."""
    if _stopped.get()():
        raise StoppedError
