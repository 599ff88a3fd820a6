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
    """Yield a temporary path of the same name to write to, and move the written file to `path` at the end.

    If the block raises an exception, the temporary file is removed. A link at `path` is replaced, not followed.

    Raises:
        OSError: It cannot be written.
    """
    with part_folder(path.parent) as folder:
        yield folder / path.name
        os.replace(folder / path.name, path)


@contextmanager
def part_folder(parent: Path) -> Iterator[Path]:
    """Yield a new temporary folder in `parent`, and remove it with its content at the end.

    Libraries write files by path. In a new folder, nobody can have placed a link, and no other process writes.

    Raises:
        OSError: It cannot be made.
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
    """Return when a folder or a file in it last changed, in seconds since 1970.

    Return infinity if the time is unknown, so that `clear_up` never removes the folder.
    """
    try:
        times = [entry.stat(follow_symlinks=False).st_mtime for entry in os.scandir(folder)]
        return max([os.lstat(folder).st_mtime, *times])
    except OSError:
        return math.inf
