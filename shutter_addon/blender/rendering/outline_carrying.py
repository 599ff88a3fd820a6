"""Mattes of tracked outlines for previews, made by a background thread. Until they are there, linear ones are shown."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import closing
from dataclasses import dataclass, field

import bpy

from ...core import stopping, threads
from ...media.carried_mattes import CarriedFile
from ..data import preview_areas
from ..devices import main_thread
from .effect_source import in_words

TICK = 0.25  # seconds between two looks at the thread


@dataclass
class _Carrying:
    """The mattes that a thread makes. It touches no bpy.

    Attributes:
        frames: Source frames to make, drawn ones first.
        arrived: Called on the main thread when the drawn ones are done, and at the end.
        done: How many are made.
        told: How many were made when `arrived` was called.
        soon: How many of the frames are drawn.
    """

    file: CarriedFile
    frames: list[int]
    arrived: Callable[[], None]
    done: int = 0
    told: int = 0
    ended: threading.Event = field(default_factory=threading.Event)
    soon: int = field(init=False)
    future: Future = field(init=False)

    def __post_init__(self) -> None:
        drawn = {frame for frame, _curves in self.file.drawings}
        self.frames.sort(key=lambda frame: (frame not in drawn, frame))
        self.soon = len(drawn & set(self.frames))
        self.future = threads.start(self._carry)

    def _carry(self) -> None:
        with stopping.once(self.ended.is_set), closing(self.file.open()) as mattes:
            for frame in self.frames:
                mattes.read(frame)
                self.done += 1


_wanted: dict[CarriedFile, set[int]] = {}  # source frames that previews have missed since the last `begin`
_failed: dict[CarriedFile, str] = {}  # why mattes could not be made
_running: list[_Carrying] = []  # one at most


def want(file: CarriedFile, frame: int) -> None:
    """Note the source frame of a matte that a preview misses."""
    if file not in _failed:
        _wanted.setdefault(file, set()).add(frame)


def begin(arrived: Callable[[], None]) -> str | None:
    """Make the mattes that were missed since the last call, in place of those that are not wanted any more.

    Called on the main thread after a preview was drawn.

    Args:
        arrived: Called when they are made.

    Returns:
        Why mattes cannot be made, or None.
    """
    wanted = {file: frames for file, frames in _wanted.items() if file not in _failed}
    _wanted.clear()
    if wanted and not (_running and _running[0].file in wanted):
        file, frames = next(iter(wanted.items()))
        carry(file, list(frames), arrived)
    return next(iter(_failed.values()), None)


def carry(file: CarriedFile, frames: list[int], arrived: Callable[[], None]) -> None:
    """Make the mattes of source frames, in place of those being made. `arrived` is as in `begin`."""
    stop()
    _failed.pop(file, None)
    _running.append(_Carrying(file=file, frames=frames, arrived=arrived))
    main_thread.later(_look, TICK)


def failure(file: CarriedFile) -> str | None:
    """Return why the mattes of a file could not be made, or None."""
    return _failed.get(file)


def progress() -> tuple[int, int] | None:
    """Return how many mattes are made, and of how many; None: none are being made."""
    return (_running[0].done, len(_running[0].frames)) if _running else None


def _look() -> float | None:
    """Show what is made, as a timer."""
    if not _running:
        return None
    carrying = _running[0]
    preview_areas.redraw(bpy.context)
    if not carrying.future.done():
        if carrying.done >= carrying.soon > carrying.told:  # show drawings as soon as they are corrected
            carrying.told = carrying.done
            carrying.arrived()
        return TICK
    _running.clear()
    try:
        carrying.future.result()
    except stopping.StoppedError:
        return None
    except Exception as error:  # otherwise Blender ends the timer, and previews start over again
        _failed[carrying.file] = in_words(error)
    carrying.arrived()
    return None


def stop() -> None:
    """Stop making mattes; finished ones stay."""
    for carrying in _running:
        carrying.ended.set()
    _running.clear()


def forget(*_: object) -> None:
    """Stop and forget everything, when a file is loaded or the extension is disabled."""
    stop()
    _wanted.clear()
    _failed.clear()
