"""Opens movies and image sequences, whose frames are counted as in Blender's strips. And mattes in files: a channel of
a movie, of an image sequence or of a picture, as values 0 … 1."""

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
    """Open a movie, or the image sequence that starts with the file `path`.

    Args:
        path: the file
        stream: the number of a movie's video stream
        files: the file names of an image strip, one for each frame. None: those found beside `path`.
        colorspace: Blender's name of the strip's color space. None: what Blender assumes for such a file.
        config: the OpenColorIO configuration, needed for color spaces other than sRGB and Linear Rec.709
        alpha: an image strip's alpha mode, "straight" or "premultiplied". None: what Blender assumes.
        deinterlace: a movie strip's option
        divisor: the factor by which frames are reduced to each side, one of reduced.DIVISORS

    Raises:
        MediaError: it cannot be read
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
    """Return a source that reads the frames from a proxy, or the source itself if the proxy does not fit.

    Args:
        source: the footage
        path: the proxy's
        how: arguments of open_source
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
    return files is None and path.suffix.lower() not in IMAGE_SUFFIXES


def _opened_movie(path: Path, stream: int, deinterlace: bool = False, divisor: int = 1) -> FrameSource:
    """See open_source."""
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
    """Return one channel of a movie's frames as samples (height, width, n).

    n is 3 (RGB) for the luminance of colors, 0 for the alpha of an opaque movie, else 1.
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
    """The file of a matte.

    Attributes:
        path: a movie, a picture, or the first file of an image sequence
        channel: luminance, red, green, blue, alpha, or the name of a channel of an EXR
        files: the file names of an image strip, one for each frame. None: those found beside `path`.
        stream: the number of a movie's video stream
        stamp: differs when another file takes its place
    """

    path: Path
    channel: str = "luminance"
    files: tuple[str | Path, ...] | None = None
    stream: int = 0
    stamp: Hashable = None

    def open(self) -> SourceWrapper:
        """Open the matte's frames (core.frames.frame_source.SourceFile), for one thread at a time.

        Each frame is a new array of the stored samples: without a transfer function or color space, with alpha neither
        multiplied nor divided. A movie's range is expanded to 0 … 1, NaN becomes 0. Luminance has Rec.709's weights.

        Raises:
            MediaError: it cannot be read, or has no such channel
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
    """Return values (h, w) of samples (h, w, n): RGB, one channel, or none for opaque files."""
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
