"""A counter of the edit's changes that Blender reports, and a cache of values until the next change.

Blender reports changed properties (update callbacks), keys and strips (depsgraph), undo and loaded files. It does not
report strokes and files on disk; previews look for these when they are drawn (rendering/invalidation.py).
"""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from .memo import Kept

T = TypeVar("T")
_MOST = 128  # cached values


class Revision:
    """A counter of changes."""

    number = 0

    def changed(self) -> None:
        self.number += 1


_changes = Revision()
_kept: Kept[tuple, tuple[bool, Any]] = Kept()  # by number, subject and key: whether `make` succeeded, and its outcome


def number() -> int:
    """Return the counter of changes. While it is equal, only the current frame can have changed."""
    return _changes.number


def changed() -> None:
    """Count a change, or a possible change."""
    _changes.changed()


def until_change(what: str, key: Hashable, make: Callable[[], T]) -> T:
    """Return what `make` returns or raises, called once per subject and key until the next change.

    This is for drawing. Operators can follow a change that Blender has not reported yet, and read again.
    """
    if next(reversed(_kept), (number(),))[0] != number():
        _kept.clear()  # outdated
    good, value = _kept.ask((number(), what, key), lambda: _outcome(make), _MOST)
    if not good:
        raise value.with_traceback(None)  # a traceback would grow with every raise
    return value


def known(what: str, key: Hashable) -> Any:
    """Return the cached value of `until_change`, or None."""
    good, value = _kept.get((number(), what, key), (False, None))
    return value if good else None


def _outcome(make: Callable[[], object]) -> tuple[bool, Any]:
    """Return whether a call succeeds, and its result or error."""
    try:
        return True, make()
    except Exception as error:
        return False, error.with_traceback(None)
