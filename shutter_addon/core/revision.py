"""A number that grows with every change of the edit that Blender tells of, and values that are kept until it does.

Blender tells of properties (their update callbacks), of what its depsgraph sees (keys, strips), of undo and of files.
It tells nobody of strokes and of files on disk: previews look for them when they are drawn (rendering/invalidation.py).
"""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from .memo import Kept

T = TypeVar("T")
_MOST = 64  # values of an UntilChange


class Revision:
    """number: grows with every change"""

    def __init__(self) -> None:
        self.number = 0

    def changed(self) -> None:
        self.number += 1


_data = Revision()


def number() -> int:
    """Grows with every change; equal numbers: nothing has changed but the current frame."""
    return _data.number


def changed() -> None:
    """Something has changed, or may have."""
    _data.changed()


class UntilChange:
    """Values by key, each made once until something changes; a few at most.

    For what is drawn: operators, which may follow a change that nobody has told of yet, read anew."""

    def __init__(self) -> None:
        self._number = -1
        self._values: Kept[Hashable, tuple[bool, Any]] = Kept()

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """The value that `make` gives for a key; what it raised, if it did."""
        if self._number != number():
            self._number = number()
            self.clear()
        good, value = self._values.ask(key, lambda: _outcome(make), _MOST)
        if not good:
            raise value.with_traceback(None)  # which would grow with every raise
        return value

    def known(self, key: Hashable) -> Any:
        """The value of a key that has been made since something changed; None: none has, or it could not be."""
        good, value = self._values.get(key, (False, None))
        return value if good and self._number == number() else None

    def clear(self) -> None:
        self._values.clear()


def _outcome(make: Callable[[], object]) -> tuple[bool, Any]:
    """Whether a call succeeds, and what it gives, or raises."""
    try:
        return True, make()
    except Exception as error:
        return False, error.with_traceback(None)
