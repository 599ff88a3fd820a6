"""Values of mattes: files, masks and ramps on the pixels of a picture, feathered and inverted."""

from __future__ import annotations

from collections.abc import Callable, Hashable
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
            key = self._content_key(matte.content, index), matte.feather, matte.invert, block
            self._made.append((key, known[key] if key in known else self._values(matte, index, block)))
        return list(self._made)

    def _content_key(self, content: Content, index: int) -> Hashable:
        if not isinstance(content, FileFrame):
            return content
        frame = self._frame(content, index)
        return content.file, frame, self._stands_in(content.file, frame) is not None

    def _stands_in(self, file: MatteFile, frame: int) -> CarriedMattes | None:
        """What has a matte that stands in for that of a frame; None: its own is taken."""
        source = self._sources[file]
        if self._late is None or not isinstance(source, CarriedMattes) or source.has(frame):
            return None
        return source

    def _frame(self, content: FileFrame, index: int) -> int:
        """The frame of its file, which is opened."""
        if content.file not in self._sources:
            self._sources[content.file] = content.file.open()
        source = self._sources[content.file]
        return min(max(content.index(source, index // self._step), 0), source.count - 1)

    def _values(self, matte: Matte, index: int, block: int) -> np.ndarray:
        if isinstance(matte.content, FileFrame):
            frame = self._frame(matte.content, index)
            values = fitted(self._read(matte.content.file, frame), *self._size)
        else:
            values = matte.content.values(*self._size)
        values = feathered(values, matte.feather * self._size[1])
        return block_means(1 - values if matte.invert else values, block)

    def _read(self, file: MatteFile, frame: int) -> np.ndarray:
        source = self._stands_in(file, frame)
        if source is None or self._late is None:
            return self._sources[file].read(frame)
        self._late(file, frame)
        return source.straight(frame)

    def close(self) -> None:
        """Closes the files; they are opened again when they are needed."""
        for source in self._sources.values():
            source.close()
        self._sources.clear()
