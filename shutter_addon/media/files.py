"""Small checks that movies and sequences share."""

import os
from pathlib import Path

from .errors import MediaError


def check_file(path):
    """The path as a Path; MediaError unless it is a file with something in it that may be read."""
    path = Path(path)
    if path.is_dir():
        raise MediaError(f"{path.name}: is a folder, not a file")
    if not path.exists():
        raise MediaError(f"{path.name}: no such file in {path.absolute().parent}")
    if path.stat().st_size == 0:
        raise MediaError(f"{path.name}: file is empty")
    if not os.access(path, os.R_OK):
        raise MediaError(f"{path.name}: may not be read")
    return path


def check_index(source, index):
    """IndexError unless the source has a frame of that index."""
    if not 0 <= index < source.count:
        raise IndexError(f"frame {index} of {source.path.name}: it has frames 0 to {source.count - 1}")
