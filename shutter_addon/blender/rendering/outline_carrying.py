"""Mattes of outlines that previews lack, or that are asked for: carried by a thread beside Blender. In previews
straight ones stand in for them meanwhile."""

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

TICK = 0.25  # seconds from one look at the thread to the next


@dataclass
class _Carrying:
    """The mattes that a thread carries: it touches no bpy.

    frames: what is to come, the source frames of a file, those first that are drawn, then those nearest to a middle
    done: how many are there by now
    arrived: called on Blender's main thread when what is drawn is there, and when all is"""

    file: CarriedFile
    frames: list[int]
    arrived: Callable[[], None]
    middle: int | None = None  # None: that of the frames
    done: int = 0
    told: int = 0  # how many were there when `arrived` was called
    ended: threading.Event = field(default_factory=threading.Event)
    soon: int = field(init=False)  # how many of the frames are drawn
    future: Future = field(init=False)

    def __post_init__(self) -> None:
        drawn = {frame for frame, _curves in self.file.drawings}
        middle = sorted(self.frames)[len(self.frames) // 2] if self.middle is None else self.middle
        self.frames.sort(key=lambda frame: (frame not in drawn, abs(frame - middle)))
        self.soon = len(drawn & set(self.frames)) or 1
        self.future = threads.start(self._carry)

    def _carry(self) -> None:
        with stopping.once(self.ended.is_set), closing(self.file.open()) as mattes:
            for frame in self.frames:
                mattes.read(frame)
                self.done += 1


_wanted: dict[CarriedFile, set[int]] = {}  # what was lacking since the last look
_failed: dict[CarriedFile, str] = {}  # why they cannot be carried
_running: list[_Carrying] = []  # one at most


def want(file: CarriedFile, frame: int) -> None:
    """Notes a matte that a preview lacks, by its source frame."""
    if file not in _failed:
        _wanted.setdefault(file, set()).add(frame)


def begin(arrived: Callable[[], None]) -> str | None:
    """Carries what was wanted since the last call, in place of what is not wanted any longer: on Blender's main thread,
    once a preview was drawn. Why something cannot be carried; None: nothing is lacking, or it is on its way.

    arrived: called when it is there"""
    wanted = {file: frames for file, frames in _wanted.items() if file not in _failed}
    _wanted.clear()
    if wanted and not (_running and _running[0].file in wanted):
        file, frames = next(iter(wanted.items()))
        carry(file, list(frames), arrived)
    return next(iter(_failed.values()), None)


def carry(file: CarriedFile, frames: list[int], arrived: Callable[[], None], middle: int | None = None) -> None:
    """Carries the mattes of source frames, in place of what is on its way, from a middle outwards; arrived: as for
    `begin`."""
    stop()
    _failed.pop(file, None)
    _running.append(_Carrying(file=file, frames=frames, arrived=arrived, middle=middle))
    main_thread.later(_look, TICK)


def failure(file: CarriedFile) -> str | None:
    """Why the mattes of a file could not be carried."""
    return _failed.get(file)


def progress() -> tuple[int, int] | None:
    """How many mattes are carried, and of how many; None: none are on their way."""
    return (_running[0].done, len(_running[0].frames)) if _running else None


def _look() -> float | None:
    """What has come is shown."""
    if not _running:
        return None
    carrying = _running[0]
    preview_areas.redraw(bpy.context)
    if not carrying.future.done():
        if carrying.done >= carrying.soon > carrying.told:  # what was mended is to be seen at once
            carrying.told = carrying.done
            carrying.arrived()
        return TICK
    _running.clear()
    try:
        carrying.future.result()
    except stopping.StoppedError:
        return None
    except Exception as error:  # Blender would end the timer, and the file be asked for again and again
        _failed[carrying.file] = in_words(error)
    carrying.arrived()
    return None


def stop() -> None:
    """Ends what is on its way; what is carried stays."""
    for carrying in _running:
        carrying.ended.set()
    _running.clear()


def forget(*_: object) -> None:
    """Ends what runs: when a file is loaded, and when the extension goes."""
    stop()
    _wanted.clear()
    _failed.clear()
