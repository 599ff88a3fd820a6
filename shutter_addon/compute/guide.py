"""Guides of the diffusion: pictures at whose edges scribbles stop (*Follow Edges*; core.pixels.conductances).

A guide has the shown frame's display values in cells of 1, 2, 4 … pixels, without the finest detail. Its differences
are scaled to those of a picture of ROWS rows (or columns, if it is upright).

Where neighboring frames differ little, the guide is their mean. Otherwise noise would make coefficients flicker in a
still picture. Moving things differ more, and stay as in the shown frame.
"""

from collections.abc import Iterable

import numpy as np

from ..core.caches import LastValue
from ..core.frames import light
from ..core.frames.frame_source import Decoded, FrameSource, SourceWrapper, as_rgba
from ..core.messages import UserError
from ..core.pixels.matte_grid import block_sums, blurred

# Frames are blurred as if they had ROWS rows, by a Gaussian of BLUR pixels.
ROWS = 240
BLUR = 1.0
# The fewest rows to which a frame is reduced before it is blurred, which removes finer detail anyway.
REDUCED = 240
# Filmed frames on each side that are averaged, and the difference (of 1) from which on one has no weight.
BESIDE = 2
ALIKE = 0.04
_WHITE = 65535


def guiding(index: int, step: int, shot: range) -> tuple[int, ...]:
    """Return the source frames from whose mean the guide of a shown frame is made.

    The guide is the picture at whose edges scribbles stop.

    Args:
        index: The shown source frame, filmed or computed.
        step: Every step-th source frame was filmed; the others are computed between two filmed ones.
        shot: The source frames of the shown frame's shot. Frames outside it are left out.

    Returns:
        `index` first, then all other filmed frames at most BESIDE · step source frames away, in ascending order.
    """
    near = range(max(index - reach(step), shot.start), min(index + reach(step) + 1, shot.stop))
    return index, *(i for i in near if i % step == 0 and i != index)


def reach(step: int) -> int:
    """Return how far the frames of `guiding` are from the shown one at most, before or after it, in source frames.

    Args:
        step: Every step-th source frame was filmed.
    """
    return BESIDE * step


