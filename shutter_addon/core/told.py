"""The last errors and warnings that users were told, for a report of an error: in memory alone, a hundred at most.

Sentences quote what is the user's. A report has the lines of source that made them instead, which are ours.
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

MOST = 100  # sentences
_PACKAGE = Path(__file__).parents[1]
_CALLS = 8  # of a traceback
_LEAST = 5  # letters of a sentence; what has fewer stands in others by chance
_start = time.monotonic()
_lock = threading.RLock()  # films are rendered on threads of their own


class Told(NamedTuple):
    """A sentence as it was shown, names included, and the words for it that have none.

    seconds: after the start, when it was told last; times: how often that was"""

    text: str
    words: str
    seconds: float
    times: int


_told: Kept[tuple[str, str], Told] = Kept()  # in the order in which they were told last
_made: Kept[str, tuple[str, int]] = Kept()  # by sentence of an error: the file and the line that made it last


def made(sentence: str) -> None:
    """Notes who makes an error of this sentence: the caller of its class."""
    frame: FrameType | None = sys._getframe(1)
    while frame and frame.f_code.co_name == "__init__":
        frame = frame.f_back
    if frame and len(sentence) >= _LEAST:
        with _lock:
            _made.keep(sentence, (frame.f_code.co_filename, frame.f_lineno), MOST)


def record(text: object, level: int = 1) -> None:
    """Keeps a sentence that a user is told. level: which of the callers tells it, where no error of ours has said it"""
    words = described(text)
    if not words:
        frame = sys._getframe(level)
        words = _source(frame.f_code.co_filename, frame.f_lineno)
    _keep(str(text), words)


def shown(text: object, level: int = 1) -> None:
    """As `record`, for what is drawn again and again: it counts once."""
    with _lock:
        is_known = any(known == str(text) for known, _ in _told)
    if not is_known:
        record(text, level + 1)


def exception(error: BaseException) -> None:
    """Keeps an error that nobody expected: its type and calls of the extension's code, not what it says."""
    inner_first = reversed(_frames(error)[-_CALLS:])
    calls = " < ".join(f"{_place(frame.filename, frame.lineno)} {frame.name}" for frame in inner_first)
    _keep(type(error).__name__, f"{type(error).__name__} [{calls}]")


def described(text: object) -> str:
    """The lines that made the errors which a sentence quotes, the last made first; "": it quotes none."""
    with _lock:
        lines = [line for sentence, line in _made.items() if sentence in str(text)]
    return " < ".join(_source(*line) for line in reversed(lines))


def last() -> list[Told]:
    """What was told, the oldest first."""
    with _lock:
        return list(_told.values())


def forget() -> None:
    with _lock:
        _told.clear()


def is_ours(error: BaseException) -> bool:
    """Whether code of the extension has to do with it."""
    return bool(_frames(error))


def _keep(text: str, words: str) -> None:
    with _lock:
        times = _told[text, words].times + 1 if (text, words) in _told else 1
        _told.keep((text, words), Told(text, words, time.monotonic() - _start, times), MOST)


def _source(file: str, line: int) -> str:
    """A line of source, and where it is."""
    if not Path(file).is_relative_to(_PACKAGE):
        return "(words that are not the extension's own)"
    return f"{linecache.getline(file, line).strip()} [{_place(file, line)}]"


def _place(file: str, line: int | None) -> str:
    return f"{Path(file).relative_to(_PACKAGE).as_posix()}:{line}"


def _frames(error: BaseException) -> list[traceback.FrameSummary]:
    """Those in files of the extension."""
    frames = traceback.StackSummary.extract(traceback.walk_tb(error.__traceback__), lookup_lines=False)
    return [frame for frame in frames if Path(frame.filename).is_relative_to(_PACKAGE)]
