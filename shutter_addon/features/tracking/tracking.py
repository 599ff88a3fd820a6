"""Tracks what a region covers through footage, from the frame at which it was drawn. No bpy.

Each frame is compared with the first one, so that tracks do not drift. Only where that fails, it is compared with the
last frame in which the subject was surely found.
"""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ...core.messages import MediaError
from ...core.model import motions, scribbles
from ...core.model.effect import Region, Subject
from ...core.model.motions import Motion, Placement, Similarity
from ...media.footage import Footage
from . import registration
from .part_tracking import FoundMotion, PartTracker, distinctness
from .registration import Part

PATIENCE = 25  # frames for which a lost subject is searched

# Why tracking ends early, and why it cannot begin.
SHOT_ENDS = "the shot ends here"
FEW = "there are too few corners to follow"
EMPTY = "the region has no strokes to follow"
OUTSIDE = "the region lies outside the picture"
ALONE = "there is no other frame to track"
NOT_SHOWN = "the frame lies outside what can be tracked"

# Distances from a region, in heights of the picture, within which corners are looked for until there are _ENOUGH.
_REACHES = {"line": (0.015, 0.03, 0.06, 0.12, 0.24), "lasso": (0.0, 0.015, 0.03, 0.06, 0.12)}
_ENOUGH = 14
# The distance within which corners belong to the region, and how many must. With fewer, the confidence falls to _FAR.
_NEAR, _ENOUGH_NEAR, _FAR = 0.03, 3, 0.3


class TrackingError(MediaError, ValueError):
    """Nothing can be tracked. The message is one sentence."""


@dataclass(frozen=True)
class Tracked:
    """A region's placement at a frame, with its confidence, 0 to 1.

    If it has a fault (a sentence), tracking ended before this frame, and the frame gets no key.
    """

    frame: int
    placement: Placement
    confidence: float
    fault: str = ""


class Pursuit(Protocol):
    """Follows something from frame to frame.

    Attributes:
        reason: why it was not found in the last frame
    """

    reason: str

    def next(self, frame: int) -> FoundMotion | None:
        """Return its motion to a frame, or None if it is not found."""


class Track(ABC):
    """Tracks a subject, a region or the camera. Call `follow` once."""

    def __init__(self, subject: Subject) -> None:
        """Track a subject. Its placement is known at the first frame and at anchors."""
        self._subject = subject

    def follow(
        self, footage: Footage, start: int, frames: range, *, motion: Motion = "scale", anchors: Collection[int] = ()
    ) -> Iterator[Tracked]:
        """Yield placements at timeline frames: at `start`, then after it, then before it.

        A direction that ends early ends with a Tracked that has a fault. If a gap is left on the way to an anchor,
        there is a fault on each side of it.

        Args:
            footage: the pictures
            start: the first frame
            frames: all frames that may be tracked, with `start`
            motion: what changes: "location", also "rotation", or also "scale"
            anchors: frames with correct placements. Tracking ends at the nearest one on each side. Frames in between
                are then yielded again, blended with tracking back from the anchor.

        Raises:
            TrackingError: at once, if nothing can be tracked
            MediaError: while iterating, if a frame cannot be read
        """
        self._footage, self._motion = footage, motion
        centres = {frame: self._subject.centre(frame) for frame in frames}
        self._centres = {frame: centre for frame, centre in centres.items() if centre is not None}
        if len(self._centres) < len(centres):
            raise TrackingError(EMPTY)
        if start not in frames:
            raise TrackingError(NOT_SHOWN)
        if len(frames) < 2:
            raise TrackingError(ALONE)
        self._tracker(start)
        return self._both_ways(start, range(min(frames), max(frames) + 1), {*anchors} - {start})

    @abstractmethod
    def _tracker(self, start: int) -> tuple[Pursuit, float]:
        """Return the tracker of what `start` shows, and the confidence that this is the subject.

        Raises:
            TrackingError: there is nothing to follow
        """

    def _both_ways(self, start: int, frames: range, anchors: set[int]) -> Iterator[Tracked]:
        yield Tracked(frame=start, placement=self._subject.placement(start), confidence=1.0)
        for rest in (range(start + 1, frames.stop), range(start - 1, frames.start - 1, -1)):
            anchor = next((frame for frame in rest if frame in anchors), None)
            if anchor is None:
                yield from self._onward(start, rest)
            else:
                yield from self._between(start, anchor)

    def _onward(self, start: int, frames: range) -> Iterator[Tracked]:
        """Track away from `start` in a direction without an anchor."""
        return self._from(start, frames)

    def _placement(self, frame: int) -> Placement:
        """Return the placement at a frame where tracking starts."""
        return self._subject.placement(frame)

    def _between(self, start: int, anchor: int) -> Iterator[Tracked]:
        """Track from `start` to an anchor, then yield frames blended with tracking back."""
        step = 1 if anchor > start else -1
        there, back, faults = {}, {}, []
        for tracked in self._from(start, range(start + step, anchor, step)):
            if tracked.fault:
                faults.append(tracked)
            else:
                there[tracked.frame] = tracked
                yield tracked
        with suppress(TrackingError):  # of the anchor: only what was tracked from the start counts
            returning = list(self._from(anchor, range(anchor - step, start, -step)))
            back = {tracked.frame: tracked for tracked in returning if not tracked.fault}
            faults += [tracked for tracked in returning if tracked.fault]
        for frame in range(start + step, anchor, step):
            share = (frame - start) / (anchor - start)
            if blended := _blended(there.get(frame), back.get(frame), share):
                yield blended
        yield Tracked(frame=anchor, placement=self._subject.placement(anchor), confidence=1.0)
        yield from (fault for fault in faults if fault.frame not in there | back)

    def _from(self, start: int, frames: range) -> Iterator[Tracked]:
        """Track frames in order, away from `start`."""
        self._footage.want(frames)
        tracker, worth = self._tracker(start)
        last, shown = Tracked(frame=start, placement=self._placement(start), confidence=1.0), start
        lost: list[int] = []
        for frame in frames:
            self._footage.picture(frame)  # frames are read in order before cuts are looked for
            if self._footage.cut(shown, frame):
                fault = tracker.reason if lost else SHOT_ENDS
                yield Tracked(frame=(lost or [frame])[0], placement=last.placement, confidence=0.0, fault=fault)
                return
            sighting, shown = tracker.next(frame), frame
            if sighting is None:
                lost.append(frame)
                if len(lost) > PATIENCE:
                    break
                continue
            placement = self._carried(start, frame, sighting.motion, last.placement)
            seen = Tracked(frame=frame, placement=placement, confidence=worth * sighting.confidence)
            yield from self._bridged(last, seen, lost)
            last, lost = seen, []
            yield last
        if lost:
            yield Tracked(frame=lost[0], placement=last.placement, confidence=0.0, fault=tracker.reason)

    def _carried(self, origin: int, frame: int, motion: Similarity, near: Placement) -> Placement:
        before, after = self._centres[origin], self._centres[frame]
        moved = motions.carried(self._placement(origin), motion, before, after, self._footage.size)
        return motions.unwound(moved, near)

    def _bridged(self, last: Tracked, seen: Tracked, lost: list[int]) -> Iterator[Tracked]:
        """Yield frames without the subject, on a straight path between their neighbors, whatever is redrawn."""
        for missing in lost:
            share = (missing - last.frame) / (seen.frame - last.frame)
            centre = (1 - share) * self._centres[last.frame] + share * self._centres[seen.frame]
            straight = motions.between(last.placement, seen.placement, share)
            x, y = (float(number) for number in np.add(straight.location, centre) - self._centres[missing])
            yield Tracked(frame=missing, placement=replace(straight, location=(x, y)), confidence=0.0)