def cell_of(short: int) -> int:
    """Return the side in pixels of the squares, called cells, to which a frame is reduced for guides.

    It is the largest power of two that leaves at least REDUCED cells along the picture's shorter side, or else 1.

    Args:
        short: The picture's shorter side in pixels.
    """
    return 1 << max(short // REDUCED, 1).bit_length() - 1


class Guides:
    """Makes the guides of a source's frames: pictures at whose edges scribbles stop.

    Each source frame is read and reduced once. The reduced copy stays in memory until a call of `keep` leaves it out.
    """

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._short = min(source.width, source.height)
        self._cell = cell_of(self._short)
        self._kept: frozenset[int] = frozenset()
        self._reduced: dict[int, np.ndarray] = {}
        self._made: LastValue[np.ndarray] = LastValue()

    def keep(self, indices: Iterable[int]) -> None:
        """Set which source frames may be needed from now on, and forget all others."""
        self._kept = frozenset(indices)
        self._reduced = {i: picture for i, picture in self._reduced.items() if i in self._kept}
        if not self._kept:
            self._made.clear()

    def note(self, index: int, frame: Decoded) -> None:
        """Keep a reduced copy of a frame that was read for something else, if a guide will need it."""
        if index in self._kept and index not in self._reduced:
            self._reduced[index] = self._reduce(as_rgba(frame))

    def lacking(self, frames: tuple[int, ...]) -> set[int]:
        """Return those of the frames that `guide` would have to read."""
        return set(frames).difference(self._reduced)

    def guide(self, frames: tuple[int, ...], block: int) -> np.ndarray:
        """Return a guide, (h, w, 3) float32. The last one is cached.

        A cell of the guide is a square of pixels: a block, or a square of `cell_of` pixels a side if that is larger,
        since the guide has no finer detail. h and w are the picture's size in cells, rounded up. The values are display
        values, 0 … 1, times the number of cells along the picture's shorter side, over ROWS. So an edge has a similar
        slope per cell in pictures of all sizes.

        Args:
            frames: The source frames from `guiding`, the shown one first. Others that cannot be read are left out.
            block: The side in pixels of the blocks that share coefficients, a power of two.

        Raises:
            UserError: The shown frame cannot be read.
        """
        return self._made.get((frames, block), lambda: self._guide(frames, block))

    def _guide(self, frames: tuple[int, ...], block: int) -> np.ndarray:
        for index in sorted(self.lacking(frames)):
            try:
                self._reduced[index] = self._reduce(self._source.read(index))
            except UserError:
                if index == frames[0]:
                    raise
        shown, *beside = (self._reduced[index] for index in frames if index in self._reduced)
        made = _steadied(shown, beside) * np.float32(self._short / (max(block, self._cell) * ROWS * _WHITE))
        made = np.ascontiguousarray(np.moveaxis(made, 0, -1))
        return _averaged(made, max(block // self._cell, 1))

    def _reduce(self, frame: np.ndarray) -> np.ndarray:
        """Return a frame's display values (3, h, w) uint16 in cells, blurred."""
        colours = _averaged(light.over_black(frame, self._source.alpha), self._cell)
        if self._source.transfer == "linear":
            colours = light.to_encoded(colours)
        # Averaging and interpolation blur as well, with variances of 1/12 and 1/6 of a cell.
        variance = (BLUR * self._short / (ROWS * self._cell)) ** 2 - (1 - 1 / self._cell**2) / 4
        kernel = _gaussian(variance**0.5)
        smooth = np.stack([blurred(np.ascontiguousarray(plane), kernel) for plane in np.moveaxis(colours, -1, 0)])
        return np.rint(smooth * np.float32(_WHITE)).astype(np.uint16)


class NotedSource(SourceWrapper):
    """A wrapper of a source that passes each frame it returns to Guides, which then need not read that frame again."""

    def __init__(self, source: FrameSource, guides: Guides) -> None:
        super().__init__(source)
        self._guides = guides

    def read(self, index: int) -> np.ndarray:
        frame = self._source.read(index)
        self._guides.note(index, frame)
        return frame

    def decoded(self, index: int) -> Decoded:
        # Always as it is decoded: colors of `read` may be rounded differently.
        frame = self._source.decoded(index)
        self._guides.note(index, frame)
        return frame


def _averaged(picture: np.ndarray, size: int) -> np.ndarray:
    """Return the mean colors of squares of size × size pixels, (⌈H/size⌉, ⌈W/size⌉, 3).

    They are float32, but float64 for integers if `size` is above 1. Where a square reaches beyond the picture, the
    picture's last pixels are repeated.

    Args:
        picture: (H, W, 3 or 4); a fourth channel is ignored. Values of an integer type are divided by the type's
            maximum, so that the means are 0 … 1. Floats keep their scale.
        size: The side of a square in pixels.
    """
    whole = picture.dtype.kind == "u"
    unit = np.float32(size * size * (np.iinfo(picture.dtype).max if whole else 1))
    if size > 1:
        picture = block_sums(picture, size, np.uint32 if whole else np.float32)
    return picture[..., :3] / unit


def _gaussian(sigma: float) -> np.ndarray:
    """Return the weights of a Gaussian at distances 0, 1, 2, … cells; `sigma` is its standard deviation."""
    weights = np.exp(-0.5 * (np.arange(round(3 * sigma) + 1) / sigma) ** 2)
    return (weights / (2 * weights.sum() - weights[0])).astype(np.float32)


def _steadied(shown: np.ndarray, beside: list[np.ndarray]) -> np.ndarray:
    """Return a weighted mean of the shown frame and its neighbors, which removes noise: (3, h, w) float32, 0 … 65,535.

    The shown frame has weight 1. At each pixel, a neighbor's weight falls from 1, where it equals the shown frame, to
    0, where any channel differs by ALIKE of the full range or more. So things that move stay as in the shown frame.

    Args:
        shown: The reduced shown frame, (3, h, w) uint16.
        beside: The reduced neighboring frames, each of the same shape and type; may be empty.
    """
    total, weights = shown.astype(np.float32), np.ones(shown.shape[1:], np.float32)
    for other in beside:
        apart = (np.maximum(other, shown) - np.minimum(other, shown)).max(axis=0)
        share = apart * np.float32(1 / (ALIKE * _WHITE))
        weight = np.maximum(1 - share * share, 0) ** 2  # Tukey's biweight
        weights += weight
        for plane, other_plane in zip(total, other, strict=True):
            plane += weight * other_plane
    return total / weights
