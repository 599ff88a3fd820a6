"""Make the mattes of tracked outlines that previews lack, on a background thread.

Until they are made, previews show outlines that move straight from drawing to drawing.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import closing
from dataclasses import dataclass, field

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ....blender.data import preview_areas
from ....blender.devices import main_thread
from ....blender.rendering import previews
from ....blender.rendering.effect_source import in_words
from ....core import stopping, threads
from ..subject_mattes import CarriedFile

TICK = 0.25  # seconds between two looks at the thread


@dataclass
class _Carrying:
    """A background thread that makes mattes of one outline or subject, and its progress. The thread touches no bpy.

    Attributes:
        file: Makes the mattes and stores them.
        frames: The frames of the footage, from 0, that need a matte. The thread takes those with a drawing first, then
            the others by their distance to `middle`.
        middle: The frame of the footage near which to begin. None: the middle one of `frames`.
        done: How many mattes the thread has made.
        redrawn_at: What `done` was when previews were redrawn to show the frames with a drawing; 0: not yet.
        ended: Set this to stop the thread.
        soon: How many of `frames` have a drawing, at least 1. Previews are redrawn when that many mattes are made.
        future: Is done when the thread has ended. Its result is None, or it raises the thread's exception.
    """

    file: CarriedFile
    frames: list[int]
    middle: int | None = None
    done: int = 0
    redrawn_at: int = 0
    ended: threading.Event = field(default_factory=threading.Event)
    soon: int = field(init=False)
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


@dataclass
class _Mattes:
    """The mattes that previews lack.

    Attributes:
        wanted: The frames of the footage whose mattes a preview lacked, by file. note_tracking clears it.
        failed: Why the mattes of a file could not be made, as a sentence. They are not tried again until `carry` is
            called.
        carrying: The thread that makes mattes; None: none is running.
    """

    wanted: dict[CarriedFile, set[int]] = field(default_factory=dict)
    failed: dict[CarriedFile, str] = field(default_factory=dict)
    carrying: _Carrying | None = None


_mattes = _Mattes()


def want_matte(file: CarriedFile, frame: int) -> None:
    """Note that a preview lacks the matte of a frame of the footage."""
    if file not in _mattes.failed:
        _mattes.wanted.setdefault(file, set()).add(frame)


def carry(file: CarriedFile, frames: list[int], middle: int | None = None) -> None:
    """Start a thread that makes mattes of an outline or subject. Stop the thread that makes others, if one is running.

    Args:
        file: Makes the mattes and stores them. If making its mattes failed before, it is tried again.
        frames: The frames of the footage, from 0, that need a matte. The list is sorted in place.
        middle: The frame near which to begin, after the frames that have a drawing. None: the middle one of `frames`.
    """
    stop()
    _mattes.failed.pop(file, None)
    _mattes.carrying = _Carrying(file=file, frames=frames, middle=middle)
    main_thread.later(_look, TICK)


def failure(file: CarriedFile) -> str | None:
    """Return why the mattes of a file could not be made; None: nothing failed."""
    return _mattes.failed.get(file)


def progress() -> tuple[int, int] | None:
    """Return how many mattes the thread has made and how many it has to make; None: none are being made."""
    carrying = _mattes.carrying
    return (carrying.done, len(carrying.frames)) if carrying else None


def note_tracking(say: Callable[[str], None]) -> None:
    """Start to make the mattes that a preview lacked when it was drawn, and add notes to it: progress and a failure.

    If the thread makes mattes of something that the preview does not lack, it is stopped for what is lacking. If
    several outlines or subjects lack mattes, one begins; the others follow when a preview asks for them after that.

    Call this on the main thread after drawing a preview.

    Args:
        say: Adds a note to the preview.
    """
    wanted = {file: frames for file, frames in _mattes.wanted.items() if file not in _mattes.failed}
    _mattes.wanted.clear()
    if wanted and not (_mattes.carrying and _mattes.carrying.file in wanted):
        file, frames = next(iter(wanted.items()))
        carry(file, list(frames))
    for fault in list(_mattes.failed.values())[:1]:
        say(rpt_("Shutter: {fault}").format(fault=fault))
    if (made := progress()) is not None:
        done, total = made
        say(rpt_("Tracking the outline: {done} of {total} frames").format(done=done, total=total))


def _look() -> float | None:
    """Follow the thread that makes mattes, and redraw previews, which tell its progress.

    They get its mattes when the frames with a drawing are done, and when the thread has ended, unless it was stopped.
    If it failed, the reason is noted.

    Returns:
        The seconds after which Blender, of which this is a timer, calls it again; None ends the timer.
    """
    if (carrying := _mattes.carrying) is None:
        return None
    preview_areas.redraw(bpy.context)
    if not carrying.future.done():
        if carrying.done >= carrying.soon > carrying.redrawn_at:  # show drawings as soon as they are corrected
            carrying.redrawn_at = carrying.done
            previews.show_carried()
        return TICK
    _mattes.carrying = None
    try:
        carrying.future.result()
    except stopping.StoppedError:
        return None
    except Exception as error:  # otherwise Blender ends the timer, and previews start over again
        _mattes.failed[carrying.file] = in_words(error)
    previews.show_carried()
    return None


def stop() -> None:
    """Stop making mattes. Those that are finished stay."""
    if _mattes.carrying is not None:
        _mattes.carrying.ended.set()
        _mattes.carrying = None


def forget_pictures() -> None:
    """Stop making mattes and forget which are wanted, when a file is loaded or the extension is disabled."""
    stop()
    _mattes.wanted.clear()
    _mattes.failed.clear()
