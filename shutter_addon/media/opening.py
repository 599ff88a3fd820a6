"""Open footage and matte files: movies and image sequences, whose frames are counted as in Blender's strips.

A matte is a channel of a movie, of an image sequence or of a picture, as values 0 … 1.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.frames.light import REC709
from ..core.messages import MediaError
from .blender_movie import BlenderMovie
from .color import in_colorspace
from .files import check_file, pyav_missing
from .reduced import ProxySource, fits, smaller
from .sequence import CHANNELS, IMAGE_SUFFIXES, SequenceSource, no_channel


def open_source(
    path: str | Path,
    *,
    stream: int = 0,
    files: Sequence[str | Path] | None = None,
    colorspace: str | None = None,
    config: str | Path | None = None,
    alpha: str | None = None,
    deinterlace: bool = False,
    divisor: int = 1,
) -> FrameSource:
    """Open a movie, or the image sequence that starts with a file, as a source of frames.

    Args:
        path: The file. With `files`, it may be their folder.
        stream: Which video stream of a movie, from 0. Cover pictures do not count.
        files: The file names of an image strip, one for each frame, in the folder of `path`. None: a movie, or images
            with numbers from `path` on.
        colorspace: Blender's name of the color space in which the strip's samples are. None: what Blender assumes for
            such a file.
        config: The OpenColorIO configuration file; not needed for sRGB, Linear Rec.709 and Non-Color.
        alpha: The alpha mode of images, "straight" or "premultiplied". None: what Blender assumes.
        deinterlace: Whether to deinterlace a movie, as the option of a movie strip does.
        divisor: The factor by which both sides of frames are reduced, one of reduced.DIVISORS.

    Raises:
        MediaError: The file cannot be read, or the configuration is missing or lacks the color space.
    """
    path = Path(path)
    source: FrameSource
    if _is_movie(path, files):
        source = _opened_movie(path, stream, deinterlace, divisor)
    else:
        source = smaller(SequenceSource(path, files=files, alpha=alpha), divisor)
    try:
        return source if colorspace is None else in_colorspace(source, colorspace, config)
    except MediaError:
        source.close()
        raise


def with_proxy(source: FrameSource, path: Path, **how: Any) -> FrameSource:
    """Return a source that reads footage from a proxy (a small copy made by Blender), so that previews are faster.

    If the proxy is missing, unreadable or unfit (`fits`), return `source` itself.

    Args:
        source: The footage.
        path: The proxy's file.
        how: Arguments of open_source for the proxy.
    """
    try:
        proxy = open_source(path, **how)
    except MediaError:
        return source
    if fits(proxy, source):
        return ProxySource(source, proxy)
    proxy.close()
    return source


def _is_movie(path: Path, files: Sequence[str | Path] | None) -> bool:
    """Return whether to open a path as a movie: it is not in an image strip's list, and not named as an image."""
    return files is None and path.suffix.lower() not in IMAGE_SUFFIXES


def _opened_movie(path: Path, stream: int, deinterlace: bool = False, divisor: int = 1) -> FrameSource:
    """Open a movie by PyAV or, where that is missing, by a second Blender. Arguments and errors as for open_source."""
    if pyav_missing():
        check_file(path)
        if stream or BlenderMovie.decoder.command is None:
            raise MediaError(
                f"{path.name}: movies need the Python package PyAV ({pyav_missing()}); "
                "install the zip of Virtual Shutter that is made for your system, or use an image sequence"
            )
        return smaller(BlenderMovie(path, deinterlace=deinterlace), divisor)
    from .movie import MovieSource

    return MovieSource(path, stream=stream, deinterlace=deinterlace, divisor=divisor)


def movie_channel(movie: FrameSource, channel: str) -> FrameSource:
    """Return a source whose frames are one channel of a movie's frames, samples (height, width, n).

    n is 1 for a color, for alpha, and for the luminance of a grey frame. It is 3 (RGB) for the luminance of a frame
    that may have colors, and 0 for the alpha of an opaque movie.

    Args:
        channel: "luminance", "red", "green", "blue" or "alpha" (sequence.CHANNELS).
    """
    grey_of = getattr(movie, "grey", lambda _index: None)  # BlenderMovie has no `grey`

    def samples(index: int) -> np.ndarray:
        if channel == "alpha" and movie.alpha == "opaque":
            return np.empty((movie.height, movie.width, 0), movie.dtype)
        grey = grey_of(index) if channel == "luminance" else None
        return movie.read(index)[..., CHANNELS[channel]] if grey is None else grey

    return SourceWrapper(movie, samples)


@dataclass(frozen=True)
class MatteFile:
    """A matte file and the choice of its channel, hashable (a frame_source.SourceFile). `open` gives its frames.

    Attributes:
        path: A movie, a picture, or the first file of an image sequence.
        channel: "luminance", "red", "green", "blue", "alpha", or the name of a channel in an EXR file.
        files: The file names of an image strip, one for each frame. None: a movie, or images with numbers from `path`
            on.
        stream: Which video stream of a movie, from 0.
        stamp: Any value that differs after the file has changed, such as its time and size, so that the changed file
            does not compare equal to the old one. None: changes are not noticed.
    """

    path: Path
    channel: str = "luminance"
    files: tuple[str | Path, ...] | None = None
    stream: int = 0
    stamp: Hashable = None

    def open(self) -> SourceWrapper:
        """Open a source of the matte's values (height, width) float32, 0 to 1. Only one thread at a time may use it.

        Values are the stored samples, without any conversion of color spaces or alpha. A movie's range is expanded to 0
        to 1, values outside are clipped, and NaN becomes 0. Luminance has the weights of Rec.709. Each frame is a new
        array. Any frame number is allowed: it is clamped to the file's frames.

        Raises:
            MediaError: The file cannot be read, or has no such channel.
        """
        source: FrameSource
        if not _is_movie(self.path, self.files):
            source = SequenceSource(self.path, channel=self.channel, files=self.files)
        elif self.channel in CHANNELS:
            source = movie_channel(_opened_movie(self.path, self.stream), self.channel)
        else:
            raise no_channel(check_file(self.path), self.channel, CHANNELS)
        return SourceWrapper(source, lambda index: _values(source.read(min(max(index, 0), source.count - 1))))


def _values(samples: np.ndarray) -> np.ndarray:
    """Convert the samples of a channel to a matte's values (h, w) float32, 0 to 1.

    Args:
        samples: (h, w, n). n = 1: the channel. n = 3: RGB, whose luminance is wanted. n = 0: the alpha of an opaque
            file, which is 1. Whole numbers are divided by the largest value of their type; floats are clipped to 0 to
            1.
    """
    if samples.shape[2] == 0:
        return np.ones(samples.shape[:2], np.float32)
    values = samples[..., 0]
    if samples.shape[2] == 3:
        values = samples[..., 0] * REC709[0]
        for i in (1, 2):
            values += samples[..., i] * REC709[i]
    if samples.dtype.kind == "u":
        return values / np.float32(np.iinfo(samples.dtype).max)
    values = np.fmax(values.astype(np.float32), 0)  # NaN becomes 0, unlike with `maximum`
    return np.minimum(values, 1, out=values)
