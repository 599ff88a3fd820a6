"""Track what a region covers through footage, from the frame at which it was drawn. No bpy.

Each frame is compared with the first one, so that tracks do not drift. Only where that fails, it is compared with the
last frame in which the subject was surely found.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from ...core.messages import MediaError
from ...core.model import motions, scribbles
from ...core.model.effect import Region, Subject
from ...core.model.motions import Motion, Placement, Similarity
from ...media.footage import Footage
from . import registration
from .registration import Match, TrackedPart

PATIENCE = 25  # frames for which a lost subject is searched

# Why tracking ends early, and why it cannot begin.
COVERED = "the subject is covered, or looks too different"
LEFT = "the subject has left the picture"
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

# Confidences:
SURE = 0.5  # from here on, errors are within about a pixel of 640
_LOST = 0.12  # below, nothing was found
_AGAIN = 0.3  # below, nothing was found in a search of a larger area
_DRIFT, _LEAST = 0.95, 0.1  # the factor for a later look, and its least confidence
_SHIFTED = 0.6  # the factor if only the location was found, without rotation and scale
_FADING = 0.6  # below, a later look is compared as well
_REPEATED = 0.3  # the factor for a part that looks like its surroundings

_AROUND = 0.05  # the least search radius in widths of the picture
# Corners are traced back through _BACK frames. At least _TRACED of them must be traced, or the trust becomes _UNTRACED
# of it. They may be off by _ASTRAY lengths of the part; _AGREEING of them must not be.
_BACK, _TRACED, _UNTRACED, _ASTRAY, _AGREEING = 8, 0.1, 0.85, 0.15, 0.5
_KEPT = 0.999  # the most of the trust that a step keeps
_BRIEF, _LEFT = 8, 3  # unsure frames after which a subject is lost: between sure ones, and at the end of a track
_NONE = np.zeros(0, complex)


class TrackingError(MediaError, ValueError):
    """Nothing can be tracked. The message is one sentence, which the interface translates."""


@dataclass(frozen=True)
class Tracked:
    """Where tracking has placed a region or the camera at a frame, or why it failed there.

    Attributes:
        frame: Timeline frame.
        placement: Location, rotation and scale; with a fault, those of the last frame found before.
        confidence: How sure the placement is, 0 to 1; 0 for a fault, and for a guess between frames where it was found.
        fault: "": none. Otherwise why tracking stopped before this frame (in its direction); no keyframe is made of it.
    """

    frame: int
    placement: Placement
    confidence: float
    fault: str = ""


class FoundMotion(NamedTuple):
    """A motion that was found, from one picture, mostly that where tracking began, to another one.

    Attributes:
        confidence: How sure it is, 0 to 1.
        held: Positions in the other picture of the corners that agree with it, (n,) complex; empty if not needed.
    """

    motion: Similarity
    confidence: float
    held: np.ndarray = _NONE


class PartTracker:
    """Follows a part of a picture from frame to frame.

    It is found by how it looked in the picture where tracking began (its first look) or, where that fails, in the last
    picture in which it was found (a later look).

    Attributes:
        reason: Why it was not found in the last picture, one of this module's sentences.
    """

    def __init__(self, part: TrackedPart, footage: Footage, frame: int, motion: Motion) -> None:
        """Prepare to follow a part.

        Args:
            part: The part, taken from the picture of `frame`.
            footage: The pictures.
            frame: The timeline frame where tracking begins.
            motion: What changes, as in Track.follow.
        """
        self._first, self._footage, self._motion, self.reason = part, footage, motion, COVERED
        # the motion to the last picture in which it was found, and its last step
        self._known = self._speed = Similarity()
        self._missed = 0  # pictures since then
        self._look = _Look(part, Similarity(), 1.0)  # how it looked later, if it has changed
        # the last pictures in which it was found, with motion and confidence
        self._seen = deque([(footage.picture(frame), Similarity(), 1.0)], _BACK)
        self._trust = 1.0  # the confidence that this is still the part

    def next(self, frame: int) -> FoundMotion | None:
        """Return the part's motion from the picture where tracking began to that of a frame; None: it is not found."""
        picture, missed = self._footage.picture(frame), self._missed
        sighting = None if missed else self._near(picture, self._speed.after(self._known))
        if sighting is None:
            self._look_anew()
            sighting = self._elsewhere(picture, missed)
        if sighting is None:
            if not missed:
                going_on = self._speed.after(self._speed).after(self._known)(self._first.points)
                self.reason = LEFT if registration.inside(picture, going_on).mean() < 0.5 else COVERED
            self._missed += 1
            return None
        self._speed = sighting.motion.after(self._known.inverse()) if not missed else Similarity()
        self._trust = self._trusted(picture, sighting, goes_on=not missed)
        self._known, self._missed = sighting.motion, 0
        if missed:
            self._seen.clear()
        self._seen.append((picture, sighting.motion, sighting.confidence))
        return FoundMotion(sighting.motion, self._trust)

    def _trusted(self, picture: np.ndarray, sighting: FoundMotion, goes_on: bool) -> float:
        """Return how sure it is that what was found is still the part, 0 to 1.

        This is the trust of the picture before (0 if the part was not found there), times _KEPT and the result of
        `_held` (_UNTRACED for None). If that is 1 or None, it rises to the confidence of what was found; but not from
        below SURE to SURE or more, if something else in the picture looks like the part, too.

        Args:
            sighting: What was found in the picture.
            goes_on: Whether the part was found in the picture before.
        """
        held = self._held(picture, sighting) if goes_on else None
        kept = _KEPT * self._trust * (_UNTRACED if held is None else held) if goes_on else 0.0
        if sighting.confidence <= kept or (held is not None and held < 1):
            return kept
        was_lost = sighting.confidence >= SURE and (self._trust < SURE or not goes_on)
        return kept if was_lost and self._first.lookalike(picture, sighting.motion) else sighting.confidence

    def _held(self, picture: np.ndarray, sighting: FoundMotion) -> float | None:
        """Return how well the found corners lead back to the part, 0 to 1; None: too few can be traced back.

        They are traced back some pictures by optical flow. If tracking slipped onto something else, they are not at the
        part's place there. The result is the share that is, divided by _AGREEING; at most 1.
        """
        pictures, back = [picture, *(each[0] for each in reversed(self._seen))], sighting.motion.inverse()
        step = self._known.after(back)(sighting.held) - sighting.held
        traced = registration.traced(pictures, sighting.held, step)
        off = np.abs(traced - self._seen[0][1].after(back)(sighting.held))[np.isfinite(traced)]
        if len(off) < _TRACED * len(traced):
            return None
        return min(float((off < _ASTRAY * max(self._first.box[2:])).mean()) / _AGREEING, 1.0)

    def _near(self, picture: np.ndarray, guess: Similarity) -> FoundMotion | None:
        """Find the part near a guessed place, by its first look or, if that is unsure, a later one; None: not found."""
        match = self._first.find(picture, guess, self._motion)
        sure = confidence(match, picture)
        if match and sure >= SURE:
            self._first.learn(match)
        if sure < _FADING:
            later = self._by_later_look(picture, guess)
            if later is None and sure < _LOST:
                return None
            points = self._first.points
            if later and sure < SURE and np.abs(later.motion(points) - guess(points)).max() > 1:
                # starting from there, the first look may be found
                again = self._first.find(picture, later.motion, self._motion)
                if confidence(again, picture) > sure:
                    match, sure = again, confidence(again, picture)
            if later and sure < min(SURE, later.confidence):
                return later
        return FoundMotion(match.motion, sure, match.held) if match else None

    def _by_later_look(self, picture: np.ndarray, guess: Similarity) -> FoundMotion | None:
        if self._look.part is self._first:
            self._look_anew()
        sighting = self._look.find(picture, guess, self._motion)
        if sighting is None or sighting.confidence < SURE * self._look.worth:
            self._look_anew()
            sighting = self._look.find(picture, guess, self._motion) or sighting
        return sighting

    def _look_anew(self) -> None:
        """Remember how the part looks in the last picture in which it was found."""
        picture, motion, worth = self._seen[-1]
        if later := self._first.again(picture, motion):
            self._look = _Look(later, motion, max(_DRIFT * worth, _LEAST))

    def _elsewhere(self, picture: np.ndarray, missed: int) -> FoundMotion | None:
        """Search a larger area around its last place for a part that was lost, by its first look and a later one.

        Args:
            missed: The number of pictures in a row, before this one, in which it was not found. The area grows with it.

        Returns:
            The surest result; None: it is not found.
        """
        radius = _AROUND * picture.shape[1] * (1 + missed / 4)
        sightings = []
        for look in (_Look(self._first, Similarity(), 1.0), self._look):
            from_there = self._known.after(look.motion.inverse())
            for guess in (from_there, look.part.seek(picture, from_there, radius)):
                match = look.part.find(picture, guess, self._motion) if guess else None
                if match and (sure := confidence(match, picture)) >= _AGAIN:
                    sightings.append(FoundMotion(match.motion.after(look.motion), look.worth * sure, match.held))
        return max(sightings, key=lambda each: each.confidence, default=None)


