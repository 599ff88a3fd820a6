"""Frames as they are quickest to have: of movies luma and subsampled chroma, and the RGB that libswscale makes of them,
to the bit; of a moment between two filmed frames the two, and where what they show lies in between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

STEP = 4  # pixels between two vectors of a moment
UNIT = 32  # of a vector's coordinates, in a pixel
ZERO = 1 << 15  # what a coordinate of 0 is stored as

# Of the matrices, by the numbers of ITU-T H.273: red of Cr, blue of Cb, green of Cb and of Cr, which is taken away; in
# libswscale's units of 1/65536 for samples of limited range. Where a file names none, it is BT.601.
_BT601 = 104597, 132201, 25675, 53279
_MATRICES = {1: (117489, 138438, 13975, 34925), 2: _BT601, 5: _BT601, 6: _BT601}


@dataclass(frozen=True)
class Matrix:
    """Whole numbers by which samples become RGB. offset: of luma, in 1/512 of a level; the others are factors."""

    offset: int
    luma: int
    red_of_cr: int
    green_of_cb: int
    green_of_cr: int
    blue_of_cb: int


def matrix(space: int, full: bool) -> Matrix | None:
    """That of a colour space, by its number in ITU-T H.273; None: another than BT.601 or BT.709.

    full: samples are of full range"""
    if space not in _MATRICES:
        return None
    red, blue, *green = _MATRICES[space]
    factors = [red, -green[0], -green[1], blue]
    if full:
        factors = [int(factor * 224 / 255) for factor in factors]
    offset, luma = (0, 1 << 13) if full else (16 << 9, _rounded((255 << 16) // 219))
    return Matrix(offset, luma, *map(_rounded, factors))


def _rounded(factor: int) -> int:
    """In units of 1/8192, of which libswscale keeps no finer ones."""
    return (factor + 4) >> 3


def chroma_step(length: int) -> int:
    """By how much a pixel's place in the planes of chroma moves on from one to the next, in 1/65536 of a sample, where
    so many pixels lie along an axis: pixel i has the sample (i · step + step // 2) >> 16."""
    return (((length + 1) // 2 << 16) + length // 2) // length


@dataclass(frozen=True)
class Planes:
    """An opaque 8-bit frame with a sample of chroma for 2 × 2 pixels.

    luma: uint8 (H, W), top row first
    chroma: Cb and Cr, each uint8 (⌈H/2⌉, ⌈W/2⌉)
    matrix: what makes RGB of them
    rgba: makes the whole frame, as FrameSource.read gives it
    """

    luma: np.ndarray
    chroma: tuple[np.ndarray, np.ndarray]
    matrix: Matrix
    rgba: Callable[[], np.ndarray]

    @property
    def nbytes(self) -> int:
        return sum(plane.nbytes for plane in (self.luma, *self.chroma))

    def samples(self, rows: slice, columns: slice) -> np.ndarray:
        """RGB uint8 (h, w, 3) of the pixels in these rows and columns: those of the frame of `rgba`, and nothing else
        is converted."""
        m, shape = self.matrix, self.luma.shape
        down, right = _chroma_places(rows, shape[0]), _chroma_places(columns, shape[1])
        luma = self.luma[rows, columns].astype(np.int32)
        luma *= m.luma << 9
        luma += (1 << 21) - m.offset * m.luma
        cb, cr = (plane[down][:, right].astype(np.int32) for plane in self.chroma)
        for plane in (cb, cr):
            plane -= 128
            plane <<= 9
        pixels = np.empty((len(luma), 3, luma.shape[1]), np.uint8)
        # Sums wrap around beyond 32 bits, as libswscale's do.
        colours = cr * m.red_of_cr, cb * m.green_of_cb + cr * m.green_of_cr, cb * m.blue_of_cb
        for channel, chroma in enumerate(colours):
            chroma += luma
            pixels[:, channel] = chroma.clip(0, (1 << 30) - 1, out=chroma) >> 22
        return np.moveaxis(pixels, 1, -1)


def _chroma_places(chosen: slice, length: int) -> np.ndarray:
    """The samples of chroma that pixels have, of so many along an axis."""
    step = chroma_step(length)
    return (np.arange(length)[chosen] * step + step // 2) >> 16


@dataclass(frozen=True)
class Moment:
    """A moment between two frames.

    Attributes:
        pair: numbers of the two frames among filmed ones: neighbours, but where those between repeat the first
        ends: the two frames (H, W, 4), of a FrameSource's type
        number, steps: how many of so many moments after the first frame it is
        vectors: uint16 (⌈H / STEP⌉, ⌈W / STEP⌉, 4). For every STEPth pixel: x and y of the way from the first frame to
            the second that passes there, in 1 / UNIT of a pixel from ZERO; and how surely the first and the second show
            what goes it, 0 to 255. Between these pixels they are bilinear.
        rgba: makes the frame, as FrameSource.read gives it
    """

    pair: tuple[int, int]
    ends: tuple[np.ndarray, np.ndarray]
    number: int
    steps: int
    vectors: np.ndarray
    rgba: Callable[[], np.ndarray]

    @property
    def nbytes(self) -> int:
        """Bytes that it takes; its frames are shared by all moments of the pair."""
        return self.vectors.nbytes + sum(end.nbytes for end in self.ends) // self.steps


Decoded: TypeAlias = np.ndarray | Planes | Moment  # what FrameSource.decoded gives


def as_rgba(frame: Decoded) -> np.ndarray:
    """A frame of FrameSource.decoded as its `read` gives it."""
    return frame if isinstance(frame, np.ndarray) else frame.rgba()
