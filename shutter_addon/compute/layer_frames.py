"""Frames for the windows of layers: weighted pixel by pixel with a layer's matte, or with what all mattes leave. And
the mattes of layers in source frames, each made once and cached."""

from collections.abc import Callable, Hashable, Iterable
from functools import partial
from typing import Any

import numpy as np

from ..core.caches import RecentValues
from ..core.frames import light
from ..core.frames.frame_source import Decoded, FrameSource, SourceWrapper
from ..core.model.frame_state import FrameState, Layers
from ..core.model.mattes import FileFrame, MatteReader, Ramp
from ..core.pixels import layering
from ..core.stopping import kept

# Bytes of cached frames, shared by all windows and mattes.
RECENT_BYTES = 256 << 20
# Bytes of cached mattes.
KEPT_BYTES = 512 << 20
_WHOLE = 65535
LARGEST = np.finfo(np.float32).max  # the most light


class RecentFrames(SourceWrapper):
    """A source that caches the last frames, since each layer's window reads all of them."""

    windows = 1

    def __init__(self, source: FrameSource) -> None:
        super().__init__(source)
        self.most = max(8, RECENT_BYTES // (4 * source.width * source.height * np.dtype(source.dtype).itemsize))
        self._kept: RecentValues[tuple[str, int], Any] = RecentValues()

    def read(self, index: int) -> np.ndarray:
        return self._kept.ask(("read", index), lambda: self._source.read(index), self.most)

    def decoded(self, index: int) -> Decoded:
        return self._kept.ask(("decoded", index), lambda: self._source.decoded(index), self.most)

    def want(self, indices: Iterable[int]) -> None:
        """Ignore the hint: the renderer tells the source which frames come next."""

    def clear(self) -> None:
        """Forget all frames."""
        self._kept.clear()


class WeightedFrames(SourceWrapper):
    """Frames in linear light, premultiplied with weights.

    Attributes:
        base: the source of the frames; opaque 8-bit frames become half floats, all others float32
        weight: returns a frame's weights (H, W) float32, 0 … 1
        rest: the weights are what layers leave; running sums then hold what layers take
        alone: only the weights, as alpha
        colored: alone, but with the frames' colors, which a threshold needs
        is_summable: whether running sums can be made of them (running_sums.WeightedSums)
    """

    alpha, transfer = "premultiplied", "linear"

    def __init__(
        self, source: FrameSource, weight: Callable[[int], np.ndarray], *, rest: bool, alone: bool, colored: bool
    ) -> None:
        super().__init__(source)
        self.base, self.weight, self.rest, self.alone, self.colored = source, weight, rest, alone, colored
        is_short = np.dtype(source.dtype) == np.uint8 and source.alpha == "opaque"
        self.is_summable, self.dtype = is_short and not alone, np.dtype(np.float16 if is_short else np.float32)

    def read(self, index: int) -> np.ndarray:
        weight = self.weight(index)
        if self.alone and not self.colored:
            seen = np.zeros((*weight.shape, 4), self.dtype)
        else:
            seen = linear(self.base.read(index), self.base) * weight[..., None]
        if self.alone:
            seen[..., :3] = light.straight(seen)[..., :3] * weight[..., None]
            seen[..., 3] = weight
        return seen.astype(self.dtype)


def linear(frame: np.ndarray, source: FrameSource) -> np.ndarray:
    """Return a source's frame (H, W, 4) float32 in linear light, premultiplied."""
    if frame.dtype.kind == "u":
        most = np.iinfo(frame.dtype).max
        if source.alpha != "premultiplied":
            curve = np.arange(most + 1, dtype=np.float32) / np.float32(most)
            curve = light.to_linear(curve) if source.transfer == "srgb" else curve
            alpha = frame[..., 3:].astype(np.float32) / np.float32(most)
            colors = curve.take(frame[..., :3])
            return np.concatenate([colors if source.alpha == "opaque" else colors * alpha, alpha], axis=-1)
        frame = frame / np.float32(most)
    frame = frame.astype(np.float32)
    if source.alpha == "premultiplied":
        return light.linearised(frame) if source.transfer == "srgb" else frame
    made = light.premultiplied(frame, light.to_linear if source.transfer == "srgb" else None)
    return made.clip(-LARGEST, LARGEST)  # an alpha may exceed 1


def with_colors(frame: np.ndarray, colors: np.ndarray, where: np.ndarray, source: FrameSource) -> np.ndarray:
    """Return an opaque source's frame (H, W, 4) with some colors replaced.

    Args:
        frame: (H, W, 4)
        colors: (H, W, 3), in linear light
        where: (H, W) bool
        source: the frame's source
    """
    result, own = frame.copy(), colors[where]
    own = light.to_encoded(own) if source.transfer == "srgb" else own
    if frame.dtype.kind == "u":
        most = np.iinfo(frame.dtype).max
        own = np.rint(own.clip(0, 1) * most)
    result[where, :3] = own.astype(frame.dtype)
    return result


class LayerMattes:
    """The mattes of a source's layers, cached.

    Args:
        size: (w, h) of the pictures
        solve: returns coefficients (N, h, w) float32 of a state (Layers.scribbles) at a source frame
        reader: reads the values of mattes. None: there are none.
    """

    def __init__(
        self, size: tuple[int, int], solve: Callable[[FrameState, int], np.ndarray], reader: MatteReader | None
    ) -> None:
        self._size, self._solve, self._reader = size, solve, reader
        self._kept: RecentValues[Hashable, np.ndarray] = RecentValues()
        self._most = max(KEPT_BYTES // (2 * size[0] * size[1]), 16)

    def of(self, layers: Layers, frame: int) -> list[np.ndarray]:
        """Return the mattes (H, W) float32, 0 … 1, of all layers in a source frame, times their opacities."""
        return [self.one(layers, frame, i) for i in range(len(layers.opacities))]

    def one(self, layers: Layers, frame: int, layer: int) -> np.ndarray:
        """Return the matte of one layer."""
        return self._whole(layers, frame, layer) * np.float32(layers.opacities[layer])

    def edges(self, layers: Layers, frame: int) -> list[np.ndarray]:
        """Return the mattes whose soft edges mix a subject with what lies behind it, without opacities.

        Ramps and drawings have soft edges that are not in the picture: their mattes are 0 here.
        """
        shown = layers.mattes[self._place(layers, frame)]
        tell = [matte is not None and not isinstance(matte.content, Ramp) for matte in shown]
        nothing = np.zeros(self._size[::-1], np.float32)
        return [self._whole(layers, frame, i) if tells else nothing for i, tells in enumerate(tell)]

    @staticmethod
    def _place(layers: Layers, frame: int) -> int:
        return min(max(frame - layers.first, 0), len(layers.mattes) - 1)

    def _whole(self, layers: Layers, frame: int, layer: int) -> np.ndarray:
        """Return a matte without its opacity."""
        place = self._place(layers, frame)
        drawn, matte = layers.scribbles[place], layers.mattes[place][layer]
        if matte is not None:
            reader = self._reader
            assert reader is not None
            moves = frame if isinstance(matte.content, FileFrame) else None
            key = matte.content, matte.feather, matte.invert, moves
            value = self._get(key, lambda: reader.values((matte,), frame, 1)[0][1])
        elif drawn is not None:
            value = self._drawn(drawn, frame, layer)
        return value.astype(np.float32) / np.float32(_WHOLE)

    def behind(self, layers: Layers, frame: int) -> np.ndarray:
        """Return how much (H, W) float32 of what lies behind all layers a source frame shows."""
        return layering.behind(self.of(layers, frame))

    def _drawn(self, state: FrameState, frame: int, layer: int) -> np.ndarray:
        """Return the matte of a drawn layer. Unless it follows edges, it does not depend on the frame."""
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

    def close(self) -> None:
        """Forget all mattes, and close their files."""
        self._kept.clear()
        if self._reader is not None:
            self._reader.close()
