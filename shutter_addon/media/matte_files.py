"""Mattes in files: one channel of a movie, of an image sequence or of a still picture, as values from 0 to 1."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.frames.frame_source import SourceWrapper
from ..core.frames.light import REC709
from .opening import open_channel


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

    def open(self) -> MatteSource:
        """MediaError: it cannot be read, or has no such channel."""
        return MatteSource(self.path, self.channel, files=self.files, stream=self.stream)


class MatteSource(SourceWrapper):
    """The frames of a matte; close it, or use it in a `with`. Not for two threads at once.

    Values are samples as they are stored: no transfer function, no colour space, alpha neither multiplied nor divided;
    a movie's range is expanded to 0 … 1. Luminance is that of Rec.709's weights, and of a grey file its grey.

    path: the movie, or the first image; width, height: pixels; count: of frames, 1 for a still picture
    fps: frames per second, None for images; files: the movie, or those of the frames
    """

    def __init__(
        self, path: Path, channel: str = "luminance", *, files: Sequence[str | Path] | None = None, stream: int = 0
    ) -> None:
        """As MatteFile has them."""
        super().__init__(open_channel(path, channel, files=files, stream=stream))

    def read(self, index: int) -> np.ndarray:
        """The values of a frame, a new array (height, width) float32, 0 … 1, top row first; what is no number is 0.

        index: from 0; before the first frame that one is given, beyond the last the last. Ascending is fastest.
        MediaError: the frame is missing, damaged, or of another size than the first."""
        return _values(self._source.read(min(max(index, 0), self.count - 1)))


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
