"""What the windows of layers read: frames weighted, pixel by pixel, by a layer's matte or by what it leaves."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.frames.planes import Decoded
from ..core.frames.source_wrapper import SourceWrapper
from ..core.memo import Kept
from .window import summable

# Bytes of frames that are kept as they were read, for all windows and mattes that need them.
RECENT_BYTES = 256 << 20
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


class LayerFrames(SourceWrapper):
    """A source of what its frames show of a layer, or of what lies behind all.

    frame: gives a frame (H, W, 4), in the source's samples"""

    def __init__(self, source: FrameSource, frame: Callable[[int], np.ndarray]) -> None:
        super().__init__(source)
        self._frame = frame

    def read(self, index: int) -> np.ndarray:
        return self._frame(index)


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


def with_layers(source: FrameSource, weighted: int, moves: bool) -> int:
    """How many windows a picture has, of which so many are weighted: where there are no running sums, the picture
    without layers is composed as well. moves: something is followed."""
    return weighted + int(moves or not summable(source))


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
