"""Small caches: the last value of something, or the last values, with keys of what they depend on."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from .stopping import kept

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")


class LastValue(Generic[T]):
    """The last value, with its key of plain values. It is made again for another key.

    Attributes:
        made: How many values were made, which distinguishes values with equal keys.
    """

    def __init__(self) -> None:
        self.made = 0
        self._kept: tuple[Hashable, T, bool] | None = None  # key, value, and whether that is exact

    def get(self, key: Hashable, make: Callable[[], T], *, quick: bool = False) -> T:
        """Return the last value if its key is equal, else what `make` returns. If `make` raises, nothing is kept.

        Args:
            quick: Accept an approximation, and let `make` return one. Exact requests do not use it.
        """
        if self._kept is None or self._kept[0] != key or not (quick or self._kept[2]):
            self.clear()
            value = make()
            self.made += 1
            self._kept = key, value, not quick
            kept()
        return self._kept[1]

    def clear(self) -> None:
        """Drop the value."""
        self._kept = None


class RecentValues(dict[K, T]):
    """The last used values by keys of plain values, the least recently used first."""

    def ask(self, key: K, make: Callable[[], T], most: int) -> T:
        """Return a kept value, or make it and keep it beside most − 1 others."""
        return self.keep(key, self[key] if key in self else make(), most)

    def keep(self, key: K, value: T, most: int) -> T:
        """Keep a value as the most recently used one, beside most − 1 others."""
        self.pop(key, None)
        self[key] = value
        while len(self) > most:
            del self[next(iter(self))]
        return value
