"""Frames of a movie where PyAV is missing: decoded by a second Blender, those of movie.MovieSource."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from pathlib import Path

import numpy as np

from ..core.frames.frame_source import FrameSource
from . import decoding_child
from .errors import MediaError
from .files import OTHER, check_file, check_index, check_name, check_size, is_other

_numbers = itertools.count()  # a movie's for the process, which may have the same file open several times
_FLOAT_ERROR = 2**-23  # relative, of a number that Blender has as a float


class BlenderMovie(FrameSource):
    """A movie's frames, as movie.MovieSource has them; but for damaged ones, in whose place Blender may show others.

    8 bits are equal to the bit; deeper ones are as Blender's floats are."""

    file_kind, transfer, by_blender = "a movie, read by a second Blender", "srgb", True

    def __init__(self, path: str | Path, *, deinterlace: bool = False) -> None:
        self.path = check_file(path)
        self.files = [self.path]
        check_name(self.path.absolute())
        self.options = {"stream": 0, "deinterlace": bool(deinterlace)}
        self._known = {"number": next(_numbers), "path": str(self.path.absolute()), "deinterlace": bool(deinterlace)}
        try:
            about, _ = decoding_child.ask(self._known | {"wanted": "about"})
        except MediaError as error:
            raise MediaError(f"{self.path.name}: cannot be read as a movie ({error})") from None
        self.width, self.height = about["size"]
        check_size(self.path.name, self.width, self.height)
        self.count, self.has_audio = about["count"], about["audio"]
        if self.count < 1 or not math.isfinite(about["fps"]) or about["fps"] <= 0:
            self.close()
            raise MediaError(f"{self.path.name}: its length is unknown; put it into an MP4 or MKV file first")
        self.fps = frame_rate(about["fps"])
        self.dtype = np.dtype(np.uint16 if about["deep"] else np.uint8)
        # Blender takes 8-bit colours for straight, but those of deeper movies, its floats, for premultiplied.
        self.alpha = "opaque" if not about["alpha"] else "premultiplied" if about["deep"] else "straight"

    def read(self, index: int) -> np.ndarray:
        check_index(self, index)
        try:
            if is_other(self.path):  # in the place of the file that was there
                raise MediaError(OTHER)
            _, frame = decoding_child.ask(self._known | {"wanted": index})
        except MediaError as error:
            raise MediaError(f"frame {index} of {self.path.name} cannot be decoded: {error}") from None
        if frame is None or frame.shape != (self.height, self.width, 4) or frame.dtype != self.dtype:
            raise MediaError(f"frame {index} of {self.path.name} cannot be decoded: the file is another one now")
        return frame

    def close(self) -> None:
        decoding_child.tell(self._known | {"wanted": "close"})


def frame_rate(number: float) -> Fraction:
    """The frame rate that Blender has as a float: a whole number, a thousand of 1001ths of one, or what has the
    smallest denominator."""
    for rate in (Fraction(round(number)), Fraction(round(number * 1.001) * 1000, 1001)):
        if rate and abs(float(rate) / number - 1) <= _FLOAT_ERROR:
            return rate
    return next(
        rate
        for digits in range(1, 64)
        if (rate := Fraction(number).limit_denominator(1 << digits)) and abs(float(rate) / number - 1) <= _FLOAT_ERROR
    )
