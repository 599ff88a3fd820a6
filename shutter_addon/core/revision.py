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
    """number: grows with every change
    kept: values of until_change, each with whether it could be made; at: the number at which they were made"""

    def __init__(self) -> None:
        self.number = self.at = 0
        self.kept: Kept[Hashable, tuple[bool, Any]] = Kept()

    def changed(self) -> None:
        self.number += 1


_data = Revision()


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
    if _data.at != (start := number()):
        _data.at = start
        _data.kept.clear()
    good, value = _data.kept.ask((what, key), lambda: _outcome(make), _MOST)
    if number() != start:  # meanwhile
        _data.at = -1
    if not good:
        raise value.with_traceback(None)  # which would grow with every raise
    return value


def known(what: str, key: Hashable) -> Any:
    """The value of until_change that has been made since something changed; None: none has, or it could not be."""
    good, value = _data.kept.get((what, key), (False, None))
    return value if good and _data.at == number() else None


def _outcome(make: Callable[[], object]) -> tuple[bool, Any]:
    """Whether a call succeeds, and what it gives, or raises."""
    try:
        return True, make()
    except Exception as error:
        return False, error.with_traceback(None)
