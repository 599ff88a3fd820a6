"""Opens a movie or an image sequence; both give their frames by index, as Blender's strips count them."""

from fractions import Fraction
from pathlib import Path
from typing import Protocol

import numpy as np

from .color import in_colorspace
from .errors import MediaError
from .files import check_file
from .sequence import IMAGE_SUFFIXES, SequenceSource


class Source(Protocol):
    """The frames of a movie or of an image sequence; close it, or use it in a `with`.

    width, height: pixels
    count: frames as Blender's strip counts them (its content_duration)
    fps: frames per second, None for an image sequence
    dtype: uint8, uint16, float16 or float32, the samples' type; whole numbers stand for 0 … 1
    transfer: "srgb" (sRGB display values) or "linear" (scene linear, Rec.709 primaries)
    alpha: "opaque", "straight" or "premultiplied"
    options: what else its samples depend on but its files, by name; plain values
    """

    path: Path
    width: int
    height: int
    count: int
    fps: Fraction | None
    dtype: np.dtype
    transfer: str
    alpha: str
    options: dict

    def read(self, index: int) -> np.ndarray:
        """The frame as a new array (height, width, 4), RGBA, top row first, in any order; onwards is fastest.

        Raises MediaError where the frame cannot be decoded, IndexError outside 0 … count-1."""

    def close(self) -> None:
        """Lets go of the file; a later read opens it again."""


def open_source(
    path, *, stream=0, fps=None, files=None, colorspace=None, config=None, alpha=None, deinterlace=False
) -> Source:
    """Opens a movie, or the image sequence that starts with the file `path`.

    stream: which of a movie's video streams
    fps: what an image sequence, which has no rate of its own, shall report
    files: an image strip's files, one per frame, in place of those found beside `path`
    colorspace: the strip's, by Blender's name (default: what Blender assumes of such a file)
    alpha: "straight" or "premultiplied", an image strip's alpha mode (default: likewise); a movie strip's has no effect
    config: path of the OpenColorIO configuration; colour spaces other than sRGB and Linear Rec.709 need it
    deinterlace: as a movie strip's option

    Raises MediaError when there is nothing to be read."""
    path = Path(path)
    if files is None and path.suffix.lower() not in IMAGE_SUFFIXES:
        source = _open_movie(path, stream=stream, deinterlace=deinterlace)
    else:
        source = SequenceSource(path, files=files, fps=fps, alpha=alpha)
    try:
        return source if colorspace is None else in_colorspace(source, colorspace, config)
    except MediaError:
        source.close()
        raise


def _open_movie(path, **options):
    try:
        from .movie import MovieSource
    except ImportError as error:  # a package without wheels, or one for another system
        check_file(path)
        raise MediaError(
            f"{path.name}: movies need the Python package PyAV ({error}); "
            "install the zip of Virtual Shutter that is made for your system, or use an image sequence"
        ) from None
    return MovieSource(path, **options)
