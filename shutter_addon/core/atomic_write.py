"""Write files whole or not at all: into a temporary folder beside their place, from which they are then moved.

This module calls such a folder a part folder.
"""

import math
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

LEFT_BEHIND = 3600  # seconds without a change after which a part folder is abandoned

_NAME = re.compile(r"\.part-[0-9a-f]{16}")


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Write a file whole or not at all: yield a temporary path to write to, then move that file to `path`.

    The file is moved when the `with` block ends. If the block raises an exception, the temporary file is removed, and
    `path` stays as it was. A symbolic link at `path` is replaced, not followed.

    Args:
        path: Where the file is to be. The temporary path has the same file name, in a temporary folder beside it.

    Raises:
        OSError: The temporary folder cannot be made, or the file cannot be moved.
    """
    with part_folder(path.parent) as folder:
        yield folder / path.name
        os.replace(folder / path.name, path)


@contextmanager
def part_folder(parent: Path) -> Iterator[Path]:
    """Yield a new temporary folder in `parent`. When the `with` block ends, remove the folder with its content.

    It is for libraries that take a path to write to. Since the folder is new, nobody can have placed a link in it, and
    no other process writes there.

    Raises:
        OSError: The folder cannot be made.
    """
    folder = new_part(parent)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def new_part(parent: Path) -> Path:
    """Make a temporary folder in `parent` and return its path.

    Raises:
        OSError: It cannot be made.
    """
    folder = parent / f".part-{secrets.token_hex(8)}"
    # Private to its owner, except on Windows, where moved files would keep the restriction.
    folder.mkdir(0o700 if os.name == "posix" else 0o777)
    return folder


def is_part(name: str) -> bool:
    """Return whether a folder's name is that of a temporary folder of this module."""
    return _NAME.fullmatch(name) is not None


def clear_up(parent: Path) -> None:
    """Remove temporary folders in `parent` that killed processes have left: those unchanged for LEFT_BEHIND seconds."""
    with suppress(OSError):
        parts = [parent / name for name in os.listdir(parent) if is_part(name)]
        if parts:
            with part_folder(parent) as folder:  # a network drive's server can have another time than this machine
                now = folder.lstat().st_mtime
        for part in parts:
            if now - _last_written(part) > LEFT_BEHIND:
                shutil.rmtree(part, ignore_errors=True)


def _last_written(folder: Path) -> float:
    """Return when a folder, or any entry directly in it, was last modified, in seconds since 1970.

    The latest of these times counts. If one cannot be read, the result is infinity, so that `clear_up` leaves the
    folder.
    """
    try:
        times = [entry.stat(follow_symlinks=False).st_mtime for entry in os.scandir(folder)]
        return max([os.lstat(folder).st_mtime, *times])
    except OSError:
        return math.inf
