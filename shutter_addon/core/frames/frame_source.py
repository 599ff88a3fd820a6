"""The interface of all sources of frames, and the forms of a frame: pixels, planes of luma and chroma, or a moment.

A moment lies between two filmed frames. RGB made from planes equals that of libswscale, which Blender uses, to the bit.
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
    """The whole numbers with which 8-bit samples of luma and chroma are converted to RGB, as in libswscale.

    Factors are in units of 1/8192.

    Attributes:
        offset: What is subtracted from luma, in 1/512 of a level.
        luma: The factor of luma for all three colors.
        red_of_cr, green_of_cb, green_of_cr, blue_of_cb: The factors of chroma (less 128), which are added.
    """

    offset: int
    luma: int
    red_of_cr: int
    green_of_cb: int
    green_of_cr: int
    blue_of_cb: int


def matrix(space: int, full: bool) -> Matrix | None:
    """Return the conversion from samples to RGB for a color space, or None if that is neither BT.601 nor BT.709.

    Args:
        space: Its matrix coefficients as a number of ITU-T H.273; 2: unspecified, which counts as BT.601.
        full: Whether samples have the full range 0 … 255 instead of 16 … 235.
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
    """Round a factor in units of 1/65536 to units of 1/8192, as libswscale does."""
    return (factor + 4) >> 3


