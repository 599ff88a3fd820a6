"""What the windows of layers read: frames weighted, pixel by pixel, by a layer's matte or by what it leaves; and mattes
of layers in source frames, each made once, and kept within a budget."""

from collections.abc import Callable, Hashable, Iterable
from functools import partial
from typing import Any

import numpy as np

from ..core.frames import light
from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.frames.planes import Decoded
from ..core.memo import Kept
from ..core.model.frame_state import FrameState, Layers
from ..core.model.mattes import FileFrame, Matte, MatteReader, Ramp
from ..core.pixels import layering
from ..core.stopping import kept

# Bytes of frames that are kept as they were read, for all windows and mattes that need them.
RECENT_BYTES = 256 << 20
# Bytes of mattes that are kept, at most, beyond those of the window.
KEPT_BYTES = 512 << 20
_WHOLE = 65535
LARGEST = np.finfo(np.float32).max  # of light


class RecentFrames(SourceWrapper):
    """A source that keeps the frames which were read last: each window of a layer reads all of them."""

    windows = 1

    def __init__(self, source: FrameSource) -> None:
        super().__init__(source)
        self.most = max(8, RECENT_BYTES // (4 * source.width * source.height * np.dtype(source.dtype).itemsize))
        self._kept: Kept[tuple[str, int], Any] = Kept()

    def read(self, index: int) -> np.ndarray:
        return self._kept.ask(("read", index), lambda: self._source.read(index), self.most)

    def decoded(self, index: int) -> Decoded:
        return self._kept.ask(("decoded", index), lambda: self._source.decoded(index), self.most)

    def want(self, indices: Iterable[int]) -> None:
        """Who reads through this says nothing of what comes next: the renderer does."""

    def clear(self) -> None:
        """Forgets all frames."""
        self._kept.clear()


class WeightedFrames(SourceWrapper):
    """A FrameSource of frames that are premultiplied by weights, in linear light.

    source: the frames; opaque 8-bit ones become halves, all others float32
    weight: gives the weights (H, W) float32, 0 to 1, of a frame
    rest: whether the weights are what layers leave: then running sums hold what these take
    alone: the weights themselves, as alpha; colored: with the frames' colours, as a threshold asks for them
    is_summable: whether running sums can be made of them (running_sums.WeightedSums)
    """

    alpha, transfer = "premultiplied", "linear"

    def __init__(
        self,
        source: FrameSource,
        weight: Callable[[int], np.ndarray],
        *,
        rest: bool = False,
        alone: bool = False,
        colored: bool = False,
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
    """A source's frame (H, W, 4) in linear light, premultiplied, float32."""
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
    """An opaque source's frame (H, W, 4) with other colours (H, W, 3), in linear light, where (H, W) bool."""
    result, own = frame.copy(), colors[where]
    own = light.to_encoded(own) if source.transfer == "srgb" else own
    if frame.dtype.kind == "u":
        most = np.iinfo(frame.dtype).max
        own = np.rint(own.clip(0, 1) * most)
    result[where, :3] = own.astype(frame.dtype)
    return result


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
