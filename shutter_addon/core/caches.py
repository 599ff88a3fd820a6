"""Small caches: the last value of something, or the last few values, each with a key of what it depends on."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from .stopping import kept

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")


class LastValue(Generic[T]):
    """A cache of one value, which is made again when it is asked for with another key.

    Attributes:
        made: How many values have been made, which tells apart values with equal keys.
    """

    def __init__(self) -> None:
        self.made = 0
        self._kept: tuple[Hashable, T, bool] | None = None  # key, value, and whether that is exact

    def get(self, key: Hashable, make: Callable[[], T], *, quick: bool = False) -> T:
        """Return the cached value if its key equals `key`, else make and cache one.

        If `make` raises an exception, nothing is cached.

        Args:
            key: Everything that the value depends on, as hashable plain data.
            make: Makes the value.
            quick: Whether an approximation suffices, as the cached value or as what `make` returns. A request that is
                not quick does not get an approximation.
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
    """A cache of the values that were used last: a dict by key, with the least recently used value first."""

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
