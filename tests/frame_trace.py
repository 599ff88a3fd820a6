"""The way of a frame through the extension: its stops, which are the functions that make it, in the order in which they
are first called; and how often it comes back to a room that it had left.

A room is a folder of the extension: blender, compute, core, features or media."""

import sys
import threading
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

_TOOL = 4  # of sys.monitoring's, one for nobody in particular
_AHEAD = "Virtual Shutter"  # the thread that decodes frames ahead, whenever it comes to them


class Stop(NamedTuple):
    """path: of the file, below shutter_addon; function: its qualified name; within: the rooms that wait for it"""

    path: str
    function: str
    within: frozenset[str]

    @property
    def room(self) -> str:
        return _room(self.path)


def _room(path: str) -> str:
    return path.partition("/")[0]


@contextmanager
def traced(package: Path, first: str, last: str):
    """Gives a list, to which what runs inside adds its Stops: from the first call of the function `first` to the next
    return of `last`, both by qualified name."""
    stops, events, has_ended = [], sys.monitoring.events, threading.Event()

    def below(code) -> str | None:
        path = Path(code.co_filename)
        return path.relative_to(package).as_posix() if path.is_relative_to(package) else None

    def waiting() -> frozenset[str]:
        """The rooms of the functions that wait for the one that has started, on this thread or on the main one."""
        main, frames = threading.main_thread(), [sys._getframe(2).f_back]
        if threading.current_thread() is not main:
            frames.append(sys._current_frames()[main.ident])
        rooms = set()
        for frame in frames:
            while frame is not None:
                if path := below(frame.f_code):
                    rooms.add(_room(path))
                frame = frame.f_back
        return frozenset(rooms)

    def started(code, _offset):
        path, name = below(code), code.co_qualname
        is_named = not name.endswith((">", "__"))  # unlike lambdas, and what reads an attribute
        if path is None or not is_named:
            return sys.monitoring.DISABLE
        if has_ended.is_set() or threading.current_thread().name == _AHEAD or not (stops or name == first):
            return None
        stops.append(Stop(path, name.replace(".<locals>", ""), waiting()))
        return sys.monitoring.DISABLE

    def returned(code, _offset, _value):
        if stops and code.co_qualname == last and below(code):
            has_ended.set()

    sys.monitoring.use_tool_id(_TOOL, "frame_trace")
    sys.monitoring.register_callback(_TOOL, events.PY_START, started)
    sys.monitoring.register_callback(_TOOL, events.PY_RETURN, returned)
    sys.monitoring.set_events(_TOOL, events.PY_START | events.PY_RETURN)
    sys.monitoring.restart_events()
    try:
        yield stops
    finally:
        sys.monitoring.set_events(_TOOL, 0)  # they would slow the process down for good
        sys.monitoring.free_tool_id(_TOOL)


def returns(stops: list[Stop]) -> list[Stop]:
    """The stops at which a frame comes back to a room that it had left: it was there before, and nothing there waits
    for it."""
    seen, back = set(), []
    for before, stop in pairwise([stops[0], *stops]):
        if stop.room != before.room and stop.room in seen and stop.room not in stop.within:
            back.append(stop)
        seen.add(stop.room)
    return back
