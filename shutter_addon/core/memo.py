"""Memos: the last value of something, or the last ones, kept with the key of what they were made of."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from .stopping import kept

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")


class Memo(Generic[T]):
    """The last value that was made, with its key of plain values: made again where the key is another one.

    made: how many values there were, which tells one from the next where their keys are equal
    """

    def __init__(self) -> None:
        self.made = 0
        self._kept: tuple[Hashable, T, bool] | None = None  # the key, its value, and whether that is exact

    def get(self, key: Hashable, make: Callable[[], T], *, quick: bool = False) -> T:
        """The value of a key: the last one, if it was its; else what `make` gives. Broken off, none is kept.

        quick: an approximation will do, and `make` may give one. What was made so does for quick requests alone."""
        if self._kept is None or self._kept[0] != key or not (quick or self._kept[2]):
            self.clear()
            value = make()
            self.made += 1
            self._kept = key, value, not quick
            kept()
        return self._kept[1]

    def clear(self) -> None:
        """Lets go of the value."""
        self._kept = None


class Kept(dict[K, T]):
    """The last values that were asked for, by keys of plain values; asked for longest ago first."""

    def ask(self, key: K, make: Callable[[], T], most: int) -> T:
        """The value of a key: the kept one, or what `make` gives, which is kept beside most − 1 others."""
        return self.keep(key, self[key] if key in self else make(), most)

    def keep(self, key: K, value: T, most: int) -> T:
        """Keep a value, in place of the key's last one, beside most − 1 others."""
        self.pop(key, None)
        self[key] = value
        while len(self) > most:
            del self[next(iter(self))]
        return value
