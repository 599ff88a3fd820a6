"""The lines of the extension's source code that raised the last errors and warnings, for *Copy Report*.

A message can contain names of the user's files, strips and scenes. The line of code that made it does not.
"""

from __future__ import annotations

import linecache
import sys
import time
import traceback
from pathlib import Path

MOST = 100  # lines
_PACKAGE = Path(__file__).parents[1]
_start = time.monotonic()
_lines: list[tuple[str, float]] = []  # with seconds since the start, replaced as a whole: any thread adds to them


def record(level: int = 1) -> None:
    """Note the source line that makes an error or reports a message, so that *Copy Report* can list it.

    Only lines of this extension are noted. If the line is in an `__init__` method (of an error's class), the line that
    calls it is noted instead.

    Args:
        level: How many calls above this function the line is: 1 for the line that calls `record`, 2 for its caller's.
    """
    frame = sys._getframe(level)
    while frame.f_back and frame.f_code.co_name == "__init__":  # of an error's class
        frame = frame.f_back
    file, line = frame.f_code.co_filename, frame.f_lineno
    if _is_ours(file):
        _keep(f"{linecache.getline(file, line).strip()} [{_place(file, line)}]")


def exception(error: BaseException) -> None:
    """Keep an unexpected error: its type, and the calls in the extension that led to it, but not its message."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if _is_ours(frame.filename)]
    if frames:
        calls = [f"{_place(frame.filename, frame.lineno)} {frame.name}" for frame in reversed(frames[-8:])]
        _keep(f"{type(error).__name__} [{' < '.join(calls)}]")


def last() -> list[str]:
    """Return the kept lines of code and errors, each with the seconds since the extension's start, the oldest first."""
    return [f"{seconds:.0f} s: {words}" for words, seconds in _lines]


def _keep(words: str) -> None:
    """Keep a line with the current time. Forget the same line from before, and the oldest ones beyond MOST."""
    global _lines
    others = [line for line in _lines if line[0] != words]
    _lines = [*others, (words, time.monotonic() - _start)][-MOST:]


def _is_ours(file: str) -> bool:
    return Path(file).is_relative_to(_PACKAGE)


def _place(file: str, line: int | None) -> str:
    """Return the place of a line of code for reports, such as core/caches.py:12."""
    return f"{Path(file).relative_to(_PACKAGE).as_posix()}:{line}"
