"""Cancel work: between short steps, work calls `check`, which raises StoppedError if the work is no longer wanted.

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
    """The work was cancelled, or its time slice is over."""


def never() -> bool:
    """Return False: a function to pass to `once` as `stopped` for work that is never cancelled."""
    return False


@dataclass
class Slice:
    """A time slice of work that would freeze the window if it ran in one go. The next slice continues it.

    Call the object to find out whether its time is over.

    Attributes:
        soon: When it ends (by time.monotonic) if it has kept a result for the next slice.
        end: When it ends in any case.
        waits: Whether work may wait for another thread's results.
        has_kept: Whether it has kept a result.
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
    """Time slices in which one result is made piece by piece, so that the window does not freeze.

    Each is longer than the last one, so that all work ends.

    Attributes:
        key: Which result is being made.
        last: The last slice; None: nothing is being made.
        soon: How many seconds the last slice lasts once it has kept something for the next one.
        seconds: How many seconds it lasts at most.
    """

    key: Hashable = None
    last: Slice | None = None
    soon: float = 0.0
    seconds: float = 0.0

    def next(self, key: Hashable, first: float, least: float, *, waits: bool = True) -> Slice:
        """Begin the next time slice of work on a result, and return it. Slices grow, so that all work ends.

        Args:
            key: Which result is made. A new one begins with a slice of `first` seconds.
            first: The length of the first slice in seconds.
            least: The least seconds of a later slice.
            waits: Whether work may wait for another thread's results.
        """
        if self.last is None or self.key != key:
            self.soon = self.seconds = first
        else:
            self.soon = max(least, self.soon * _LONGER)
            self.seconds = max(self.soon, self.seconds * (1 if self.last.has_kept else _AGAIN))
        now = time.monotonic()
        self.key, self.last = key, Slice(now + self.soon, now + self.seconds, waits)
        return self.last

    def end(self) -> None:
        """Note that the result has been made, so that the next slice begins a new one."""
        self.key = self.last = None


_stopped: ContextVar[Callable[[], bool]] = ContextVar("stopped", default=never)


@contextmanager
def once(stopped: Callable[[], bool]) -> Iterator[None]:
    """Cancel work of this thread inside the context, at its next `check`, when `stopped` returns true."""
    token = _stopped.set(stopped)
    try:
        yield
    finally:
        _stopped.reset(token)


def kept() -> None:
    """Note that the result of a step is cached, so that the current time slice may end earlier (Slice.soon)."""
    if isinstance(now := _stopped.get(), Slice):
        now.has_kept = True


def waits() -> bool:
    """Return whether the current work may wait for another thread's results. Only a time slice can forbid it."""
    return not isinstance(now := _stopped.get(), Slice) or now.waits


def check() -> None:
    """Raise StoppedError if the work of this thread has to end. Call it between steps."""
    if _stopped.get()():
        raise StoppedError
