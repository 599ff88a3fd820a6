"""The last errors and warnings that users saw, in memory only, for reports.

Messages can quote the user's names. A report instead quotes the lines of our source that made the messages.
"""

import linecache
import sys
import threading
import time
import traceback
from pathlib import Path
from types import FrameType
from typing import NamedTuple

from .memo import Kept

MOST = 100  # messages
_PACKAGE = Path(__file__).parents[1]
_CALLS = 8  # of a traceback
_LEAST = 5  # letters; shorter messages are part of others by chance
_start = time.monotonic()
_lock = threading.RLock()  # films are rendered on other threads


class Told(NamedTuple):
    """A message.

    Attributes:
        text: As it was shown, possibly with names.
        words: Its description without names.
        seconds: Since the start, when it was shown last.
        times: How often it was shown.
    """

    text: str
    words: str
    seconds: float
    times: int


_told: Kept[tuple[str, str], Told] = Kept()  # the last one shown is last
_made: Kept[str, tuple[str, int]] = Kept()  # by an error's message: file and line that made it last


def made(sentence: str) -> None:
    """Remember where an error with this message is made: in the caller of its class."""
    frame: FrameType | None = sys._getframe(1)
    while frame and frame.f_code.co_name == "__init__":
        frame = frame.f_back
    if frame and len(sentence) >= _LEAST:
        with _lock:
            _made.keep(sentence, (frame.f_code.co_filename, frame.f_lineno), MOST)


def record(text: object, level: int = 1) -> None:
    """Keep a message that a user sees; `level` is the caller that shows it, if no error of ours made it."""
    words = described(text)
    if not words:
        frame = sys._getframe(level)
        words = _source(frame.f_code.co_filename, frame.f_lineno)
    _keep(str(text), words)


def shown(text: object, level: int = 1) -> None:
    """Keep a message like `record`, but count it once, since it is drawn repeatedly."""
    with _lock:
        is_known = any(known == str(text) for known, _ in _told)
    if not is_known:
        record(text, level + 1)


def exception(error: BaseException) -> None:
    """Keep an unexpected error: its type and the extension's calls, but not its message."""
    inner_first = reversed(_frames(error)[-_CALLS:])
    calls = " < ".join(f"{_place(frame.filename, frame.lineno)} {frame.name}" for frame in inner_first)
    _keep(type(error).__name__, f"{type(error).__name__} [{calls}]")


def described(text: object) -> str:
    """Return the lines that made the errors that a message quotes, the last made first; "" for none."""
    with _lock:
        lines = [line for sentence, line in _made.items() if sentence in str(text)]
    return " < ".join(_source(*line) for line in reversed(lines))


def last() -> list[Told]:
    """Return the messages, the oldest first."""
    with _lock:
        return list(_told.values())


def forget() -> None:
    with _lock:
        _told.clear()


def is_ours(error: BaseException) -> bool:
    """Return whether the extension's code is in the error's traceback."""
    return bool(_frames(error))


def _keep(text: str, words: str) -> None:
    with _lock:
        times = _told[text, words].times + 1 if (text, words) in _told else 1
        _told.keep((text, words), Told(text, words, time.monotonic() - _start, times), MOST)


def _source(file: str, line: int) -> str:
    """Return a line of source and its place."""
    if not Path(file).is_relative_to(_PACKAGE):
        return "(words that are not the extension's own)"
    return f"{linecache.getline(file, line).strip()} [{_place(file, line)}]"


def _place(file: str, line: int | None) -> str:
    return f"{Path(file).relative_to(_PACKAGE).as_posix()}:{line}"


def _frames(error: BaseException) -> list[traceback.FrameSummary]:
    """Return the frames in files of the extension."""
    frames = traceback.StackSummary.extract(traceback.walk_tb(error.__traceback__), lookup_lines=False)
    return [frame for frame in frames if Path(frame.filename).is_relative_to(_PACKAGE)]
