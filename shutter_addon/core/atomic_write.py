"""Files that are written whole or not at all: beside their place first, whatever lies there."""

import math
import os
import re
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LEFT_BEHIND = 3600  # seconds in which whoever writes writes something, whatever the machine

_NAME = re.compile(r"\.part-[0-9a-f]{16}")


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Gives where to write the file instead, under its own name; at the block's end it takes its place, unless there
    was an exception. A link at `path` is replaced, and never followed. OSError: it cannot be written."""
    with part_folder(path.parent) as folder:
        yield folder / path.name
        os.replace(folder / path.name, path)


@contextmanager
def part_folder(parent: Path) -> Iterator[Path]:
    """A new folder in `parent`, for libraries that write by path: no link can have been planted there, and no two who
    write share it. At the end it goes, with what is left in it. OSError: it cannot be made."""
    folder = parent / f".part-{secrets.token_hex(8)}"
    # Its owner's alone; but what moves out of a folder of that mode would stay its owner's alone on Windows.
    folder.mkdir(0o700 if os.name == "posix" else 0o777)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def is_part(name: str) -> bool:
    """Whether it is the name of a part folder."""
    return _NAME.fullmatch(name) is not None


def left_behind(parent: Path) -> list[Path]:
    """The part folders in `parent` that nobody writes into any more: those of processes that were killed.

    OSError: it cannot be read."""
    return [
        Path(entry)
        for entry in os.scandir(parent)
        if is_part(entry.name)
        and entry.is_dir(follow_symlinks=False)
        and time.time() - _last_written(entry.path) > LEFT_BEHIND
    ]


def _last_written(folder: str) -> float:
    """When something was written in the folder; never long ago if it is gone, or another user's."""
    try:
        times = [entry.stat(follow_symlinks=False).st_mtime for entry in os.scandir(folder)]
        return max([os.lstat(folder).st_mtime, *times])
    except OSError:
        return math.inf
