"""Files that are written whole or not at all: first in a folder beside their place, then moved there."""

import math
import os
import re
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
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
    folder = parent / f".part-{secrets.token_hex(8)}"
    # Only its owner may use it. Not on Windows: a file moved out of such a folder would keep that restriction.
    folder.mkdir(0o700 if os.name == "posix" else 0o777)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def is_part(name: str) -> bool:
    """Whether it is the name of a part folder."""
    return _NAME.fullmatch(name) is not None


def left_behind(parent: Path) -> list[Path]:
    """The part folders in `parent` that processes have left behind that were killed. OSError: it cannot be read."""
    return [
        Path(entry)
        for entry in os.scandir(parent)
        if is_part(entry.name)
        and entry.is_dir(follow_symlinks=False)
        and time.time() - _last_written(entry.path) > LEFT_BEHIND
    ]


def _last_written(folder: str) -> float:
    """When something in the folder last changed, in seconds since 1970; infinite if the folder is gone or cannot be
    read, so that it never counts as abandoned."""
    try:
        times = [entry.stat(follow_symlinks=False).st_mtime for entry in os.scandir(folder)]
        return max([os.lstat(folder).st_mtime, *times])
    except OSError:
        return math.inf
