"""Channels by name: those that every picture has, whatever its file calls them."""

from collections.abc import Iterable
from pathlib import Path

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