def chroma_step(length: int) -> int:
    """Return the distance of neighboring pixels in a chroma plane of half the size, in 1/65536 of a chroma sample.

    Pixel i has the chroma sample (i · step + step // 2) >> 16.

    Args:
        length: The pixels along the axis, which has ⌈length / 2⌉ samples of chroma.
    """
    return (((length + 1) // 2 << 16) + length // 2) // length


@dataclass(frozen=True)
class Planes:
    """An opaque 8-bit frame as a decoder gives it, with one sample of chroma for 2 × 2 pixels. GPUs convert it to RGB.

    Attributes:
        luma: uint8 (H, W), top row first.
        chroma: Cb and Cr, uint8 (⌈H/2⌉, ⌈W/2⌉) each.
        matrix: How they are converted to RGB.
        rgba: Returns the converted frame, as FrameSource.read does.
    """

    luma: np.ndarray
    chroma: tuple[np.ndarray, np.ndarray]
    matrix: Matrix
    rgba: Callable[[], np.ndarray]

    @property
    def nbytes(self) -> int:
        """The bytes that its samples take."""
        return sum(plane.nbytes for plane in (self.luma, *self.chroma))

    def samples(self, rows: slice, columns: slice) -> np.ndarray:
        """Return the RGB values uint8 (h, w, 3) of some rows and columns, without a conversion of the others."""
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
    """Return which chroma sample belongs to each chosen pixel, as indices, on an axis of `length` pixels."""
    step = chroma_step(length)
    return (np.arange(length)[chosen] * step + step // 2) >> 16


class Pair(Protocol):
    """Makes the moments between two frames, by their optical flow (media/flow.py has the only implementation)."""

    def with_ends(self, first: np.ndarray, second: np.ndarray) -> Pair:
        """Return a copy that makes moments between two other frames (H, W, 4), by the same optical flow."""

    def moment(self, pair: tuple[int, int], number: int, steps: int) -> np.ndarray | Moment:
        """Return a moment, a frame between the two in time, or the nearer one (H, W, 4) if they have nothing in common.

        Args:
            pair: The numbers of the frames, for Moment.pair.
            number: Which moment, 1 to steps − 1.
            steps: Into how many steps the time between the frames is divided.
        """

    def rgba(self, moment: Moment) -> np.ndarray:
        """Make the frame (H, W, 4) of a moment, as FrameSource.read gives it."""

    def values(self, moment: Moment, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return values of pixels, such as a matte's, at a moment: float32 (H, W), moved by the frames' optical flow.

        Args:
            moment: The moment.
            first, second: The values (H, W) in the first and the second frame.
        """


@dataclass(frozen=True)
class Moment:
    """What a frame at a time between two filmed frames is made from. A GPU or `rgba` makes it.

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
        """Make the frame (H, W, 4), as FrameSource.read gives it."""
        return self.between.rgba(self)

    @property
    def nbytes(self) -> int:
        """The bytes of memory that this moment takes: its part of what all moments of the pair share."""
        return (self.vectors.nbytes + sum(end.nbytes for end in self.ends)) // self.steps


Decoded: TypeAlias = np.ndarray | Planes | Moment  # results of FrameSource.decoded


def as_rgba(frame: Decoded) -> np.ndarray:
    """Convert a result of FrameSource.decoded to that of `read`: an array (H, W, 4), RGBA."""
    return frame if isinstance(frame, np.ndarray) else frame.rgba()


class ShotFinder(Protocol):
    """Finds the cuts of a source (media/cuts.py). Frames are numbered from 0.

    It may read frames. It keeps them until the source's `read` asks for them, so that no frame is decoded twice.
    """

    def around(self, index: int, low: int, high: int, *, known: bool = False) -> range:
        """Return the frames of the shot to which a frame belongs: those between the cuts around it.

        Args:
            index: The frame.
            low, high: The first and last frame that matter. Cuts beyond are not searched: the range then goes to the
                clip's start or end.
            known: Read nothing, and assume that there is no cut where nothing is known.
        """

    def lacking(self, index: int, low: int, high: int) -> set[int]:
        """Return the frames that `around` would have to read for the same arguments, if it finds no new cuts."""

    def handed(self) -> set[int]:
        """Return the frames that were read to find cuts, and are kept for `FrameSource.read`."""

    def release(self) -> None:
        """Drop the frames that were read to find cuts and are kept for `FrameSource.read`."""


class FrameSource(ABC):
    """The frames of a movie or an image sequence. Close it, or use it in a `with`.

    Attributes:
        path: The movie, or the first file of the sequence.
        file_kind: Format, codec and samples of the file, as the libraries name them.
        files: The movie, or the file of each frame.
        width, height: In pixels.
        count: The number of frames, as Blender's strip counts them (content_duration).
        fps: Frames per second; None for an image sequence.
        dtype: The type of samples: uint8, uint16, float16 or float32; the range of integers stands for 0 … 1.
        transfer: "srgb" (sRGB display values) or "linear" (scene linear, Rec.709 primaries).
        alpha: "opaque", "straight" or "premultiplied".
        options: What samples depend on besides the files, {name: plain value}.
        has_audio: Whether the file has sound.
        left_out: A sentence for the user about files beside the sequence that do not belong to it, or "".
        step: Every step-th frame was filmed, from the first on; the others are moments between them.
        shots: What finds its cuts; None: it has none.
        from_proxy: Whether frames come from a proxy where it has them.
        by_blender: Whether a second Blender decodes them because PyAV is missing.
        repeats: Whether repeated frames were found and replaced by moments.
        windows: How many windows of one picture read this source, each of which needs memory for it.
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
        """Return a frame in the form that is fastest to get, which may be planes or a moment, or as `read` does.

        Raises:
            MediaError, IndexError: As for `read`.
        """
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
    """The name of a source of frames, such as a matte file, which can be opened. Equal ones give the same frames.

    Frames of a matte are values (height, width) float32, 0 to 1, and `read` takes any index: it clamps the index to the
    file's frames.
    """

    def open(self) -> FrameSource:
        """Open the source.

        Raises:
            MediaError: It cannot be read.
        """


class _Forwarded:
    """A descriptor of SourceWrapper: it returns the wrapped source's attribute, unless the wrapper has set its own."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, wrapper: SourceWrapper | None, _owner: type | None = None) -> object:
        return self if wrapper is None else getattr(wrapper._source, self._name)


class SourceWrapper(FrameSource):
    """A source around another one, with its attributes and frames unless a subclass or a function changes them."""

    def __init__(self, source: FrameSource, frames: Callable[[int], Decoded] | None = None) -> None:
        """Wrap a source.

        Args:
            source: The other source.
            frames: Returns the frame of an index; `read` and `decoded` then use it. None: both return what the source's
                `read` returns.
        """
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