@dataclass(frozen=True)
class _Look:
    """How a part looked in one picture.

    Attributes:
        part: The part, taken from that picture.
        motion: From the picture where tracking began to that one.
        worth: How sure it is that this was the part, 0 to 1.
    """

    part: TrackedPart
    motion: Similarity
    worth: float

    def find(self, picture: np.ndarray, guess: Similarity, motion: Motion) -> FoundMotion | None:
        """Find the part in a picture; None: it is not found.

        If its corners do not agree on a motion of the wanted kind, only its location is found, with less confidence.

        Args:
            guess: The motion to expect, from the picture where tracking began to this one.
            motion: What changes, as in Track.follow.
        """
        guess = guess.after(self.motion.inverse())
        ways: list[tuple[Motion, float]] = [(motion, 1.0), ("location", _SHIFTED)]
        for way, share in ways:
            match = self.part.find(picture, guess, way)
            if match and (sure := confidence(match, picture)) >= _LOST:
                return FoundMotion(match.motion.after(self.motion), share * self.worth * sure, match.held)
        return None


def confidence(match: Match | None, picture: np.ndarray) -> float:
    """Return how sure a match is, 0 to 1; 0 if the match is None.

    It depends on its expected error, on how many corners are inside the picture and how many of these agree, and on how
    alike the pixels are. The more alike they are, the fewer corners have to agree.

    Args:
        picture: In which the part was found; gives the scale of errors.
    """
    if match is None:
        return 0.0
    error = match.error * 640 / max(picture.shape)
    likeness = max(match.likeness, 0.0)
    factors = likeness / 0.6, match.share / (0.9 - 0.6 * likeness), match.visible / 0.6
    return float(np.prod([min(factor, 1.0) for factor in factors])) / (1 + (error / 0.7) ** 2)


