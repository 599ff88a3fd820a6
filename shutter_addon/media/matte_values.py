"""Values of mattes: files, masks and ramps on the pixels of a picture, feathered and inverted."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from typing import Any

import numpy as np

from ..core.model.mattes import Content, FileFrame, Matte, MatteFile, MatteSource
from ..core.pixels.matte_grid import block_means, feathered, fitted
from .carried_mattes import CarriedMattes
from .cuts import ShotSource

# Files that stay open though the last mattes were of others.
MOST_OPEN = 16

Late = Callable[[Any, int], None]


class MatteValues:
    """A core.model.mattes.MatteReader for pictures of one size.

    step: frames of the source for each filmed one (Options.step)
    late: is told of each matte of an outline that would have to be carried first, by its file and frame: a straight one
    stands in for it; None: it is carried"""

    def __init__(self, width: int, height: int, step: int = 1, late: Late | None = None) -> None:
        self._size, self._step, self._late = (width, height), step, late
        self._sources: dict[MatteFile, MatteSource] = {}
        self._made: list[tuple[Hashable, np.ndarray]] = []

    def another(self) -> MatteValues:
        """See MatteReader."""
        return MatteValues(*self._size, self._step, self._late)

    @classmethod
    def of(cls, source: ShotSource, late: Late | None = None) -> MatteValues:
        """For the pictures of a source, as core.model.mattes has them."""
        return cls(source.width, source.height, source.step, late)

    def values(self, mattes: tuple[Matte, ...], index: int, block: int) -> list[tuple[Hashable, np.ndarray]]:
        """As MatteReader.values. EffectError, MediaError: those of a file cannot be had."""
        files = {matte.content.file for matte in mattes if isinstance(matte.content, FileFrame)}
        if len(self._sources.keys() | files) > MOST_OPEN:
            for file in self._sources.keys() - files:
                self._sources.pop(file).close()
        known, self._made = dict(self._made), []
        for matte in mattes:
            content, read = self._content(matte.content, index)
            key = content, matte.feather, matte.invert, block
            self._made.append((key, known[key] if key in known else self._values(matte, read(), block)))
        return list(self._made)

    def _content(self, content: Content, index: int) -> tuple[Hashable, Callable[[], np.ndarray]]:
        """A key of what a matte shows at a frame of the source, and what gives it; its file is opened."""
        if not isinstance(content, FileFrame):
            return content, partial(content.values, *self._size)
        file, late = content.file, self._late
        if file not in self._sources:
            self._sources[file] = file.open()
        source = self._sources[file]
        frame = min(max(content.index(source, index // self._step), 0), source.count - 1)
        if late is None or not isinstance(source, CarriedMattes) or source.has(frame):
            return (file, frame, False), partial(source.read, frame)

        def straight() -> np.ndarray:
            late(file, frame)
            return source.straight(frame)

        return (file, frame, True), straight

    def _values(self, matte: Matte, shown: np.ndarray, block: int) -> np.ndarray:
        values = feathered(fitted(shown, *self._size), matte.feather * self._size[1])
        return block_means(1 - values if matte.invert else values, block)

    def close(self) -> None:
        """Closes the files; they are opened again when they are needed."""
        for source in self._sources.values():
            source.close()
        self._sources.clear()
