"""Which functions of the extension make a frame, in the order in which they are first called: its stops.

A room is a folder of the extension, as docs/developers.md lists them. Where the next stop lies in a room that was left
before, the frame returns to it."""

import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

TOOL = 4  # one that sys.monitoring has for nobody in particular
_UNNAMED = "<"  # of modules, lambdas and comprehensions


class Stop(NamedTuple):
    """path: below shutter_addon, in POSIX's way; function: its qualified name"""

    path: str
    function: str

    @property
    def room(self) -> str:
        parts = self.path.split("/")
        return "/".join(parts[:2]) if parts[0] == "blender" and len(parts) > 2 else parts[0]


@contextmanager
def traced(package: Path):
    """Gives a list of Stops, which what runs inside adds to, if it lies below the package's folder. Frames that are
    decoded ahead, on a thread of their own, do not count: they come whenever they come."""
    stops: list[Stop] = []

    def started(code, _offset):
        if threading.current_thread().name == "Virtual Shutter":
            return None
        path = Path(code.co_filename)
        last = code.co_qualname.rpartition(".")[2]
        if path.is_relative_to(package) and not last.startswith((_UNNAMED, "__")):
            stops.append(Stop(path.relative_to(package).as_posix(), code.co_qualname.replace(".<locals>", "")))
        return sys.monitoring.DISABLE

    events = sys.monitoring.events.PY_START
    sys.monitoring.use_tool_id(TOOL, "frame_trace")
    sys.monitoring.register_callback(TOOL, events, started)
    sys.monitoring.set_events(TOOL, events)
    sys.monitoring.restart_events()
    try:
        yield stops
    finally:
        sys.monitoring.set_events(TOOL, 0)
        sys.monitoring.free_tool_id(TOOL)


def returns(stops: list[Stop]) -> list[Stop]:
    """The stops at which a frame comes back to a room that it had left."""
    left, last, back = set(), None, []
    for stop in stops:
        if stop.room != last:
            if stop.room in left:
                back.append(stop)
            left.add(last)
            last = stop.room
    return back
