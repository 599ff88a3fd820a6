"""Files that are written whole or not at all: first in a folder beside their place, then moved there."""

import math
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

LEFT_BEHIND = 3600  # seconds without a change after which a part folder counts as abandoned

_NAME = re.compile(r"\.part-[0-9a-f]{16}")


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Gives a path of the same name to write the file to. At the end of the block the file is moved to `path`; after an
    exception it is removed. A link at `path` is replaced, not followed. OSError: it cannot be written."""
    with part_folder(path.parent) as folder:
        yield folder / path.name
        os.replace(folder / path.name, path)


@contextmanager
def part_folder(parent: Path) -> Iterator[Path]:
    """A new folder in `parent`, for libraries that write by path: nobody can have put a link there, and no other writer
    uses it. At the end of the block it is removed with its content. OSError: it cannot be made."""
    folder = new_part(parent)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def new_part(parent: Path) -> Path:
    """Makes a part folder in `parent`. OSError: it cannot be made."""
    folder = parent / f".part-{secrets.token_hex(8)}"
    # Only its owner may use it. Not on Windows: a file moved out of such a folder would keep that restriction.
    folder.mkdir(0o700 if os.name == "posix" else 0o777)
    return folder


def is_part(name: str) -> bool:
    """Whether it is the name of a part folder."""
    return _NAME.fullmatch(name) is not None


def left_behind(parent: Path) -> list[Path]:
    """The part folders in `parent` that processes have left behind that were killed. OSError: it cannot be read or
    written to."""
    with os.scandir(parent) as entries:
        parts = [entry.path for entry in entries if is_part(entry.name) and entry.is_dir(follow_symlinks=False)]
    if not parts:
        return []
    now = _clock(parent)
    return [Path(part) for part in parts if now - _last_written(part) > LEFT_BEHIND]


def clear_up(parent: Path) -> None:
    """Removes them, as far as that is possible."""
    with suppress(OSError):
        for left in left_behind(parent):
            shutil.rmtree(left, ignore_errors=True)


def _clock(parent: Path) -> float:
    """The time by the clock that dates the files there, in seconds since 1970: on a network drive the server's, which
    need not agree with this machine's."""
    with part_folder(parent) as folder:
        return folder.lstat().st_mtime


def _last_written(folder: str) -> float:
    """When something in the folder last changed, in seconds since 1970; infinite if the folder is gone or cannot be
    read, so that it never counts as abandoned."""
    try:
        times = [entry.stat(follow_symlinks=False).st_mtime for entry in os.scandir(folder)]
        return max([os.lstat(folder).st_mtime, *times])
    except OSError:
        return math.inf