def lost(frames: np.ndarray, sure: np.ndarray) -> int | None:
    """Return the frame at which a subject was lost; None: nowhere.

    That is the first frame of the first long stretch of unsure frames. If this begins with the first frame of all,
    tracking came from later ones, and it is the last frame of the stretch.

    Args:
        frames: Tracked timeline frames (n,), ascending.
        sure: (n,), how sure tracking was at each, 0 to 1.
    """
    ends = np.flatnonzero(np.diff(np.concatenate([[False], sure < SURE, [False]])))
    for first, end in ends.reshape(-1, 2):
        if end - first >= (_BRIEF if first > 0 and end < len(frames) else _LEFT):
            return int(frames[first if first else end - 1])
    return None


def distinctness(part: TrackedPart, width: int) -> float:
    """Return how sure it is that a part is not confused with its surroundings, _REPEATED to 1.

    Args:
        width: Of the picture in pixels.
    """
    return float(np.clip((1 - part.rival(_AROUND * width)) / (1 - registration.ALIKE), _REPEATED, 1))


class MotionTracker(Protocol):
    """Follows something from frame to frame.

    Attributes:
        reason: Why it was not found in the last frame.
    """

    reason: str

    def next(self, frame: int) -> FoundMotion | None:
        """Return the motion of what is followed, from the first frame to this one; None: it is not found."""


