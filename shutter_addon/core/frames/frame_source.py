"""The interface of every source of frames: movies, image sequences, and their wrappers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from fractions import Fraction
from pathlib import Path
from typing import Protocol, Self

import numpy as np

from .planes import Decoded, as_rgba


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
