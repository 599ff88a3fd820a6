"""A counter of the changes to the edit that Blender reports, and a cache of values that hold until the next change.

Blender reports changed properties (update callbacks), keys and strips (depsgraph), undo and loaded files. It does not
report strokes and files on disk; previews look for these when they are drawn (rendering/invalidation.py).
"""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from .caches import RecentValues

T = TypeVar("T")
_MOST = 128  # cached values


class Revision:
    """A counter of the changes to an edit that Blender reports, and a cache of values that hold until the next change.

    Attributes:
        number: How many changes were counted. While it stays the same, the edit's data are the same, as far as Blender
            reports changes. A new current frame is none. Strokes and files on disk count only once the extension
            notices that they differ, or if it draws the strokes itself.
        replaced: How often Blender's data was replaced as a whole, by undo or by loading a file.
    """

    def __init__(self) -> None:
        self.number = self.replaced = 0
        # Results and errors, by number, subject and key.
        self._kept: RecentValues[tuple, tuple[Any, Exception | None]] = RecentValues()

    def changed(self) -> None:
        """Count a change, or what may be one."""
        self.number += 1
        self._kept.clear()

    def until_change(self, what: str, key: Hashable, make: Callable[[], T]) -> T:
        """Return a value from the cache, or make it if it is not there. The next change of the edit empties the cache.

        This is for drawing, which happens often. Operators should compute values anew, since they can run after a
        change that Blender has not reported yet. Of many values, only the most recently used ones are kept.

        Args:
            what: A name for the kind of value, such as "outline".
            key: Everything else that the value depends on. Together with `what`, it identifies the value in the cache.
            make: Makes the value. An exception that it raises is cached, too, and raised each time.
        """
        value, error = self._kept.ask((self.number, what, key), lambda: _outcome(make), _MOST)
        if error is not None:
            raise error.with_traceback(None)  # a traceback would grow with every raise
        return value

    def known(self, what: str, key: Hashable) -> Any:
        """Return the value that `until_change` has cached for a name and key, or None."""
        return self._kept.get((self.number, what, key), (None, None))[0]


def _outcome(make: Callable[[], object]) -> tuple[Any, Exception | None]:
    try:
        return make(), None
    except Exception as error:
        return None, error.with_traceback(None)


edit = Revision()  # the open one's
changed, until_change, known = edit.changed, edit.until_change, edit.known