class Track(ABC):
    """Tracks a subject, a region or the camera, through timeline frames. Call `follow` once."""

    def __init__(self, subject: Subject) -> None:
        """Prepare to track a subject, which says where it is at the frame where tracking starts and at anchors."""
        self._subject = subject

    def follow(
        self, footage: Footage, start: int, frames: range, *, motion: Motion = "scale", anchors: Collection[int] = ()
    ) -> Iterator[Tracked]:
        """Yield where the subject is (Tracked) at timeline frames: at `start`, then after it, then before it.

        If tracking ends early in a direction, the last Tracked there has a fault. If frames on the way to an anchor are
        not found from either side, there is a fault at each end of the gap.

        Args:
            footage: The pictures.
            start: The frame where tracking starts.
            frames: All frames that may be tracked, including `start`.
            motion: What changes: "location", "rotation" (and location), or "scale" (and both).
            anchors: Frames where the subject's own placement is right, such as the user's keyframes. In each direction,
                tracking ends at the nearest one. Frames up to there are then yielded again, blended with tracking back
                from the anchor.

        Raises:
            TrackingError: Nothing can be tracked.
            MediaError: A frame cannot be read.
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
        yield from self._both_ways(start, range(min(frames), max(frames) + 1), {*anchors} - {start})

    @abstractmethod
    def _tracker(self, start: int) -> tuple[MotionTracker, float]:
        """Return a tracker of the subject as shown at `start`, and a factor 0 to 1 for all its confidences.

        Raises:
            TrackingError: There is nothing to follow.
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
        """Yield where the subject is at frames that lead away from `start`, in a direction without an anchor."""
        return self._from(start, frames)

    def _placement(self, frame: int) -> Placement:
        """Return the location, rotation and scale that the subject's own data give at a frame where tracking starts."""
        return self._subject.placement(frame)

    def _between(self, start: int, anchor: int) -> Iterator[Tracked]:
        """Track from `start` to an anchor, then yield the frames between again, blended with tracking back from it."""
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
        """Yield where the subject is at frames that lead away from `start`, in order, until it is lost or at a cut."""
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
        """Yield guessed placements of frames where the subject was not found, with the confidence 0.

        Rotation, scale and the place of the subject's middle are interpolated linearly in time.

        Args:
            last: The subject in the last frame before them.
            seen: The subject in the first frame after them, in the direction of tracking.
            lost: These frames.
        """
        for missing in lost:
            share = (missing - last.frame) / (seen.frame - last.frame)
            centre = (1 - share) * self._centres[last.frame] + share * self._centres[seen.frame]
            straight = motions.between(last.placement, seen.placement, share)
            x, y = (float(number) for number in np.add(straight.location, centre) - self._centres[missing])
            yield Tracked(frame=missing, placement=replace(straight, location=(x, y)), confidence=0.0)


class RegionTrack(Track):
    """Tracks what a region's strokes cover, by its corners."""

    _subject: Region

    def __init__(self, region: Region) -> None:
        super().__init__(region)
        self._parts: dict[int, tuple[TrackedPart, float]] = {}  # by start: both directions learn what belongs to it

    def _part(self, frame: int) -> tuple[TrackedPart, float]:
        """Return the part of a frame that the region covers, and how sure it is that its corners belong to it, 0 to 1.

        Corners far from the region may belong to something else; so may those of a repeated pattern.

        Raises:
            TrackingError: The region is outside the picture, or has too few corners.
        """
        shape, (width, height) = self._subject.at(frame), self._footage.size
        covered = scribbles.rasterise([replace(shape, shutter=0)], width, height) > 0
        if not covered.any():
            raise TrackingError(OUTSIDE)
        picture, away = self._footage.picture(frame), registration.distances(covered)
        for reach in [share * height for share in _REACHES[shape.kind]]:
            part = TrackedPart(picture, _falloff(away, reach))
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
    """Return the weight of pixels, float32, 1 to 0, by their distance to a region.

    Args:
        away: The distance of each, in pixels.
        reach: Distance beyond which the weight is 0.
    """
    return np.where(away <= reach, np.exp(-2 * (away / max(reach, 1e-9)) ** 2), 0).astype(np.float32)


def _blended(first: Tracked | None, second: Tracked | None, share: float) -> Tracked | None:
    """Blend two results of tracking for the same frame, from two starts; None if both are None.

    Each weighs more, the surer it is and the nearer its start.

    Args:
        first: From the first start; None: not found.
        second: From the second start; None: not found.
        share: How far the frame is on the way from the first start to the second, 0 to 1.
    """
    if first is None or second is None:
        return first or second
    weights = (1 - share) * (first.confidence + 1e-3), share * (second.confidence + 1e-3)
    share = weights[1] / sum(weights)
    placement = motions.between(first.placement, second.placement, share)
    return Tracked(
        frame=first.frame, placement=placement, confidence=(1 - share) * first.confidence + share * second.confidence
    )
