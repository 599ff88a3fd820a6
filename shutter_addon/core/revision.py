"""A counter of the edit's changes that Blender reports, and a cache of values until the next change.

Blender reports changed properties (update callbacks), keys and strips (depsgraph), undo and loaded files. It does not
report strokes and files on disk; previews look for these when they are drawn (rendering/invalidation.py).
"""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from .caches import RecentValues

T = TypeVar("T")
_MOST = 128  # cached values


class Revision:
    """A counter of changes, and values that are kept until the next one.

    Attributes:
        number: While it is equal, only the current frame can have changed.
        replaced: How often Blender's data was replaced, by undo or another file.
    """

    def __init__(self) -> None:
        self.number = self.replaced = 0
        # Results and errors, by number, subject and key.
        self._kept: RecentValues[tuple, tuple[Any, Exception | None]] = RecentValues()

    def changed(self) -> None:
        """Count a change, or a possible change."""
        self.number += 1
        self._kept.clear()

    def until_change(self, what: str, key: Hashable, make: Callable[[], T]) -> T:
        """Return what `make` returns or raises, called once per subject and key until the next change.

        This is for drawing. Operators can follow a change that Blender has not reported yet, and read again.
        """
        value, error = self._kept.ask((self.number, what, key), lambda: _outcome(make), _MOST)
        if error is not None:
            raise error.with_traceback(None)  # a traceback would grow with every raise
        return value

    def known(self, what: str, key: Hashable) -> Any:
        """Return the cached value of `until_change`, or None."""
        return self._kept.get((self.number, what, key), (None, None))[0]


def _outcome(make: Callable[[], object]) -> tuple[Any, Exception | None]:
    try:
        return make(), None
    except Exception as error:
        return None, error.with_traceback(None)


edit = Revision()  # the open one's
changed, until_change, known = edit.changed, edit.until_change, edit.known
