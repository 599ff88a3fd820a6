"""The interface of every source of frames, and the forms of a frame: pixels, planes of luma and chroma, moments.

RGB of planes equals libswscale's to the bit.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Protocol, Self, TypeAlias

import numpy as np

STEP = 4  # pixels between two vectors of a moment
UNIT = 32  # units of a vector's coordinates per pixel
TILE = 8, 16  # pixels across and down that share how many moments are looked up
ZERO = 1 << 15  # stored value of the coordinate 0

# By number in ITU-T H.273: red of Cr, blue of Cb, and what is subtracted from green for Cb and Cr, in libswscale's
# units of 1/65536 for samples of limited range. Files that name no matrix use BT.601.
_BT601 = 104597, 132201, 25675, 53279
_MATRICES = {1: (117489, 138438, 13975, 34925), 2: _BT601, 5: _BT601, 6: _BT601}


@dataclass(frozen=True)
class Matrix:
    """Integers that convert samples to RGB: luma's offset in 1/512 of a level, and factors."""

    offset: int
    luma: int
    red_of_cr: int
    green_of_cb: int
    green_of_cr: int
    blue_of_cb: int


def matrix(space: int, full: bool) -> Matrix | None:
    """Return the matrix of a colour space by its number in ITU-T H.273; None: neither BT.601 nor BT.709.

    Args:
        full: Whether samples have full range.
    """
    if space not in _MATRICES:
        return None
    red, blue, *green = _MATRICES[space]
    factors = [red, -green[0], -green[1], blue]
    if full:
        factors = [int(factor * 224 / 255) for factor in factors]
    offset, luma = (0, 1 << 13) if full else (16 << 9, _rounded((255 << 16) // 219))
    return Matrix(offset, luma, *map(_rounded, factors))


def _rounded(factor: int) -> int:
    """Round to units of 1/8192, as libswscale does."""
    return (factor + 4) >> 3


def chroma_step(length: int) -> int:
    """Return the step between pixels in the chroma planes, in 1/65536 of a sample, for an axis of `length` pixels.

    Pixel i has the sample (i · step + step // 2) >> 16.
    """
    return (((length + 1) // 2 << 16) + length // 2) // length


@dataclass(frozen=True)
class Planes:
    """An opaque 8-bit frame with one sample of chroma per 2 × 2 pixels.

    Attributes:
        luma: uint8 (H, W), top row first.
        chroma: Cb and Cr, uint8 (⌈H/2⌉, ⌈W/2⌉) each.
        matrix: Converts them to RGB.
        rgba: Returns the whole frame, like FrameSource.read.
    """

    luma: np.ndarray
    chroma: tuple[np.ndarray, np.ndarray]
    matrix: Matrix
    rgba: Callable[[], np.ndarray]

    @property
    def nbytes(self) -> int:
        return sum(plane.nbytes for plane in (self.luma, *self.chroma))

    def samples(self, rows: slice, columns: slice) -> np.ndarray:
        """Return RGB uint8 (h, w, 3) of some rows and columns, without converting others."""
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
        # Sums wrap around at 32 bits, as libswscale's do.
        colours = cr * m.red_of_cr, cb * m.green_of_cb + cr * m.green_of_cr, cb * m.blue_of_cb
        for channel, chroma in enumerate(colours):
            chroma += luma
            pixels[:, channel] = chroma.clip(0, (1 << 30) - 1, out=chroma) >> 22
        return np.moveaxis(pixels, 1, -1)


def _chroma_places(chosen: slice, length: int) -> np.ndarray:
    """Return the indices of the chroma samples of pixels on an axis of `length` pixels."""
    step = chroma_step(length)
    return (np.arange(length)[chosen] * step + step // 2) >> 16


class Pair(Protocol):
    """What lies between two frames."""

    def with_ends(self, first: np.ndarray, second: np.ndarray) -> Pair:
        """Return what lies between two other frames (H, W, 4) that move alike."""

    def moment(self, pair: tuple[int, int], number: int, steps: int) -> np.ndarray | Moment:
        """Return a Moment, or the nearer frame if the two have nothing in common."""

    def rgba(self, moment: Moment) -> np.ndarray:
        """Make the frame of a moment, as FrameSource.read gives it."""

    def values(self, moment: Moment, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return values (H, W) at a moment, given those of both frames, float32, which move like the frames."""


@dataclass(frozen=True)
class Moment:
    """A moment between two frames.

    Both frames are looked up along paths at key moments, equally far apart in time; other moments are mixes of the two
    key moments around them, in linear light. A part of the picture that moves less has fewer key moments.

    Attributes:
        pair: Numbers of the two frames among filmed ones: neighbours, unless those between repeat the first.
        ends: The two frames (H, W, 4), of a FrameSource's type.
        number, steps: It lies number / steps of the way from the first frame to the second.
        vectors: uint16 (keys − 1, ⌈H / STEP⌉, ⌈W / STEP⌉, 4), shared by the moments of a pair; keys is a power of two.
            The key moment k, of 1 … keys − 1, has vectors[k − 1], for every STEPth pixel: x and y of the path from the
            first frame to the second that passes there, in 1 / UNIT of a pixel from ZERO; and how surely the first and
            the second frame show what follows it, 0 to 255. Between these pixels they are bilinear.
        levels: uint8, one for each tile of TILE pixels, shared by the pair: its key moments are keys / 2^level apart.
        between: What makes the moments of the pair.
    """

    pair: tuple[int, int]
    ends: tuple[np.ndarray, np.ndarray]
    number: int
    steps: int
    vectors: np.ndarray
    levels: np.ndarray
    between: Pair

    def rgba(self) -> np.ndarray:
        """Return the frame, as FrameSource.read gives it."""
        return self.between.rgba(self)

    @property
    def nbytes(self) -> int:
        """Bytes that it takes, of what all moments of the pair share."""
        return (self.vectors.nbytes + sum(end.nbytes for end in self.ends)) // self.steps


Decoded: TypeAlias = np.ndarray | Planes | Moment  # results of FrameSource.decoded


def as_rgba(frame: Decoded) -> np.ndarray:
    """Convert a result of FrameSource.decoded to that of `read`."""
    return frame if isinstance(frame, np.ndarray) else frame.rgba()


class ShotFinder(Protocol):
    """A finder of a source's cuts. It may read frames, which then wait for the source's `read`.

    Frames count from 0.
    """

    def around(self, index: int, low: int, high: int, *, known: bool = False) -> range:
        """Return the frames of the shot around frame `index`, for a window of the frames from `low` to `high`.

        Cuts beyond the window are not searched: the range then ends with the clip.

        Args:
            known: Read nothing, and assume no cut where it is unknown.
        """

    def lacking(self, index: int, low: int, high: int) -> set[int]:
        """Return the frames that `around` would read for these arguments, if it found no more cuts."""

    def handed(self) -> set[int]:
        """Return the frames that were read and wait for `read`."""

    def release(self) -> None:
        """Drop the frames that wait for `read`."""


class FrameSource(ABC):
    """The frames of a movie or an image sequence. Close it, or use it in a `with`.

    Attributes:
        path: The movie, or the first file of the sequence.
        file_kind: Format, codec and samples of the file, as the libraries name them.
        files: The movie, or one per frame.
        width, height: Pixels.
        count: Frames as Blender's strip counts them (content_duration).
        fps: Frames per second; None for an image sequence.
        dtype: uint8, uint16, float16 or float32; integers stand for 0 … 1.
        transfer: "srgb" (sRGB display values) or "linear" (scene linear, Rec.709 primaries).
        alpha: "opaque", "straight" or "premultiplied".
        options: What samples depend on besides the files, {name: plain value}.
        has_audio: Whether the file has sound.
        left_out: A sentence about files beside the sequence that do not belong to it, or "".
        step: Every step-th frame was filmed, from the first on.
        shots: The finder of cuts; None: there are none.
        from_proxy: Whether frames come from a proxy where it has them.
        by_blender: Whether a second Blender decodes them because PyAV is missing.
        repeats: Whether repeated frames were found and replaced by moments.
        windows: How many windows of a picture read the source, and need room in caches.
    """

    path: Path
    file_kind: str
    files: list[Path]
    width: int
    height: int
    count: int
    fps: Fraction | None
    dtype: np.dtype
    transfer: str
    alpha: str
    options: dict
    has_audio: bool = False
    left_out: str = ""
    step: int = 1
    shots: ShotFinder | None = None
    from_proxy: bool = False
    by_blender: bool = False
    repeats: bool = False
    windows: int = 1

    @abstractmethod
    def read(self, index: int) -> np.ndarray:
        """Return a frame as an array (height, width, 4), RGBA, top row first. Ascending order is fastest.

        Raises:
            MediaError: The frame cannot be decoded.
            IndexError: It is outside 0 … count − 1.
        """

    def decoded(self, index: int) -> Decoded:
        """Return a frame in its fastest form: planes if only their conversion is missing, else like `read`."""
        return self.read(index)

    def want(self, indices: Iterable[int]) -> None:
        """Announce which frames will be read next, in this order, so that they can be decoded early."""
        return  # optional

    def close(self) -> None:
        """Close the file; a later read reopens it."""
        return

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class SourceFile(Hashable, Protocol):
    """What opens a source; equal where it gives the same frames.

    Of a matte's, frames are values (height, width) float32, 0 to 1, and `read` clamps to the file's frames.
    """

    def open(self) -> FrameSource:
        """Open the source. MediaError: it cannot be read."""


class _Forwarded:
    """An attribute of the wrapped source, unless the wrapper sets its own."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, wrapper: SourceWrapper | None, _owner: type | None = None) -> object:
        return self if wrapper is None else getattr(wrapper._source, self._name)


class SourceWrapper(FrameSource):
    """A source around another one, with its attributes and frames unless a subclass changes them."""

    def __init__(self, source: FrameSource, frames: Callable[[int], Decoded] | None = None) -> None:
        """Wrap a source; `frames` replaces its `decoded`, and with it `read`."""
        self._source, self._frames_of = source, frames

    def read(self, index: int) -> np.ndarray:
        return as_rgba(self._frames_of(index)) if self._frames_of else self._source.read(index)

    def decoded(self, index: int) -> Decoded:
        return self._frames_of(index) if self._frames_of else self.read(index)  # it may differ from the source's

    def want(self, indices: Iterable[int]) -> None:
        self._source.want(indices)

    def close(self) -> None:
        self._source.close()


for _name in FrameSource.__annotations__:
    setattr(SourceWrapper, _name, _Forwarded(_name))