class RegionTrack(Track):
    """Tracks what a region covers."""

    _subject: Region

    def __init__(self, region: Region) -> None:
        super().__init__(region)
        self._parts: dict[int, tuple[Part, float]] = {}  # by start: both directions learn what belongs to it

    def _part(self, frame: int) -> tuple[Part, float]:
        """Return the part of a frame that the region covers, and the confidence that its corners belong to it.

        Corners far from the region may belong to something else; so may those of a repeated pattern.
        """
        shape, (width, height) = self._subject.at(frame), self._footage.size
        covered = scribbles.rasterise([replace(shape, shutter=0)], width, height) > 0
        if not covered.any():
            raise TrackingError(OUTSIDE)
        picture, away = self._footage.picture(frame), registration.distances(covered)
        for reach in [share * height for share in _REACHES[shape.kind]]:
            part = Part(picture, _falloff(away, reach))
            if len(part.points) >= _ENOUGH:
                break
        if len(part.points) < registration.FEWEST[self._motion]:
            raise TrackingError(FEW)
        near = _falloff(away[part.points.imag.astype(int), part.points.real.astype(int)], _NEAR * height).sum()
        return part, min(float(np.clip(near / _ENOUGH_NEAR, _FAR, 1)), distinctness(part, width))

    def _tracker(self, start: int) -> tuple[PartTracker, float]:
        if start not in self._parts:
            self._parts[start] = self._part(start)
        part, worth = self._parts[start]
        return PartTracker(part, self._footage, start, self._motion), worth


def _falloff(away: np.ndarray, reach: float) -> np.ndarray:
    """Return the weights of pixels, 0 … 1 float32, from their distance to a region; 0 beyond the reach."""
    return np.where(away <= reach, np.exp(-2 * (away / max(reach, 1e-9)) ** 2), 0).astype(np.float32)


def _blended(first: Tracked | None, second: Tracked | None, share: float) -> Tracked | None:
    """Blend two results for a frame by their confidence, and by the share of the way from the first start to the
    second.

    None: there is neither.
    """
    if first is None or second is None:
        return first or second
    weights = (1 - share) * (first.confidence + 1e-3), share * (second.confidence + 1e-3)
    share = weights[1] / sum(weights)
    placement = motions.between(first.placement, second.placement, share)
    return Tracked(
        frame=first.frame, placement=placement, confidence=(1 - share) * first.confidence + share * second.confidence
    )
