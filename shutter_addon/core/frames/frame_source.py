"""What every source of frames offers: movies, image sequences, and what wraps them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from fractions import Fraction
from pathlib import Path
from typing import Protocol, Self

import numpy as np

from .planes import Decoded


class ShotFinder(Protocol):
    """Where the shots of a source end. It may have to read frames for that; those wait for their `read`.

    Frames are counted as the source counts them, from 0.
    """

    def around(self, index: int, low: int, high: int, *, known: bool = False) -> range:
        """The frames of the shot around frame `index`, for a window of the frames from `low` to `high`.

        Ends beyond the window are not looked for: the clip's ends take their place. known: it reads nothing; where it
        does not know whether there is a cut, it takes it that there is none."""

    def lacking(self, index: int, low: int, high: int) -> set[int]:
        """The frames that `around` would read for these arguments, if it found no more cuts."""

    def handed(self) -> set[int]:
        """The frames that were read and wait for `read`."""

    def release(self) -> None:
        """Frees the frames that wait for `read`."""


class FrameSource(ABC):
    """The frames of a movie or of an image sequence; close it, or use it in a `with`.

    path: the movie, or the first file of the sequence
    file_kind: what kind of file that is: format, codec and samples, as the libraries call them
    files: the movie, or one for each frame of a sequence
    width, height: pixels
    count: frames as Blender's strip counts them (its content_duration)
    fps: frames per second, None for an image sequence
    dtype: uint8, uint16, float16 or float32, the samples' type; whole numbers stand for 0 … 1
    transfer: "srgb" (sRGB display values) or "linear" (scene linear, Rec.709 primaries)
    alpha: "opaque", "straight" or "premultiplied"
    options: what the samples depend on besides the files, {name: plain value}
    has_audio: whether the file has sound
    left_out: a sentence for the user about files beside the sequence that do not belong to it; "" if there are none
    step: every step-th frame was filmed, from the first on
    shots: what knows where its shots end; None: it is one shot
    from_proxy: whether frames are read from a proxy, as far as it has them
    by_blender: whether a second Blender decodes them, for want of PyAV
    repeats: whether frames repeated others so far, and are moments between these
    windows: how many windows of a picture read it, which have to have room beside one another
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
        """The frame as an array (height, width, 4), RGBA, top row first. Any order; ascending is fastest.

        MediaError: the frame cannot be decoded. IndexError: it is outside 0 … count-1."""

    def decoded(self, index: int) -> Decoded:
        """The frame as it is quickest to get, raising what `read` raises: its planes, where it has some and nothing but
        their conversion is between the two, else as `read` gives it."""
        return self.read(index)

    def want(self, indices: Iterable[int]) -> None:
        """Says which frames will be read next, in this order; others will not. A source may decode them ahead."""
        return  # or it need not

    def close(self) -> None:
        """Closes the file; a later read opens it again."""
        return

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Forwarded:
    """An attribute of the wrapped source, unless the wrapper sets its own."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, wrapper: SourceWrapper | None, _owner: type | None = None) -> object:
        return self if wrapper is None else getattr(wrapper._source, self._name)


class SourceWrapper(FrameSource):
    """A source around another one. It has all attributes and frames of that one, but for those that a subclass sets."""

    def __init__(self, source: FrameSource, frames: Callable[[int], np.ndarray] | None = None) -> None:
        """frames: gives what `read` gives; None: the source does"""
        self._source, self._frames_of = source, frames

    def read(self, index: int) -> np.ndarray:
        return (self._frames_of or self._source.read)(index)

    def decoded(self, index: int) -> Decoded:
        return self.read(index)  # which may give other frames than the source

    def want(self, indices: Iterable[int]) -> None:
        self._source.want(indices)

    def close(self) -> None:
        self._source.close()


for _name in FrameSource.__annotations__:
    setattr(SourceWrapper, _name, _Forwarded(_name))
