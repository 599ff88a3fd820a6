"""Frames for previews: at a half or a quarter of their width and height, or read from a proxy, the smaller or lighter
copy that Blender's sequencer has made of the footage."""

from functools import cached_property

import numpy as np

from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.frames.light import to_linear
from ..core.pixels.matte_grid import block_sums
from .errors import MediaError
from .opencv import cv2

DIVISORS = 1, 2, 4
STRETCHED = 0.1  # by which share the sides may differ: Blender's movies have even ones


def smaller(source: FrameSource, divisor: int) -> FrameSource:
    """The source, that many times smaller each way; a last pixel stands for what is left."""
    if divisor == 1:
        return source
    made = SourceWrapper(source, lambda index: reduced(source.read(index), divisor, source.alpha))
    made.width, made.height = (reduced_size(length, divisor) for length in (source.width, source.height))
    return made


def reduced_size(length: int, divisor: int) -> int:
    """How many pixels stand for so many."""
    return -(-length // divisor)


def reduced(frame: np.ndarray, divisor: int, alpha: str) -> np.ndarray:
    """The means over squares of a frame (height, width, 4), of the same type; at the right and the bottom the last
    pixel goes on. alpha: a FrameSource's; straight colours count by their cover."""
    if divisor == 1:
        return frame
    whole = frame.dtype.kind == "u"
    if alpha == "straight":
        colours = frame.astype(np.float32)
        colours[..., :3] *= colours[..., 3:]
        means = block_sums(colours, divisor, np.float32) / divisor**2
        np.divide(means[..., :3], means[..., 3:], out=means[..., :3], where=means[..., 3:] > 0)
    elif whole:
        sums = block_sums(frame, divisor, np.uint16 if frame.dtype == np.uint8 else np.uint32)
        return ((sums + sums.dtype.type(divisor**2 // 2)) // sums.dtype.type(divisor**2)).astype(frame.dtype)
    else:
        means = block_sums(frame, divisor, np.float32) / divisor**2
    return (np.rint(means) if whole else means).astype(frame.dtype)


class ProxySource(SourceWrapper):
    """A source whose frames are those of a proxy that `fits`, made to its size and samples. A frame that the proxy
    lacks, or that is damaged there, is the source's own."""

    from_proxy = True

    def __init__(self, source: FrameSource, proxy: FrameSource) -> None:
        super().__init__(source)
        self._proxy = proxy
        source.close()  # until a frame is wanted of it

    def read(self, index: int) -> np.ndarray:
        """The frame (height, width, 4), of new memory."""
        try:
            frame = self._proxy.read(index)
        except MediaError:
            return self._source.read(index)
        if frame.shape[:2] != (self.height, self.width):
            dtype = np.float32 if frame.dtype == np.float16 else frame.dtype  # which OpenCV does not resize
            size = self.width, self.height
            fitted = cv2.resize(frame.astype(dtype, copy=False), size, interpolation=cv2.INTER_AREA)
            frame = fitted.astype(frame.dtype, copy=False)
        if (self._proxy.dtype, self._proxy.transfer) == (self.dtype, self.transfer):
            return frame
        return self._samples[frame if frame.dtype == np.uint8 else frame.view(np.uint16)]

    @cached_property
    def _samples(self) -> np.ndarray:
        """What the source has for each sample of the proxy: bytes, or halves by their bits."""
        is_byte = self._proxy.dtype == np.uint8
        levels = np.arange(256) / 255 if is_byte else np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(float)
        with np.errstate(invalid="ignore", over="ignore"):  # not every half is a number
            if self._proxy.transfer != self.transfer:
                levels = to_linear(levels)
            if self.dtype.kind == "u":
                levels = np.rint(np.nan_to_num(levels).clip(0, 1) * np.iinfo(self.dtype).max)
            return levels.astype(self.dtype)

    def close(self) -> None:
        self._proxy.close()
        self._source.close()


def fits(proxy: FrameSource, source: FrameSource) -> bool:
    """Whether a proxy may stand for a source: as many frames, not turned, nothing to see through in either, and bytes
    or halves: what Blender writes of float images, named .jpg, is EXR with sRGB values. To resize it takes OpenCV."""
    stretched = proxy.width * source.height / (proxy.height * source.width)
    return (
        proxy.count == source.count
        and (cv2 is not None or (proxy.width, proxy.height) == (source.width, source.height))
        and abs(stretched - 1) < STRETCHED
        and proxy.alpha == source.alpha == "opaque"
        and (proxy.dtype in (np.uint8, np.float16) or (proxy.dtype, proxy.transfer) == (source.dtype, source.transfer))
    )
