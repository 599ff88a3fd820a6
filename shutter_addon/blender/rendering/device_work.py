"""What a session's device does: functions that are called one after the other, on a thread of their own where the
device is not Blender's."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Any, NamedTuple, TypeVar

from ...core import stopping
from ...core.stopping import StoppedError
from ..devices import main_thread
from ..devices.blender_gpu import require_context
from .render_job import Where, where

T = TypeVar("T")
_PATIENCE = 0.1  # seconds between two looks at whether a picture is still wanted


class Work(NamedTuple):
    """What a session's device does.

    future: its result to come; ended: set, it ends before its next step; relayed: the main thread has its GPU"""

    future: Future
    ended: threading.Event
    relayed: bool

    def break_off(self) -> None:
        self.ended.set()
        self.future.cancel()

    def result(self) -> Any:
        """As result_of. Not waited for, it is broken off."""
        try:
            return result_of(self.future, self.relayed)
        except StoppedError:
            self.break_off()
            raise


def result_of(future: Future[T], relayed: bool) -> T:
    """The future's result. StoppedError: it is not wanted any longer (`stopping.once`). NoDeviceError: it cannot be
    waited for, as Blender's GPU is not current."""
    is_window = where() is Where.WINDOW
    while not wait([future], 0 if is_window else _PATIENCE).done:
        if is_window and not main_thread.serve() and relayed:
            require_context()
        stopping.check()
    return future.result()


def broken_off(stopped: Callable[[], bool], function: Callable[..., T], *arguments: object) -> T:
    """What a function gives, unless it is broken off."""
    with stopping.once(stopped):
        return function(*arguments)
