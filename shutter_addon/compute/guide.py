"""Guides of edge-aware diffusion: the shown frame as conductances are made of it (core.conductances).

A guide is a frame's display values, without its finest detail: at a larger size an edge is as many times wider, and
its differences are taken over as many times more pixels, so that conductances are those of a picture of ROWS rows.

It is steadied: where the frames beside the shown one differ little from it, it is their mean. Noise that comes and
goes in a still picture would else make coefficients flicker. What moves differs more, and stays as it is shown.

All is counted in 16-bit integers, or exact in a float: guides have the same bits on every machine.
"""

from __future__ import annotations

import numpy as np

from ..core import light
from ..core.frame_source import FrameSource
from ..core.messages import EffectError

# Rows of the picture whose pixels are smoothed over about one, by a Gaussian of so many pixels.
ROWS = 240
BLUR = 1.0
# The fewest rows that a frame is reduced to before it is smoothed: what is between them is gone afterwards anyway.
REDUCED = 360
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


class Guides:
    """Guides of one source's frames. Its frames are read and reduced once, as long as they are kept."""

    def __init__(self, source: FrameSource):
        self._source = source
        self._short = min(source.width, source.height)
        self._cell = 1 << max(self._short // REDUCED, 1).bit_length() - 1  # pixels along a side of a reduced one
        self._kept = frozenset()
        self._reduced: dict[int, np.ndarray] = {}
        self._made = None

    def keep(self, indices) -> None:
        """Says which frames may be needed from now on; all others are forgotten."""
        self._kept = frozenset(indices)
        self._reduced = {i: picture for i, picture in self._reduced.items() if i in self._kept}
        if not self._kept:
            self._made = None

    def note(self, index: int, frame: np.ndarray) -> None:
        """A frame that was read for something else."""
        if index in self._kept and index not in self._reduced:
            self._reduced[index] = self._reduce(frame)

    def lacking(self, frames: tuple[int, ...]) -> set[int]:
        """Those of the frames that `guide` would read."""
        return set(frames).difference(self._reduced)

    def guide(self, frames: tuple[int, ...], block: int) -> np.ndarray:
        """The guide (h, w, 3) float32 of the frame that comes first in `guiding`, a pixel for each block × block of its
        pixels: 0 to 1, times the rows of such pixels over ROWS.

        EffectError: OpenCV is missing."""
        key = frames, block
        if self._made is None or self._made[0] != key:
            for index in sorted(self.lacking(frames)):
                self._reduced[index] = self._reduce(self._source.read(index))
            shown, *beside = (self._reduced[index] for index in frames)
            self._made = key, self._on_blocks(_opencv().merge(_steadied(shown, beside)), block)
        return self._made[1]

    def _reduce(self, frame: np.ndarray) -> np.ndarray:
        """A frame's display values (3, h, w) uint16 in cells, smoothed."""
        cv2 = _opencv()
        small = cv2.cvtColor(_averaged(_prepared(frame, self._source.alpha), self._cell), cv2.COLOR_RGBA2RGB)
        white = np.iinfo(small.dtype).max if small.dtype.kind == "u" else 1
        if self._source.transfer == "linear":
            small, white = light.to_encoded(small / np.float32(white)), 1
        codes = np.rint(small * np.float32(_WHITE / white)).astype(np.uint16)
        sigma = BLUR * self._short / (ROWS * self._cell)
        smooth = cv2.GaussianBlur(codes, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE)
        return np.ascontiguousarray(np.moveaxis(smooth, -1, 0))

    def _on_blocks(self, picture: np.ndarray, block: int) -> np.ndarray:
        cv2 = _opencv()
        width, height = -(-self._source.width // block), -(-self._source.height // block)
        if block > self._cell:
            picture = _averaged(picture, block // self._cell)
        elif block < self._cell:
            # Weights are multiples of 1 / (2 · scale), and so are exact in a float.
            scale = self._cell // block
            picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR)[:height, :width]
        return picture * np.float32(self._short / (block * ROWS * _WHITE))


class NotedSource:
    """A source whose frames `guides` gets to see as they are read."""

    def __init__(self, source: FrameSource, guides: Guides):
        self._source, self._guides = source, guides

    def __getattr__(self, name: str):
        return getattr(self._source, name)

    def read(self, index: int) -> np.ndarray:
        frame = self._source.read(index)
        self._guides.note(index, frame)
        return frame


def _prepared(frame: np.ndarray, alpha: str) -> np.ndarray:
    """A frame over black, as it is shown; of floats what is between 0 and 1."""
    if frame.dtype.kind == "f":
        frame = np.nan_to_num(frame.astype(np.float32), copy=False).clip(0, 1)
    if alpha != "straight":
        return frame
    white = np.float32(np.iinfo(frame.dtype).max if frame.dtype.kind == "u" else 1)
    return light.premultiplied(frame.astype(np.float32) / white)


def _averaged(picture: np.ndarray, size: int) -> np.ndarray:
    """Means over squares of size × size pixels; at the right and at the bottom, the last pixel goes on."""
    if size == 1:
        return picture
    cv2 = _opencv()
    height, width = picture.shape[:2]
    down, right = -height % size, -width % size
    if down or right:
        picture = cv2.copyMakeBorder(picture, 0, down, 0, right, cv2.BORDER_REPLICATE)
    whole = picture.shape[1] // size, picture.shape[0] // size
    return cv2.resize(picture, whole, interpolation=cv2.INTER_AREA)


def _steadied(shown: np.ndarray, beside: list[np.ndarray]) -> np.ndarray:
    """The mean (3, h, w) float32, in whole numbers, of pictures uint16 where they are like `shown`."""
    total, weights = shown.astype(np.float32), np.ones(shown.shape[1:], np.float32)
    for other in beside:
        largest = _opencv().absdiff(other, shown).max(axis=0)
        share = largest * np.float32(1 / (ALIKE * _WHITE))
        weight = np.maximum(1 - share * share, 0) ** 2  # Tukey's biweight
        weights += weight
        for plane, other_plane in zip(total, other, strict=True):
            plane += weight * other_plane
    return np.rint(total / weights)


def _opencv():
    try:
        import cv2
    except ImportError as error:  # a package without wheels
        raise EffectError(
            f"Follow Edges needs the Python package opencv-contrib-python-headless ({error}); "
            "install the zip of Virtual Shutter that is made for your system"
        ) from None
    return cv2
