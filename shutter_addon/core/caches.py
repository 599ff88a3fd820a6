"""Small caches: the last value of something, or the last few values, each with a key of what it depends on."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from .stopping import kept

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")


class LastValue(Generic[T]):
    """A cache of one value. If it is asked for with another key, the value is made again.

    Attributes:
        made: How many values have been made so far. A key for what is made from the value can include this number,
            which changes when the value is made again, even if its key is the same.
    """

    def __init__(self) -> None:
        self.made = 0
        self._kept: tuple[Hashable, T, bool] | None = None  # key, value, and whether that is exact

    def get(self, key: Hashable, make: Callable[[], T], *, quick: bool = False) -> T:
        """Return the cached value if it has this key. Otherwise make, cache and return a new one.

        The old value is dropped first, so nothing is cached if `make` raises an exception.

        Args:
            key: Everything that the value depends on, as plain data; keys are compared with ==.
            make: Makes the value.
            quick: Whether an approximate value is enough. What `make` returns then counts as approximate, and is
                returned only to quick calls. An exact value is returned to all.
        """
        if self._kept is None or self._kept[0] != key or not (quick or self._kept[2]):
            self.clear()
            value = make()
            self.made += 1
            self._kept = key, value, not quick
            kept()
        return self._kept[1]

    def clear(self) -> None:
        """Drop the cached value."""
        self._kept = None


class RecentValues(dict[K, T]):
    """A cache of the values that were used last: a dict in order of use, the least recently used value first.

    Get and add values with `ask` and `keep`, which drop old ones. Plain access by key does not change the order.
    """

    def ask(self, key: K, make: Callable[[], T], most: int) -> T:
        """Return the cached value of a key, or make and cache it. Drop the least recently used ones beyond `most`."""
        return self.keep(key, self[key] if key in self else make(), most)

    def keep(self, key: K, value: T, most: int) -> T:
        """Cache a value as the most recently used one, drop others beyond `most` values in all, and return it."""
        self.pop(key, None)
        self[key] = value
        while len(self) > most:
            del self[next(iter(self))]
        return value
