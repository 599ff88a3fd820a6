"""Guides of edge-aware diffusion: the shown frame as resistances are made of it (core.pixels.conductances).

A guide is a frame's display values on cells of 1, 2, 4 … pixels, without its finest detail. Its differences are scaled
to those of a picture of ROWS rows (or columns, where it is upright).

It is steadied: where the frames beside the shown one differ little from it, it is their mean. Noise that comes and
goes in a still picture would else make coefficients flicker. What moves differs more, and stays as it is shown.
"""

from collections.abc import Iterable

import numpy as np

from ..core.frames import light
from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.frames.planes import Decoded, as_rgba
from ..core.memo import Memo
from ..core.messages import UserError
from ..core.pixels.matte_grid import block_sums, blurred

# Rows of the picture whose pixels are smoothed over about one, by a Gaussian of so many pixels.
ROWS = 240
BLUR = 1.0
# The fewest rows that a frame is reduced to before it is smoothed: what is between them is gone afterwards anyway.
REDUCED = 240
# Filmed frames on each side that steady the shown one, and the difference, of 1, from which on one counts nothing.
BESIDE = 2
ALIKE = 0.04
_WHITE = 65535


def guiding(index: int, step: int, shot: range) -> tuple[int, ...]:
    """The frames that the guide of frame `index` is made of: that one, and the filmed ones beside it in its shot.

    step: every step-th frame is one that was filmed"""
    near = range(max(index - reach(step), shot.start), min(index + reach(step) + 1, shot.stop))
    return index, *(i for i in near if i % step == 0 and i != index)


def reach(step: int) -> int:
    """How far those frames lie from the shown one at most."""
    return BESIDE * step


def cell_of(short: int) -> int:
    """How many pixels a guide's cells are wide and high, where the picture's shorter side has so many."""
    return 1 << max(short // REDUCED, 1).bit_length() - 1


class Guides:
    """Guides of one source's frames. Its frames are read and reduced once, as long as they are kept."""

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._short = min(source.width, source.height)
        self._cell = cell_of(self._short)
        self._kept: frozenset[int] = frozenset()
        self._reduced: dict[int, np.ndarray] = {}
        self._made: Memo[np.ndarray] = Memo()

    def keep(self, indices: Iterable[int]) -> None:
        """Says which frames may be needed from now on; all others are forgotten."""
        self._kept = frozenset(indices)
        self._reduced = {i: picture for i, picture in self._reduced.items() if i in self._kept}
        if not self._kept:
            self._made.clear()

    def wants(self, index: int) -> bool:
        """Whether a frame is to be noted."""
        return index in self._kept and index not in self._reduced

    def note(self, index: int, frame: np.ndarray) -> None:
        """A frame that was read for something else."""
        if self.wants(index):
            self._reduced[index] = self._reduce(frame)

    def lacking(self, frames: tuple[int, ...]) -> set[int]:
        """Those of the frames that `guide` would read."""
        return set(frames).difference(self._reduced)

    def guide(self, frames: tuple[int, ...], block: int) -> np.ndarray:
        """The guide (h, w, 3) float32 of the frame that comes first in `guiding`: 0 to 1, times the rows of its cells
        over ROWS. Its cells are blocks of pixels, or larger where a large frame has no finer detail. Frames beside it
        that cannot be read are left out."""
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
        """A frame's display values (3, h, w) uint16 in cells, smoothed."""
        colours = _averaged(light.over_black(frame, self._source.alpha), self._cell)
        if self._source.transfer == "linear":
            colours = light.to_encoded(colours)
        # What averaging and interpolation smooth by themselves: variances of 1/12 and 1/6 of a cell.
        variance = (BLUR * self._short / (ROWS * self._cell)) ** 2 - (1 - 1 / self._cell**2) / 4
        kernel = _gaussian(variance**0.5)
        smooth = np.stack([blurred(np.ascontiguousarray(plane), kernel) for plane in np.moveaxis(colours, -1, 0)])
        return np.rint(smooth * np.float32(_WHITE)).astype(np.uint16)


class NotedSource(SourceWrapper):
    """A source whose frames `guides` gets to see as they are read."""

    def __init__(self, source: FrameSource, guides: Guides) -> None:
        super().__init__(source)
        self._guides = guides

    def read(self, index: int) -> np.ndarray:
        frame = self._source.read(index)
        self._guides.note(index, frame)
        return frame

    def decoded(self, index: int) -> Decoded:
        # As it is decoded in any case: colours that are sent as such may differ by rounding.
        frame = self._source.decoded(index)
        if self._guides.wants(index):
            self._guides.note(index, as_rgba(frame))
        return frame


def _averaged(picture: np.ndarray, size: int) -> np.ndarray:
    """Means (h, w, 3), 0 to 1, over squares of size × size pixels; at the right and the bottom, the last pixel goes
    on."""
    whole = picture.dtype.kind == "u"
    unit = np.float32(size * size * (np.iinfo(picture.dtype).max if whole else 1))
    if size > 1:
        picture = block_sums(picture, size, np.uint32 if whole else np.float32)
    return picture[..., :3] / unit


def _gaussian(sigma: float) -> np.ndarray:
    """Weights of a pixel and of those at distances 1, 2, …"""
    weights = np.exp(-0.5 * (np.arange(round(3 * sigma) + 1) / sigma) ** 2)
    return (weights / (2 * weights.sum() - weights[0])).astype(np.float32)


def _steadied(shown: np.ndarray, beside: list[np.ndarray]) -> np.ndarray:
    """The mean (3, h, w) float32 of pictures uint16 where they are like `shown`."""
    total, weights = shown.astype(np.float32), np.ones(shown.shape[1:], np.float32)
    for other in beside:
        apart = (np.maximum(other, shown) - np.minimum(other, shown)).max(axis=0)
        share = apart * np.float32(1 / (ALIKE * _WHITE))
        weight = np.maximum(1 - share * share, 0) ** 2  # Tukey's biweight
        weights += weight
        for plane, other_plane in zip(total, other, strict=True):
            plane += weight * other_plane
    return total / weights
