"""Opens a movie or an image sequence; both give their frames by index, as Blender's strips count them. Mattes in files:
one channel of a movie, of an image sequence or of a still picture, as values from 0 to 1."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.frames.light import REC709
from .blender_movie import BlenderMovie, is_lent
from .color import in_colorspace
from .errors import MediaError
from .files import check_file, pyav_missing
from .reduced import ProxySource, fits, smaller
from .sequence import CHANNELS, IMAGE_SUFFIXES, SequenceChannel, SequenceSource, no_channel


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
    """Opens a movie, or the image sequence that starts with the file `path`. MediaError: it cannot be read.

    stream: which of a movie's video streams, from 0
    files: the names of an image strip's files, one per frame, in place of those found beside `path`
    colorspace: the strip's colour space, by Blender's name (default: what Blender assumes for such a file)
    config: path of the OpenColorIO configuration; colour spaces other than sRGB and Linear Rec.709 need it
    alpha: an image strip's alpha mode, "straight" or "premultiplied" (default: what Blender assumes); not a movie's
    deinterlace: a movie strip's option of that name
    divisor: how many times smaller than the files' the frames are each way, one of reduced.DIVISORS
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


def with_proxy(source: FrameSource, opened: Callable[[], FrameSource]) -> FrameSource:
    """The source with its frames read from a proxy, which is opened; the source itself, where there is none that fits.

    opened: gives the proxy, or raises MediaError"""
    try:
        proxy = opened()
    except MediaError:
        return source
    if fits(proxy, source):
        return ProxySource(source, proxy)
    proxy.close()
    return source


def open_channel(
    path: str | Path, channel: str, *, files: Sequence[str | Path] | None = None, stream: int = 0
) -> FrameSource:
    """Opens what `open_source` opens, for one channel alone. MediaError: it cannot be read, or has no such channel.

    channel: one of sequence.CHANNELS, or the name of a channel of the images' own; files, stream: see open_source"""
    path = Path(path)
    if not _is_movie(path, files):
        return SequenceChannel(path, channel, files=files)
    if channel not in CHANNELS:
        raise no_channel(check_file(path), channel, CHANNELS)
    return movie_channel(_opened_movie(path, stream), channel)


def _is_movie(path: Path, files: Sequence[str | Path] | None) -> bool:
    return files is None and path.suffix.lower() not in IMAGE_SUFFIXES


def _opened_movie(path: Path, stream: int, deinterlace: bool = False, divisor: int = 1) -> FrameSource:
    """See open_source."""
    if pyav_missing():
        _check_lent(path, stream)
        return smaller(BlenderMovie(path, deinterlace=deinterlace), divisor)
    from .movie import MovieSource

    return MovieSource(path, stream=stream, deinterlace=deinterlace, divisor=divisor)


def _check_lent(path: Path, stream: int) -> None:
    """MediaError: without PyAV (a package without wheels, or one for another system) that movie cannot be read."""
    if is_lent() and stream == 0:
        return
    check_file(path)
    what = f"video stream {stream} of a movie needs" if is_lent() else "movies need"
    raise MediaError(
        f"{path.name}: {what} the Python package PyAV ({pyav_missing()}); "
        "install the zip of Virtual Shutter that is made for your system, or use an image sequence"
    )


def movie_channel(movie: FrameSource, channel: str) -> FrameSource:
    """One channel of a movie's frames. Its samples are (height, width, n): n is 3, RGB, for the luminance of colours, 0
    for the alpha of an opaque movie, 1 otherwise."""
    grey_of = getattr(movie, "grey", lambda _index: None)  # which a second Blender's movies have not

    def samples(index: int) -> np.ndarray:
        if channel == "alpha" and movie.alpha == "opaque":
            return np.empty((movie.height, movie.width, 0), movie.dtype)
        grey = grey_of(index) if channel == "luminance" else None
        return movie.read(index)[..., CHANNELS[channel]] if grey is None else grey

    return SourceWrapper(movie, samples)


@dataclass(frozen=True)
class MatteFile:
    """Where a matte is read from.

    path: a movie, a still picture, or the first file of an image sequence
    channel: luminance, red, green, blue, alpha, or the name of a channel of an EXR
    files: the names of an image strip's files, one per frame, in place of those found beside `path`
    stream: which of a movie's video streams, as a movie strip counts them
    stamp: tells a file from another one that took its place
    """

    path: Path
    channel: str = "luminance"
    files: tuple[str | Path, ...] | None = None
    stream: int = 0
    stamp: Hashable = None

    def open(self) -> SourceWrapper:
        """The frames of the matte (core.model.mattes.MatteSource), each a new array; what is no number is 0. Not for
        two threads at once. MediaError: it cannot be read, or has no such channel.

        Values are samples as they are stored: no transfer function, no colour space, alpha neither multiplied nor
        divided; a movie's range is expanded to 0 … 1. Luminance is that of Rec.709's weights, and of a grey file its
        grey."""
        channel = open_channel(self.path, self.channel, files=self.files, stream=self.stream)
        return SourceWrapper(channel, lambda index: _values(channel.read(min(max(index, 0), channel.count - 1))))


def _values(samples: np.ndarray) -> np.ndarray:
    """Values (h, w) of samples (h, w, n) of any type, n being 3 (RGB), 1, or 0 for what is opaque."""
    if samples.shape[2] == 0:
        return np.ones(samples.shape[:2], np.float32)
    values = samples[..., 0]
    if samples.shape[2] == 3:
        values = samples[..., 0] * REC709[0]
        for i in (1, 2):
            values += samples[..., i] * REC709[i]
    if samples.dtype.kind == "u":
        return values / np.float32(np.iinfo(samples.dtype).max)
    values = np.fmax(values.astype(np.float32), 0)  # unlike `maximum`, it gives 0 for what is no number
    return np.minimum(values, 1, out=values)
