"""Smaller frames for previews: reduced to a half or a quarter, or read from a proxy of Blender's sequencer."""

from functools import cached_property

import numpy as np

from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.frames.light import to_linear
from ..core.messages import MediaError
from ..core.pixels.matte_grid import block_sums
from .opencv import cv2

DIVISORS = 1, 2, 4
STRETCHED = 0.1  # how much a proxy's aspect may differ, since the sides of Blender's movies are even


def smaller(source: FrameSource, divisor: int) -> FrameSource:
    """Return a source whose frames are reduced by averaging squares of pixels (see `reduced`).

    Args:
        source: The footage.
        divisor: The side of the squares in pixels. Frames have the footage's width and height divided by it, rounded
            up. 1: return `source` itself.
    """
    if divisor == 1:
        return source
    made = SourceWrapper(source, lambda index: reduced(source.read(index), divisor, source.alpha))
    made.width, made.height = (reduced_size(length, divisor) for length in (source.width, source.height))
    return made


def reduced_size(length: int, divisor: int) -> int:
    """Return the length in pixels of a picture's side after it was reduced by a factor, rounded up."""
    return -(-length // divisor)


def reduced(frame: np.ndarray, divisor: int, alpha: str) -> np.ndarray:
    """Return a frame, in its own dtype, reduced by averaging squares of pixels.

    The result is (⌈height / divisor⌉, ⌈width / divisor⌉, 4). Squares that extend beyond the right or bottom edge repeat
    the pixels there.

    Args:
        frame: The frame, (height, width, 4).
        divisor: The side of the squares in pixels. 1: return `frame` itself.
        alpha: The frame's alpha mode, as in FrameSource. Straight colors are averaged with alpha as the weight.
    """
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
    """A source whose frames come from a proxy of Blender's sequencer, converted to the size and samples of the footage.

    Frames that are missing or damaged in the proxy come from the footage itself.
    """

    from_proxy = True

    def __init__(self, source: FrameSource, proxy: FrameSource) -> None:
        """Prepare to read a proxy (a small copy of the footage) in place of a source.

        Args:
            source: The footage.
            proxy: The proxy, which fits (see `fits`).
        """
        super().__init__(source)
        self._proxy = proxy
        source.close()  # a read opens it again

    def read(self, index: int) -> np.ndarray:
        """Return the proxy's frame, converted to the size and samples of the footage, (height, width, 4).

        If the proxy's frame is missing or damaged, return the footage's.

        Raises:
            MediaError: The footage cannot be read, either.
        """
        try:
            frame = self._proxy.read(index)
        except MediaError:
            return self._source.read(index)
        if frame.shape[:2] != (self.height, self.width):
            dtype = np.float32 if frame.dtype == np.float16 else frame.dtype  # OpenCV does not resize half floats
            size = self.width, self.height
            fitted = cv2.resize(frame.astype(dtype, copy=False), size, interpolation=cv2.INTER_AREA)
            frame = fitted.astype(frame.dtype, copy=False)
        if (self._proxy.dtype, self._proxy.transfer) == (self.dtype, self.transfer):
            return frame
        return self._samples[frame if frame.dtype == np.uint8 else frame.view(np.uint16)]

    @cached_property
    def _samples(self) -> np.ndarray:
        """A table that converts samples of the proxy (bytes, or half floats by their bits) to those of the footage."""
        is_byte = self._proxy.dtype == np.uint8
        levels = np.arange(256) / 255 if is_byte else np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(float)
        with np.errstate(invalid="ignore", over="ignore"):  # some half floats are NaN
            if self._proxy.transfer != self.transfer:
                levels = to_linear(levels)
            if self.dtype.kind == "u":
                levels = np.rint(np.nan_to_num(levels).clip(0, 1) * np.iinfo(self.dtype).max)
            return levels.astype(self.dtype)

    def close(self) -> None:
        self._proxy.close()
        self._source.close()


def fits(proxy: FrameSource, source: FrameSource) -> bool:
    """Return whether a proxy can replace footage, which it must do frame by frame.

    It has to have the same number of frames, the same aspect within STRETCHED, and no alpha, like the footage. It must
    have samples that can be converted (uint8 or float16, as the sRGB EXRs that Blender names .jpg for float footage),
    or have the footage's dtype and transfer. If its size differs from the footage's, OpenCV must be there.

    Args:
        proxy: The opened proxy.
        source: The footage.
    """
    stretched = proxy.width * source.height / (proxy.height * source.width)
    return (
        proxy.count == source.count
        and (cv2 is not None or (proxy.width, proxy.height) == (source.width, source.height))
        and abs(stretched - 1) < STRETCHED
        and proxy.alpha == source.alpha == "opaque"
        and (proxy.dtype in (np.uint8, np.float16) or (proxy.dtype, proxy.transfer) == (source.dtype, source.transfer))
    )
