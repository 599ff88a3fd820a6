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
    """The whole numbers with which 8-bit samples of luma and chroma are converted to 8-bit RGB, as in libswscale.

    Red is (Y − offset / 512) · luma + (Cr − 128) · red_of_cr, in 1/8192, rounded and clipped to 0 … 255. Blue is the
    same with Cb and blue_of_cb. Green has both chroma terms.

    Attributes:
        offset: The luma of black, times 512: 16 · 512 for samples of limited range, 0 for full range.
        luma: The factor of luma for all three colors, times 8192.
        red_of_cr, green_of_cb, green_of_cr, blue_of_cb: The factors of chroma, times 8192: what Cb − 128 or Cr − 128
            adds to a color. Those of green are negative.
    """

    offset: int
    luma: int
    red_of_cr: int
    green_of_cb: int
    green_of_cr: int
    blue_of_cb: int


def matrix(space: int, full: bool) -> Matrix | None:
    """Return the conversion from 8-bit luma and chroma to RGB for a color space.

    Args:
        space: The number of the matrix coefficients in ITU-T H.273, as files store it. 1: BT.709; 5 and 6: BT.601;
            2: unspecified, which counts as BT.601.
        full: Whether samples have the full range: 0 … 255, instead of 16 … 235 for luma and 16 … 240 for chroma.

    Returns:
        The conversion, or None for any other `space`.
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
        chroma: Cb and Cr in this order, uint8 (⌈H/2⌉, ⌈W/2⌉) each.
        matrix: The numbers for converting luma and chroma to RGB.
        rgba: A function that converts the frame on the CPU: RGBA (H, W, 4), as FrameSource.read returns it.
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
        """Return a moment: a frame at a time between the pair's two frames, which is not computed yet.

        Args:
            pair: The numbers of the two frames. They are only stored in Moment.pair.
            number: Which moment, 1 to steps − 1. It lies number / steps of the way from the first to the second frame.
            steps: Into how many equal steps the time between the two frames is divided.

        Returns:
            The moment. If the two frames are equal or have nothing in common, as at a cut: the one that is nearer in
            time (H, W, 4), halfway the first.
        """

    def rgba(self, moment: Moment) -> np.ndarray:
        """Make the frame (H, W, 4) of a moment, as FrameSource.read gives it."""

    def values(self, moment: Moment, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Interpolate values of pixels, such as a matte's, to a moment: move them along the frames' optical flow.

        Args:
            moment: The moment, from `moment`.
            first, second: The values, float32 (H, W), at the pair's first and second frame.

        Returns:
            The values at the moment, float32 (H, W): a mix of `first` and `second`.
        """


@dataclass(frozen=True)
class Moment:
    """A frame at a time between two filmed frames, as the data from which a GPU or `rgba` computes its pixels.

    The time between the two frames is divided into `keys` equal parts. Their bounds are key moments: number 0 is the
    first frame, number `keys` the second. At a key moment between them, each pixel is a mix of two pixels, one of each
    frame, at the ends of the motion path (from optical flow) that passes there. Any other time is a mix of the key
    moments before and after it, in linear light. Parts that move little or are smooth use only some.

    Attributes:
        pair: The numbers of the two frames, counting filmed frames only. They are neighbors, unless the frames between
            them only repeat the first.
        ends: The two frames, RGBA (H, W, 4) each, in the source's dtype.
        number, steps: The time: number / steps of the way from the first frame to the second.
        vectors: uint16 (keys − 1, ⌈H / STEP⌉, ⌈W / STEP⌉, 4), the same for all moments of a pair; `keys` is a power of
            two. vectors[k − 1] is for key moment k, at every STEPth pixel; interpolate bilinearly between these.
            Channels 0 and 1: x and y of the whole path from the first frame to the second, in 1 / UNIT of a pixel, plus
            ZERO. Channels 2 and 3: how surely the first and the second frame show what moves there, 0 to 255.
        levels: uint8, one for each tile of TILE pixels (rows, columns of tiles), the same for all moments of a pair. A
            tile of level n uses 2ⁿ + 1 key moments, those whose number is a multiple of keys / 2ⁿ.
        between: The Pair that made this moment.
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
    """Finds the cuts of a source (media/cuts.py). Frames are numbered from 0, including moments between filmed ones.

    To find cuts it reads frames of the source. It keeps these in memory, within a limit, until the source's `read` asks
    for them, so that they are not decoded twice.
    """

    def around(self, index: int, low: int, high: int, *, known: bool = False) -> range:
        """Return the frames of the shot to which a frame belongs: those between the cuts before and after it.

        Args:
            index: The number of the frame.
            low, high: The first and last frame between which cuts are searched. On a side where none is found, the
                result extends to the clip's start or end.
            known: Use only cuts that earlier calls found, and read no frames.
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
        width, height: The size of the frames in pixels.
        count: The number of frames, including moments; without these, as Blender counts them (content_duration).
        fps: Frames per second, counting moments; None for an image sequence.
        dtype: The type of samples: uint8, uint16, float16 or float32. 0 to the largest integer stands for 0 to 1.
        transfer: "srgb" (sRGB display values) or "linear" (scene linear, Rec.709 primaries).
        alpha: "opaque", "straight" or "premultiplied".
        options: The settings that the samples depend on, besides the files, such as the color space: {name: value}.
        has_audio: Whether the file has sound.
        left_out: A sentence that warns the user of later numbered files which are not part of the sequence, because too
            many numbers are missing before them. "": there are none.
        step: Frames 0, step, 2 · step … were filmed. The others are moments, computed between them. 1: all were filmed.
        shots: Finds the source's cuts. None: the source counts as one shot.
        from_proxy: Whether frames come from a proxy (a small copy made by Blender), except those that it lacks.
        by_blender: Whether a second Blender process decodes the frames because PyAV is missing.
        repeats: Whether any frame that repeats the one before was replaced by a moment so far.
        windows: How many windows (buffers of frames on the device) a picture needs at once for this source. Their
            memory is budgeted accordingly.
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
        """Return a frame as an array (height, width, 4), RGBA, top row first. Reading in ascending order is fastest.

        Args:
            index: The number of the frame, from 0, counting moments.

        Raises:
            MediaError: The frame cannot be decoded.
            IndexError: It is outside 0 … count − 1.
        """

    def decoded(self, index: int) -> Decoded:
        """Return a frame in the form that is fastest to get.

        Args:
            index: As for `read`.

        Returns:
            A Planes, a Moment, or an array as from `read`. `as_rgba` converts any of them to such an array.

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
    """A file of frames, such as a matte file, that is named but not open yet. Equal ones give the same frames.

    The opened source of a matte differs from other sources: `read` returns one value per pixel, (height, width)
    float32, 0 to 1, and takes any index, which it clamps to the file's frames.
    """

    def open(self) -> FrameSource:
        """Open the source. The caller has to close it.

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
            frames: A function that returns the frame of an index, for `read` and `decoded`. None: `read` and `decoded`
                both return what the other source's `read` returns.
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
