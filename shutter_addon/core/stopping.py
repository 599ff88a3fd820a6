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
    """Raised where work is to end: it was cancelled, its slice is over, or it must not wait for another thread."""


def never() -> bool:
    """Return False: a function to pass to `once` as `stopped` for work that is never cancelled."""
    return False


@dataclass
class Slice:
    """A limit of time for a part of long work, so that the window does not freeze. The next slice continues.

    Call the object to find out whether the time is over. It can be passed to `once`, so that `check` ends the work
    then.

    Attributes:
        soon: When the slice ends, as a time of time.monotonic, if a result was cached in it (`has_kept`), from which
            the next slice can go on.
        end: When it ends otherwise, on the same clock; not before `soon`.
        waits: Whether the work in it may wait for results of another thread (see `waits` in this module).
        has_kept: Whether a result was cached during this slice. The function `kept` sets it.
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
    """The sequence of time slices (Slice) in which a result is made piece by piece, so that no window freezes.

    The limits grow from slice to slice, so that even a step that does not fit into the first slices is done at last.

    Attributes:
        key: Identifies the result that is being made.
        last: The newest slice. None: no result is being made.
        soon: The length of the newest slice, in seconds, if a result is cached in it.
        seconds: The length of the newest slice, in seconds, if nothing is cached in it.
    """

    key: Hashable = None
    last: Slice | None = None
    soon: float = 0.0
    seconds: float = 0.0

    def next(self, key: Hashable, first: float, least: float, *, waits: bool = True) -> Slice:
        """Begin and return the next time slice for work on a result.

        Each further slice gets 2 % more time to end in once it has cached something (`soon`). If the last slice cached
        nothing, its work was lost and starts over, so the next one gets half as much time again (`seconds`).

        Args:
            key: Identifies the result. If it differs from the last slice's, or `end` was called, the sequence begins
                anew.
            first: The length of the first slice in seconds.
            least: The smallest length of a later slice in seconds.
            waits: Whether the work may wait for results of another thread.
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
