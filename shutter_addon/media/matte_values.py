"""Read mattes: values from files, masks, outlines and ramps for a picture's pixels, feathered and inverted."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from typing import Any

import numpy as np

from ..core.frames.frame_source import FrameSource, SourceFile
from ..core.model.mattes import Content, FileFrame, Matte
from ..core.pixels.matte_grid import block_means, feathered, fitted

# The most files that stay open.
MOST_OPEN = 16

Late = Callable[[Any, int], None]


class MatteValues:
    """Computes mattes at any frame, as values for the pixels of pictures of one size (core.model.mattes.MatteReader).

    It opens the mattes' files when they are needed, and remembers the results of the last call of `values`.
    """

    def __init__(self, width: int, height: int, step: int = 1, late: Late | None = None) -> None:
        """Prepare to compute mattes.

        Args:
            width, height: The size of the pictures in pixels.
            step: Source frames per filmed frame, as in FrameSource.step: more than 1 if moments lie between filmed
                frames. Mattes have filmed frames only; a moment shows that of the filmed frame before it.
            late: For previews. Called with a matte's file and a frame number in it if the outline is not tracked to
                that frame yet, so that tracking can start. Until it is done, the outline moves straight from drawing to
                drawing. None: track it in `values`, which takes time.
        """
        self._size, self._step, self._late = (width, height), step, late
        self._sources: dict[SourceFile, FrameSource] = {}
        self._made: list[tuple[Hashable, np.ndarray]] = []

    def another(self) -> MatteValues:
        """Return a new reader for pictures of the same size, with files of its own."""
        return MatteValues(*self._size, self._step, self._late)

    def values(self, mattes: tuple[Matte, ...], index: int, block: int) -> list[tuple[Hashable, np.ndarray]]:
        """Return the values of mattes at a frame, each with a key.

        Args:
            index: The source frame that is shown. Moments between filmed frames count as source frames.
            block: The side in pixels of the square blocks that share one value, which is their mean. 1: a value for
                each pixel.

        Returns:
            (key, values) for each matte in order. Equal keys mean equal values. Values are float32 (⌈height / block⌉,
            ⌈width / block⌉), 0 to 1, not yet multiplied by the matte's opacity.

        Raises:
            EffectError, MediaError: A file cannot be read.
        """
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
        """Return a key of a matte's content at a frame (equal keys: equal content), and a function that reads it."""
        if not isinstance(content, FileFrame):
            return content, partial(content.values, *self._size)
        file, late = content.file, self._late
        if file not in self._sources:
            self._sources[file] = file.open()
        source: Any = self._sources[file]
        frame = min(max(content.index(source, index // self._step), 0), source.count - 1)
        if late is None or not hasattr(source, "straight") or source.has(frame):
            return (file, frame, False), partial(source.read, frame)

        def straight() -> np.ndarray:
            late(file, frame)
            return source.straight(frame)

        return (file, frame, True), straight

    def _values(self, matte: Matte, shown: np.ndarray, block: int) -> np.ndarray:
        """Return a matte's values: those of its content, fitted into the picture, feathered, inverted and averaged.

        Args:
            matte: The matte, which tells how far to feather and whether to invert.
            shown: The values of its content at a frame, (h, w) float32, 0 to 1, at any size.
            block: The side of the blocks of pixels that are averaged.

        Returns:
            float32 (⌈height / block⌉, ⌈width / block⌉), 0 to 1, for pictures of (width, height).
        """
        values = feathered(fitted(shown, *self._size), matte.feather * self._size[1])
        return block_means(1 - values if matte.invert else values, block)

    def close(self) -> None:
        """Close the files. They are opened again when needed."""
        for source in self._sources.values():
            source.close()
        self._sources.clear()
