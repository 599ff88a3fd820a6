"""The lines of the extension's source that made the last errors and warnings, for reports.

A message can contain names of the user's files, strips and scenes. The line that made it does not.
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
    """Keep the line of the caller, `level` calls up, that makes an error or reports a message."""
    frame = sys._getframe(level)
    while frame.f_back and frame.f_code.co_name == "__init__":  # of an error's class
        frame = frame.f_back
    file, line = frame.f_code.co_filename, frame.f_lineno
    if _is_ours(file):
        _keep(f"{linecache.getline(file, line).strip()} [{_place(file, line)}]")


def exception(error: BaseException) -> None:
    """Keep an unexpected error of the extension: its type and the extension's calls, but not its message."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if _is_ours(frame.filename)]
    if frames:
        calls = [f"{_place(frame.filename, frame.lineno)} {frame.name}" for frame in reversed(frames[-8:])]
        _keep(f"{type(error).__name__} [{' < '.join(calls)}]")


def last() -> list[str]:
    """Return the kept lines with their times, the oldest first."""
    return [f"{seconds:.0f} s: {words}" for words, seconds in _lines]


def _keep(words: str) -> None:
    global _lines
    others = [line for line in _lines if line[0] != words]
    _lines = [*others, (words, time.monotonic() - _start)][-MOST:]


def _is_ours(file: str) -> bool:
    return Path(file).is_relative_to(_PACKAGE)


def _place(file: str, line: int | None) -> str:
    return f"{Path(file).relative_to(_PACKAGE).as_posix()}:{line}"
