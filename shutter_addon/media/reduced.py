"""Frames at a half or a quarter of their width and height, for previews."""

import numpy as np
from numpy.typing import DTypeLike

from ..core.frames.frame_source import FrameSource
from ..core.frames.source_wrapper import SourceWrapper

DIVISORS = 1, 2, 4


class ReducedSource(SourceWrapper):
    """A source whose frames are the other's, `divisor` times smaller each way; a last pixel stands for what is left."""

    def __init__(self, source: FrameSource, divisor: int) -> None:
        super().__init__(source)
        self._divisor = divisor
        self.width, self.height = (reduced_size(length, divisor) for length in (source.width, source.height))

    def read(self, index: int) -> np.ndarray:
        """The frame (height, width, 4), of new memory."""
        return reduced(self._source.read(index), self._divisor, self.alpha)


def smaller(source: FrameSource, divisor: int) -> FrameSource:
    """The source, that many times smaller each way."""
    return source if divisor == 1 else ReducedSource(source, divisor)


def reduced_size(length: int, divisor: int) -> int:
    """How many pixels stand for so many."""
    return -(-length // divisor)


def reduced(frame: np.ndarray, divisor: int, alpha: str) -> np.ndarray:
    """The means over squares of a frame (height, width, 4), of the same type; at the right and the bottom the last
    pixel goes on. alpha: a FrameSource's; straight colours count by their cover."""
    if divisor == 1:
        return frame
    down, right = (-length % divisor for length in frame.shape[:2])
    if down or right:
        frame = np.pad(frame, ((0, down), (0, right), (0, 0)), mode="edge")
    whole = frame.dtype.kind == "u"
    if alpha == "straight":
        colours = frame.astype(np.float32)
        colours[..., :3] *= colours[..., 3:]
        means = _sums(colours, divisor, np.float32) / divisor**2
        np.divide(means[..., :3], means[..., 3:], out=means[..., :3], where=means[..., 3:] > 0)
    elif whole:
        sums = _sums(frame, divisor, np.uint16 if frame.dtype == np.uint8 else np.uint32)
        return ((sums + sums.dtype.type(divisor**2 // 2)) // sums.dtype.type(divisor**2)).astype(frame.dtype)
    else:
        means = _sums(frame, divisor, np.float32) / divisor**2
    return (np.rint(means) if whole else means).astype(frame.dtype)


def _sums(frame: np.ndarray, divisor: int, dtype: DTypeLike) -> np.ndarray:
    """The sums over squares of a frame whose sides they divide."""
    height, width, channels = frame.shape
    squares = frame.reshape(height // divisor, divisor, width // divisor, divisor, channels)
    sums = np.zeros((height // divisor, width // divisor, channels), dtype)
    for row in range(divisor):
        for column in range(divisor):
            sums += squares[:, row, :, column]
    return sums
