"""Tracking through filmed frames, each of them once and in their order, whichever a strip shows and how often.

Where a strip shows a moment between two of them, what is tracked goes straight from one to the other.
No bpy.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Generic, TypeVar

import numpy as np

from ..core.model import motions, scribbles
from ..core.model.effect import Camera, OutlineRegion, Region
from ..core.model.motions import Placement
from .tracking import EMPTY, Subject, Tracked, TrackingError

S = TypeVar("S", Region, OutlineRegion, Camera)


class FilmedFrames:
    """The filmed frames that timeline frames show, by their places among these, from 0 on.

    indices: which ones; frames: all places; timeline: by place, the timeline frame at which it is seen
    start: that of the timeline frame from which is tracked"""

    def __init__(self, times: Mapping[int, float], start: int) -> None:
        """times: by timeline frame, in filmed frames from 0 on; a fraction is a moment between two of them.
        start: one of the timeline frames"""
        self._times, self._begin = times, start
        nearest: dict[int, tuple] = {}
        for frame, time in times.items():
            for index in {math.floor(time), math.ceil(time)}:
                key = abs(time - index), abs(frame - start), frame
                nearest[index] = min(key, nearest.get(index, key))
        index = round(times[start])
        nearest[index] = (0, 0, start)
        self.indices = sorted(nearest)
        self.frames = range(len(self.indices))
        self._places = {index: place for place, index in enumerate(self.indices)}
        self.timeline = [nearest[index][-1] for index in self.indices]
        self.start = self._places[index]

    def index_at(self, place: int) -> int:
        return self.indices[place]

    def seen(self, subject: S) -> _Seen[S]:
        """A subject as tracking asks for it, at places in place of timeline frames."""
        return _Seen(subject, self.timeline)

    def on_timeline(self, subject: Subject, tracked: Iterable[Tracked], size: tuple[int, int]) -> Iterator[Tracked]:
        """What was tracked by places, by timeline frames: the start, those behind it, those before it. A direction that
        ends early ends with a fault; size: width and height of the picture."""
        known, faults = {}, {}
        for each in tracked:
            if each.fault:
                faults[each.frame] = each.fault
            else:
                known[each.frame] = each
        first, centre = subject.placement(self._begin), _centre(subject, self._begin)
        # where the frame is a moment between two, a filmed one beside it was tracked from as if it were that
        origin = (self._between(subject, self._begin, known) or known[self.start]).placement
        yield Tracked(frame=self._begin, placement=first, confidence=1.0)
        for rest in (range(self._begin + 1, max(self._times) + 1), range(self._begin - 1, min(self._times) - 1, -1)):
            told = set()
            for frame in rest:
                there, fault = self._between(subject, frame, known), self._fault(frame, faults, known)
                if fault is not None and fault not in told:
                    told.add(fault)
                    yield Tracked(frame=frame, placement=first, confidence=0.0, fault=faults[fault])
                if there is None:
                    continue
                after = _centre(subject, frame)
                motion = motions.motion_between(origin, there.placement, centre, after, size)
                moved = motions.unwound(motions.carried(first, motion, centre, after, size), there.placement)
                yield replace(there, placement=moved)

    def _fault(self, frame: int, faults: Mapping[int, str], known: Mapping[int, Tracked]) -> int | None:
        """The place of the fault by which what a timeline frame shows was not tracked, or was tracked anew; or None."""
        for place in self._beside(frame):
            if place not in known:
                side = 1 if place > self.start else -1
                passed = [at for at in faults if 0 < side * (at - self.start) <= side * (place - self.start)]
                return max(passed, key=lambda at: side * at)
            if place in faults:
                return place
        return None

    def _beside(self, frame: int) -> tuple[int, int]:
        """The places of the filmed frames beside what a timeline frame shows; one twice, where it shows that."""
        time = self._times[frame]
        return self._places[math.floor(time)], self._places[math.ceil(time)]

    def _between(self, subject: Subject, frame: int, known: Mapping[int, Tracked]) -> Tracked | None:
        """Where it is at a timeline frame, by the filmed frames beside that; None: one of them was not tracked."""
        before, after = (known.get(place) for place in self._beside(frame))
        if before is None or after is None:
            return None
        first, second = (self._placed(subject, each, frame) for each in (before, after))
        placement = motions.between(first, second, self._times[frame] % 1)
        return Tracked(frame=frame, placement=placement, confidence=min(before.confidence, after.confidence))

    def _placed(self, subject: Subject, tracked: Tracked, frame: int) -> Placement:
        """A placement in another timeline frame's drawing, which may lie elsewhere."""
        moved = np.add(tracked.placement.location, _centre(subject, self.timeline[tracked.frame]))
        x, y = (float(number) for number in moved - _centre(subject, frame))
        return replace(tracked.placement, location=(x, y))


def _centre(subject: Subject, frame: int) -> np.ndarray:
    """TrackingError: nothing is drawn there."""
    if (centre := subject.centre(frame)) is None:
        raise TrackingError(EMPTY)
    return centre


class _Seen(Generic[S]):
    def __init__(self, subject: S, frames: list[int]) -> None:
        self._subject: S = subject
        self._frames = frames

    def at(self: _Seen[Region], place: int) -> scribbles.Shape:
        return self._subject.at(self._frames[place])

    def placement(self, place: int) -> Placement:
        return self._subject.placement(self._frames[place])

    def centre(self, place: int) -> np.ndarray | None:
        return self._subject.centre(self._frames[place])
