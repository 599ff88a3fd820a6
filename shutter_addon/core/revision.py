"""A number that grows with every change of the edit that Blender tells of, and values that are kept until it does.

Blender tells of properties (their update callbacks), of what its depsgraph sees (keys, strips), of undo and of files.
It tells nobody of strokes and of files on disk: previews look for them when they are drawn (rendering/invalidation.py).
"""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from .memo import Kept

T = TypeVar("T")
_MOST = 128  # values of until_change


class Revision:
    """number: grows with every change"""

    number = 0

    def changed(self) -> None:
        self.number += 1


_data = Revision()
_kept: Kept[tuple, tuple[bool, Any]] = Kept()  # values of until_change, by number, each with whether it was made


def number() -> int:
    """Grows with every change; equal numbers: nothing has changed but the current frame."""
    return _data.number


def changed() -> None:
    """Something has changed, or may have."""
    _data.changed()


def until_change(what: str, key: Hashable, make: Callable[[], T]) -> T:
    """The value that `make` gives for something and a key, made once until something changes; what it raised, if it
    did. The values that were asked for last are kept.

    For what is drawn: operators, which may follow a change that nobody has told of yet, read anew."""
    if next(reversed(_kept), (number(),))[0] != number():
        _kept.clear()  # all were made before
    good, value = _kept.ask((number(), what, key), lambda: _outcome(make), _MOST)
    if not good:
        raise value.with_traceback(None)  # which would grow with every raise
    return value


def known(what: str, key: Hashable) -> Any:
    """The value of until_change that has been made since something changed; None: none has, or it could not be."""
    good, value = _kept.get((number(), what, key), (False, None))
    return value if good else None


def _outcome(make: Callable[[], object]) -> tuple[bool, Any]:
    """Whether a call succeeds, and what it gives, or raises."""
    try:
        return True, make()
    except Exception as error:
        return False, error.with_traceback(None)
