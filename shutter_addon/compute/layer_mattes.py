"""Mattes of layers in source frames: each is made once, and kept within a budget."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial

import numpy as np

from ..core.memo import Kept
from ..core.model.frame_state import FrameState, Layers
from ..core.model.mattes import FileFrame, Matte, MatteReader, Ramp
from ..core.pixels import layering
from ..core.stopping import kept

# Bytes of mattes that are kept, at most, beyond those of the window.
KEPT_BYTES = 512 << 20
_WHOLE = 65535


class LayerMattes:
    """The mattes of a source's layers, and what they leave of what lies behind.

    size: (w, h) of the pictures
    solve: gives coefficients (N, h, w) float32 of a state (Layers.scribbles) at a source frame
    reader: what makes the values of mattes; None: there are none
    """

    def __init__(
        self,
        size: tuple[int, int],
        solve: Callable[[FrameState, int], np.ndarray],
        reader: MatteReader | None,
    ) -> None:
        self._size, self._solve, self._reader = size, solve, reader
        self._kept: Kept[Hashable, np.ndarray] = Kept()
        self._most = max(KEPT_BYTES // (2 * size[0] * size[1]), 16)

    def of(self, layers: Layers, frame: int) -> list[np.ndarray]:
        """The mattes (H, W) float32, 0 to 1, of all layers in a source frame, with their opacities."""
        return [self.one(layers, frame, i) for i in range(len(layers.opacities))]

    def one(self, layers: Layers, frame: int, layer: int) -> np.ndarray:
        """That of one layer."""
        return self._whole(layers, frame, layer) * np.float32(layers.opacities[layer])

    def edges(self, layers: Layers, frame: int) -> list[np.ndarray]:
        """The mattes that say which pixels hold some of a subject and some of what lies behind it: without opacities,
        and nothing of ramps and of what is drawn, whose soft edges are none of the picture's."""
        shown = layers.mattes[self._place(layers, frame)]
        tell = [matte is not None and not isinstance(matte.content, Ramp) for matte in shown]
        nothing = np.zeros(self._size[::-1], np.float32)
        return [self._whole(layers, frame, i) if tells else nothing for i, tells in enumerate(tell)]

    @staticmethod
    def _place(layers: Layers, frame: int) -> int:
        return min(max(frame - layers.first, 0), len(layers.mattes) - 1)

    def _whole(self, layers: Layers, frame: int, layer: int) -> np.ndarray:
        """A matte without its opacity."""
        place = self._place(layers, frame)
        drawn, matte = layers.scribbles[place], layers.mattes[place][layer]
        if matte is not None:
            value = self._read(matte, frame)
        elif drawn is not None:
            value = self._drawn(drawn, frame, layer)
        return value.astype(np.float32) / np.float32(_WHOLE)

    def behind(self, layers: Layers, frame: int) -> np.ndarray:
        """How much (H, W) float32 of what lies behind all layers is seen in a source frame."""
        return layering.behind(self.of(layers, frame))

    def _read(self, matte: Matte, frame: int) -> np.ndarray:
        if self._reader is None:
            raise ValueError("nobody reads mattes")
        reader = self._reader
        moves = frame if isinstance(matte.content, FileFrame) else None
        key = matte.content, matte.feather, matte.invert, moves
        return self._get(key, lambda: reader.values((matte,), frame, 1)[0][1])

    def _drawn(self, state: FrameState, frame: int, layer: int) -> np.ndarray:
        """Of a layer that is drawn. Where no edges are followed, it is the same whatever the frame shows."""
        key = state.key, frame if state.options.edge_aware else None
        if (key, layer) not in self._kept:
            for i, values in enumerate(self._solve(state, frame)[1:]):
                self._get((key, i), partial(self._in_pixels, values, state.options.aggregate))
        return self._get((key, layer), lambda: np.zeros(self._size[::-1]))

    def _in_pixels(self, coefficients: np.ndarray, block: int) -> np.ndarray:
        values = layering.matte_of(coefficients)
        if block > 1:
            values = values.repeat(block, 0).repeat(block, 1)
        return values[: self._size[1], : self._size[0]]

    def _get(self, key: Hashable, make: Callable[[], np.ndarray]) -> np.ndarray:
        def made() -> np.ndarray:
            values = np.rint(make() * np.float32(_WHOLE)).astype(np.uint16)
            kept()
            return values

        return self._kept.ask(key, made, self._most)

    def clear(self) -> None:
        """Forgets all mattes."""
        self._kept.clear()

    def close(self) -> None:
        """Forgets all mattes, and closes their files."""
        self.clear()
        if self._reader is not None:
            self._reader.close()
