"""Channels by name: those that every picture has, whatever its file calls them."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.frames.source_wrapper import SourceWrapper
from .errors import MediaError

CHANNELS = {
    "luminance": slice(0, 3),
    "red": slice(0, 1),
    "green": slice(1, 2),
    "blue": slice(2, 3),
    "alpha": slice(3, 4),
}
_TOLD = 6  # channels of a file that a sentence names


def no_channel(path: Path, channel: str, names: Iterable[str]) -> MediaError:
    """What is said where a file has no such channel, but others."""
    names = list(names)
    others = len(names) - _TOLD
    told = ", ".join(names[:_TOLD]) + (f" and {others} others" if others > 0 else "")
    return MediaError(f"{path.name}: has no channel {channel}, but {told}")


class MovieChannel(SourceWrapper):
    """One channel of a movie's frames."""

    def __init__(self, movie: FrameSource, channel: str) -> None:
        super().__init__(movie)
        self._channel = channel
        self._grey = getattr(movie, "grey", lambda _index: None)  # which a second Blender's movies have not

    def read(self, index: int) -> np.ndarray:
        """The samples (height, width, n) that the channel is made of: n is 3, RGB, for the luminance of colours, 0 for
        the alpha of an opaque movie, 1 otherwise. Raises what the movie's `read` raises."""
        if self._channel == "alpha" and self.alpha == "opaque":
            return np.empty((self.height, self.width, 0), self.dtype)
        grey = self._grey(index) if self._channel == "luminance" else None
        return self._source.read(index)[..., CHANNELS[self._channel]] if grey is None else grey
