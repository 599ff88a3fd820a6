"""The last errors and warnings that users were told, for a report of an error: in memory alone, a hundred at most."""

import sys
import threading
import time
import traceback
from pathlib import Path
from typing import NamedTuple

from .messages import sentence

MOST = 100  # sentences
_PACKAGE = Path(__file__).parents[1]
_CALLS = 8  # of a traceback
_start = time.monotonic()
_lock = threading.Lock()  # films are rendered on threads of their own


class Told(NamedTuple):
    """A sentence as it was shown, names included; `templates.plain` takes these out.

    place: of the extension's code that raised it, "": not known; is_plain: it quotes nothing
    seconds: after the start, when it was told last; times: how often that was"""

    text: str
    place: str
    is_plain: bool
    seconds: float
    times: int


_told: dict[tuple[str, str], Told] = {}  # in the order in which they were told last


def record(text: object) -> None:
    """Keeps a sentence that a user is told, and where the error that is being handled was raised."""
    _keep(sentence(text), _place(sys.exception()))


def shown(text: object) -> None:
    """As `record`, for what is drawn again and again: it counts once."""
    line = sentence(text)
    with _lock:
        is_known = any(known == line for known, _ in _told)
    if not is_known:
        record(line)


def exception(error: BaseException) -> None:
    """Keeps an error that nobody expected: its type and calls of the extension's code, not what it says."""
    _keep(type(error).__name__, _calls(error), is_plain=True)


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


def _keep(text: str, place: str, is_plain: bool = False) -> None:
    with _lock:
        known = _told.pop((text, place), None)
        times = known.times + 1 if known else 1
        _told[text, place] = Told(text, place, is_plain, time.monotonic() - _start, times)
        while len(_told) > MOST:
            del _told[next(iter(_told))]


def _place(error: BaseException | None) -> str:
    frames = _frames(error) if error else []
    return _in_words(frames[-1]) if frames else ""


def _calls(error: BaseException) -> str:
    """The innermost first."""
    return " < ".join(f"{_in_words(frame)} {frame.name}" for frame in reversed(_frames(error)[-_CALLS:]))


def _frames(error: BaseException) -> list[traceback.FrameSummary]:
    """Those in files of the extension."""
    frames = traceback.StackSummary.extract(traceback.walk_tb(error.__traceback__), lookup_lines=False)
    return [frame for frame in frames if Path(frame.filename).is_relative_to(_PACKAGE)]


def _in_words(frame: traceback.FrameSummary) -> str:
    return f"{Path(frame.filename).relative_to(_PACKAGE).as_posix()}:{frame.lineno}"
