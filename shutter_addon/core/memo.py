"""Memos: the last value of something, kept with the key of what it was made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Memo:
    """The last value that was made, with its key of plain values: made again where the key is another one.

    made: how many values there were, which tells one from the next where their keys are equal
    """

    def __init__(self):
        self.made = 0
        self.clear()

    def get(self, key, make: Callable[[], Any], *, quick: bool = False):
        """The value of a key: the last one, if it was its; else what `make` gives. Broken off, none is kept.

        quick: an approximation will do, and `make` may give one. What was made so does for quick requests alone."""
        if self._key is None or self._key != key or not (quick or self._is_exact):
            self.clear()
            value = make()
            self.made += 1
            self._key, self._value, self._is_exact = key, value, not quick
        return self._value

    def clear(self) -> None:
        """Lets go of the value."""
        self._key = self._value = None
        self._is_exact = False
