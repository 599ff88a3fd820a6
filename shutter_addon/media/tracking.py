"""Following what a region covers through footage, from the frame at which it was drawn.

Every frame is compared with the one that tracking started from, so that what is found does not drift; only where that
fails, with the last one in which the subject was surely seen. No bpy.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, takewhile
from typing import Protocol

import numpy as np

from ..core import stopping
from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.model import motions, scribbles
from ..core.model.effect import Camera, Region
from ..core.model.motions import Placement, Similarity
from . import registration
from .errors import MediaError
from .registration import Match, Motion, Part

WIDTH = 960  # pixels of the pictures that are compared, at most, along their longer side
PATIENCE = 25  # frames for which a lost subject is looked for
AHEAD = 8  # frames that the source may decode in advance
BLOCK = 48  # frames that are read at once where tracking goes backward: movies are decoded upwards alone
KEPT = 256  # grey pictures that are kept, of half a megabyte each

# Why tracking ends before its last frame, and why it cannot begin.
SHOT_ENDS = "the shot ends here"
COVERED = "the subject is covered, or looks too different"
LEFT = "the subject has left the picture"
FEW = "there are too few corners to follow"
EMPTY = "the region has no strokes to follow"
OUTSIDE = "the region lies outside the picture"
ALONE = "there is no other frame to track"
NOT_SHOWN = "the frame lies outside what can be tracked"

SURE = 0.5  # from here on a frame is within about a pixel of 640
_LOST = 0.12  # below it nothing was found
_AGAIN = 0.3  # below it nothing was found where it might be anywhere
_DOUBTFUL = 0.2  # below it, it may as well be anywhere
_DRIFT, _LEAST = 0.95, 0.1  # what a later look is worth beside the one before it, and at least
_SHIFTED = 0.6  # what a location is worth where rotation and scale could not be found
_FADING = 0.6  # below it another frame is taken to compare with beside the first
_UNLIKE = 0.4  # what a look is worth that an anchor's contradicts, where nothing tells which one is the subject's
_ASKED = 4  # anchors on each side that are asked
# Heights of the picture around a region within which corners are looked for, as far as there are not enough of them.
_REACHES = {"line": (0.015, 0.03, 0.06, 0.12, 0.24), "lasso": (0.0, 0.015, 0.03, 0.06, 0.12)}
_ENOUGH = 14
_AROUND = 0.05  # widths of the picture around its place within which it is sought at least
# So far from it corners still are its own, and so many have to be; what others may say of it, for they may belong to
# something else.
_NEAR, _ENOUGH_NEAR, _FAR = 0.03, 3, 0.3
_REPEATED = 0.3  # what a part is worth that looks like what is beside it


class TrackingError(MediaError, ValueError):
    """Nothing can be tracked from there; the message is one sentence."""


@dataclass(frozen=True)
class Tracked:
    """Where a region is at a frame; confidence: 0 to 1. With a fault, a sentence, tracking ended before this frame, and
    the frame is not to be keyed."""

    frame: int
    placement: Placement
    confidence: float
    fault: str = ""


class Footage:
    """What a strip shows, for tracking: grey pictures of a size that is enough for it.

    size: width and height of the pictures; index_at: the source's frame that is shown at a timeline frame"""

    def __init__(self, source: FrameSource, index_at: Callable[[int], int]):
        """MediaError: OpenCV is missing."""
        registration.check()
        self._source, self._index_at = source, index_at
        share = min(1.0, WIDTH / max(source.width, source.height))
        self.size = max(1, round(source.width * share)), max(1, round(source.height * share))
        self._kept: dict[int, np.ndarray] = {}
        self._wanted: Sequence[int] = ()

    def want(self, frames: Sequence[int]) -> None:
        """Says which timeline frames will be asked for, in this order."""
        self._wanted = frames

    def picture(self, frame: int) -> np.ndarray:
        """The picture (H, W) uint8 at a timeline frame. MediaError: it cannot be read. Tracking may end here
        (core.stopping)."""
        stopping.check()
        index = self._index_at(frame)
        if index not in self._kept:
            self._read(index, *self._beside(frame))
        return self._kept[index]

    def cut(self, before: int, after: int) -> bool:
        """Whether there is a cut between what two timeline frames show."""
        first, second = self._index_at(before), self._index_at(after)
        return self._cut(min(first, second), max(first, second))

    def _cut(self, low: int, high: int) -> bool:
        shots = self._source.shots
        return shots is not None and low != high and high not in shots.around(low, low, high)

    def _beside(self, frame: int) -> tuple[int, list[int]]:
        """The source's frame that is shown before a wanted frame, and those that are lacking behind it, in order."""
        if frame not in self._wanted:
            return self._index_at(frame), []
        place = self._wanted.index(frame)
        before = self._index_at(self._wanted[place - 1] if place else frame)
        upcoming = dict.fromkeys(map(self._index_at, self._wanted[place + 1 : place + BLOCK]))
        return before, [index for index in upcoming if index not in self._kept]

    def _read(self, index: int, before: int, upcoming: list[int]) -> None:
        """Reads a frame, and those that come next if they lie before it."""
        backward = [i for i in upcoming if i < index]
        block = sorted({index, *backward})
        self._source.want([*block, *(upcoming[:AHEAD] if not backward else ())])
        last = min(before, block[0])
        for i in block:
            stopping.check()
            self._cut(last, i)  # so that frames are read upwards, and once, to find cuts
            self._kept[i], last = self._grey(self._source.read(i)), i
        while len(self._kept) > KEPT:
            del self._kept[next(iter(self._kept))]

    def _grey(self, frame: np.ndarray) -> np.ndarray:
        """Over black: colours that are hidden may be anything."""
        alpha = self._source.alpha
        if frame.dtype != np.uint8:
            frame, alpha = _levels(light.over_black(frame, alpha), self._source.transfer), "opaque"
        return registration.grey(frame, self.size, alpha)


def _levels(frame: np.ndarray, transfer: str) -> np.ndarray:
    """Samples, of 16 bits or floats from 0 to 1, as levels of 8 bits, as they are shown."""
    if frame.dtype == np.uint16:
        return (frame >> 8).astype(np.uint8)
    return np.rint(255 * (light.to_encoded(frame) if transfer == "linear" else frame)).astype(np.uint8)


def follow(
    region: Region,
    footage: Footage,
    start: int,
    frames: range,
    *,
    motion: Motion = "scale",
    anchors: Collection[int] = (),
) -> Iterator[Tracked]:
    """Where a region is at frames of the timeline, if it moves with what it covers at `start`: that frame itself, then
    those behind it, then those before it.

    region: its drawings are evaluated at all of the frames; location, rotation and scale at `start` and at anchors
    frames: all that may be tracked, `start` among them
    motion: what changes beside the location: "rotation", or "scale" and rotation
    anchors: frames whose placement is right as it is. Tracking ends at the nearest one on each side; what lies between
    comes a second time then, blended with what is tracked back from there. What the region covers is compared with what
    it covers there, so that a frame in which something lies over the subject does not count as its look: anchors beyond
    `frames` are of use, too.
    A direction that ends early ends with a Tracked that has a fault; where a gap is left on the way to an anchor, there
    is one on each side of it. TrackingError: nothing can be tracked from there.
    MediaError, while it goes on: a frame cannot be read."""
    check_frames(start, frames)
    return _RegionTrack(region, footage, motion, {*frames, *anchors}).both_ways(start, frames, anchors)


def check_frames(start: int, frames: range) -> None:
    """TrackingError: from there nothing can be tracked through these frames."""
    if start not in frames:
        raise TrackingError(NOT_SHOWN)
    if len(frames) < 2:
        raise TrackingError(ALONE)


class Pursuit(Protocol):
    """What is looked for in one frame after another.

    reason: why it was not found in the last one"""

    reason: str

    def next(self, frame: int) -> tuple[Similarity, float] | None:
        """The motion from the first picture to a frame's, and its confidence; None: it is not there."""


class Track(ABC):
    """What tracking a subject, a region or the camera, needs to know."""

    def __init__(self, subject: Region | Camera, footage: Footage, motion: Motion, frames: Collection[int]):
        """frames: all at which the subject's centre is asked for."""
        self._subject, self._footage, self._motion = subject, footage, motion
        self._centres = {frame: subject.centre(frame) for frame in frames}
        if any(centre is None for centre in self._centres.values()):
            raise TrackingError(EMPTY)
        self._parts: dict[int, tuple[Part, float]] = {}

    def part(self, frame: int) -> tuple[Part, float]:
        """What is seen of the subject at a frame, and how surely its corners are those of the subject, up to 1.
        TrackingError: there is nothing to follow."""
        if frame not in self._parts:
            self._parts[frame] = self._part(frame)
        return self._parts[frame]

    @abstractmethod
    def _part(self, frame: int) -> tuple[Part, float]:
        """As `part`, which keeps it."""

    @abstractmethod
    def _pursuit(self, start: int) -> tuple[int, Pursuit, float]:
        """The frame whose look is searched for from `start` on, the pursuit of it, and what that is worth."""

    def both_ways(self, start: int, frames: range, anchors: Collection[int]) -> Iterator[Tracked]:
        """As `follow`. TrackingError, at once: nothing can be tracked from there."""
        self.part(start)
        return self._both_ways(start, range(min(frames), max(frames) + 1), {*anchors} - {start})

    def _both_ways(self, start: int, frames: range, anchors: set[int]) -> Iterator[Tracked]:
        yield Tracked(start, self._subject.placement(start), 1.0)
        for rest in (range(start + 1, frames.stop), range(start - 1, frames.start - 1, -1)):
            anchor = next((frame for frame in rest if frame in anchors), None)
            if anchor is None:
                yield from self._onward(start, rest)
            else:
                yield from self._between(start, anchor)

    def _onward(self, start: int, frames: range) -> Iterator[Tracked]:
        """Frames one after another, away from `start`, where no anchor waits."""
        return self._from(start, frames)

    def _placement(self, frame: int) -> Placement:
        """Where it is at a frame that something is tracked from."""
        return self._subject.placement(frame)

    def _between(self, start: int, anchor: int) -> Iterator[Tracked]:
        """From `start` towards an anchor, and then blended with the way back from there."""
        step = 1 if anchor > start else -1
        there, back, faults = {}, {}, []
        for found in self._from(start, range(start + step, anchor, step)):
            if found.fault:
                faults.append(found)
            else:
                there[found.frame] = found
                yield found
        if self._has_part(anchor):  # or what was found from the start alone has to do
            returning = list(self._from(anchor, range(anchor - step, start, -step)))
            back = {found.frame: found for found in returning if not found.fault}
            faults += [found for found in returning if found.fault]
        for frame in range(start + step, anchor, step):
            share = (frame - start) / (anchor - start)
            if blended := _blended(there.get(frame), back.get(frame), share):
                yield blended
        yield Tracked(anchor, self._subject.placement(anchor), 1.0)
        yield from (fault for fault in faults if fault.frame not in there | back)

    def _from(self, start: int, frames: range) -> Iterator[Tracked]:
        """Frames one after another, away from `start`."""
        self._footage.want(frames)
        origin, pursuit, worth = self._pursuit(start)
        last, shown, lost = Tracked(start, self._placement(start), 1.0), start, []
        for frame in frames:
            self._footage.picture(frame)  # in the order in which they are read, before cuts are looked for
            if self._footage.cut(shown, frame):
                fault = pursuit.reason if lost else SHOT_ENDS
                yield Tracked((lost or [frame])[0], last.placement, 0.0, fault)
                return
            found, shown = pursuit.next(frame), frame
            if found is None:
                lost.append(frame)
                if len(lost) > PATIENCE:
                    break
                continue
            seen = Tracked(frame, self._carried(origin, frame, found[0], last.placement), worth * found[1])
            yield from self._bridged(last, seen, lost)
            last, lost = seen, []
            yield last
        if lost:
            yield Tracked(lost[0], last.placement, 0.0, pursuit.reason)

    def _has_part(self, frame: int) -> bool:
        try:
            self.part(frame)
        except TrackingError:
            return False
        return True

    def _carried(self, origin: int, frame: int, motion: Similarity, near: Placement) -> Placement:
        before, after = self._centres[origin], self._centres[frame]
        moved = motions.carried(self._placement(origin), motion, before, after, self._footage.size)
        return motions.unwound(moved, near)

    def _bridged(self, last: Tracked, found: Tracked, lost: list[int]) -> Iterator[Tracked]:
        """Frames at which the subject was not seen, on a straight way between those beside them, however the shape is
        redrawn meanwhile."""
        for missing in lost:
            share = (missing - last.frame) / (found.frame - last.frame)
            centre = (1 - share) * self._centres[last.frame] + share * self._centres[found.frame]
            straight = motions.between(last.placement, found.placement, share)
            x, y = (float(number) for number in straight.location + centre - self._centres[missing])
            yield Tracked(missing, replace(straight, location=(x, y)), 0.0)


class _RegionTrack(Track):
    """Tracks what a region covers."""

    def __init__(self, region: Region, *arguments):
        super().__init__(region, *arguments)
        self._doubted: dict[int, int | None] = {}

    def _part(self, frame: int) -> tuple[Part, float]:
        """Corners far from the region are less surely its own; those of a pattern may be those of its next period."""
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

    def _both_ways(self, start: int, frames: range, anchors: set[int]) -> Iterator[Tracked]:
        self._doubted = self._doubts(start, sorted(anchors), {*frames, *anchors})
        yield from super()._both_ways(start, frames, anchors)

    def _pursuit(self, start: int) -> tuple[int, _Pursuit, float]:
        origin = self._doubted.get(start, start)
        if origin is None:
            part, worth = self.part(start)
            return start, _Pursuit(part, self._footage, start, self._motion), _UNLIKE * worth
        part, worth = self.part(origin)
        known = None if origin == start else self._known(origin, start)
        return origin, _Pursuit(part, self._footage, origin, self._motion, known), worth

    def _doubts(self, start: int, anchors: list[int], shown: set[int]) -> dict[int, int | None]:
        """Of `start` and the anchors beside it those where something else may lie over the subject, each with a frame
        whose look is surely the subject's, or None. shown: the frames that can be looked at."""
        alike, rivals = [start], []
        for side in ([a for a in anchors if a > start], [a for a in reversed(anchors) if a < start]):
            before = start
            for anchor in filter(self._has_part, side[:_ASKED]):
                if not self._alike(before, anchor):
                    rivals += [] if self._cut(start, anchor) else [anchor]
                    break
                alike.append(anchor)
                before = anchor
        surer = {rival: self._surer(start, rival, shown) for rival in rivals}
        if all(look == start for look in surer.values()):
            return dict.fromkeys(rivals, start)
        sure = [rival for rival in rivals if surer[rival] == rival]
        unsure = [rival for rival in rivals if surer[rival] != rival]
        return dict.fromkeys(alike, next(iter(sure), None)) | dict.fromkeys(unsure)

    def _alike(self, frame: int, other: int) -> bool:
        """Whether the region covers at one frame what it covers at another, as far as corners tell."""
        return self._is_seen_at(frame, other) or self._is_seen_at(other, frame)

    def _is_seen_at(self, frame: int, other: int) -> bool:
        """Whether the look of a frame may be seen where the region is at another one."""
        picture = self._footage.picture(other)
        match = self.part(frame)[0].find(picture, self._known(frame, other), self._motion)
        return confidence(match, picture) >= _DOUBTFUL

    def _surer(self, frame: int, other: int, shown: set[int]) -> int | None:
        """Of two frames the one whose look is the subject's: it is seen again behind the other one, but not the other's
        behind this one. None: that does not tell."""
        first, second = self._is_seen_behind(frame, other, shown), self._is_seen_behind(other, frame, shown)
        return None if first == second else frame if first else other

    def _is_seen_behind(self, frame: int, other: int, shown: set[int]) -> bool:
        """Whether the look of a frame is surely seen soon behind another one."""
        step = 1 if other > frame else -1
        behind = range(other + step, other + step * (PATIENCE + 1), step)
        behind = list(takewhile(shown.__contains__, behind))
        self._footage.want(behind)
        pursuit = _Pursuit(self.part(frame)[0], self._footage, frame, self._motion, self._known(frame, other))
        for each in behind:
            if self._footage.cut(each - step, each):
                break
            found = pursuit.next(each)
            if found and found[1] >= SURE:
                return True
        return False

    def _cut(self, frame: int, other: int) -> bool:
        return any(self._footage.cut(*pair) for pair in pairwise(range(min(frame, other), max(frame, other) + 1)))

    def _known(self, frame: int, other: int) -> Similarity:
        """The motion from one frame to another, both of which have a right placement."""
        both = ((self._subject.placement(each), self._centres[each]) for each in (frame, other))
        placements, centres = zip(*both, strict=True)
        return motions.motion_between(*placements, *centres, self._footage.size)


class _Pursuit:
    """A part of a picture, looked for in one picture after another.

    reason: why it was not found in the last one"""

    def __init__(self, part: Part, footage: Footage, frame: int, motion: Motion, known: Similarity | None = None):
        """frame: the part's; known: the motion up to a frame in which the part is, but cannot be seen; the next one
        comes after that. None: it comes after the part's."""
        self._first, self._footage, self._motion, self.reason = part, footage, motion, COVERED
        # the motion up to the last picture in which it was found, and its last step
        self._known, self._speed = known or Similarity(), Similarity()
        self._missed = 0 if known is None else 1  # for how many pictures it was not found
        self._look = _Look(part, Similarity(), 1.0)  # how it looked later, if it is no longer like the first
        # the last picture in which it was found, the motion, its confidence
        self._seen = footage.picture(frame), Similarity(), 1.0

    def next(self, frame: int) -> tuple[Similarity, float] | None:
        """The motion from the first picture to a frame's, and its confidence; None: it is not there."""
        picture, missed = self._footage.picture(frame), self._missed
        found = None if missed else self._found(picture, self._speed.after(self._known))
        if found is None:
            self._look_anew()
            found = self._found_elsewhere(picture, missed, self._look)
        elif found[1] < _DOUBTFUL:
            found = self._found_elsewhere(picture, missed) or found
        if found is None:
            if not missed:
                self.reason = LEFT if self._leaves(picture) else COVERED
            self._missed += 1
            return None
        self._speed = found[0].after(self._known.inverse()) if not missed else Similarity()
        self._known, self._seen, self._missed = found[0], (picture, *found), 0
        return found

    def _found(self, picture, guess: Similarity) -> tuple[Similarity, float] | None:
        """As `next`, near to a guess: as it looked first or, if that is not sure, as it looked later."""
        match = self._first.find(picture, guess, self._motion)
        sure = confidence(match, picture)
        if sure >= SURE:
            self._first.learn(match)
        if sure >= _FADING:
            return match.motion, sure
        later = self._by_later_look(picture, guess)
        if later is None:
            return (match.motion, sure) if sure >= _LOST else None
        points = self._first.points
        if sure < SURE and np.abs(later[0](points) - guess(points)).max() > 1:
            # from there the first look may be near enough
            again = self._first.find(picture, later[0], self._motion)
            if confidence(again, picture) > sure:
                match, sure = again, confidence(again, picture)
        return (match.motion, sure) if sure >= min(SURE, later[1]) else later

    def _by_later_look(self, picture, guess: Similarity) -> tuple[Similarity, float] | None:
        if self._look.part is self._first:
            self._look_anew()
        found = self._look.find(picture, guess, self._motion)
        if found is None or found[1] < SURE * self._look.worth:
            self._look_anew()
            found = self._look.find(picture, guess, self._motion) or found
        return found

    def _look_anew(self) -> None:
        """Takes the look that it had when it was found last."""
        picture, motion, worth = self._seen
        if later := self._first.again(picture, motion):
            self._look = _Look(later, motion, max(_DRIFT * worth, _LEAST))

    def _found_elsewhere(self, picture, missed: int, *looks: _Look) -> tuple[Similarity, float] | None:
        """As `_found`, of all places where it may be by now; only if it looks as it did first, or as in other looks."""
        radius = _AROUND * picture.shape[1] * (1 + missed / 4)
        found = []
        for look in (_Look(self._first, Similarity(), 1.0), *looks):
            from_there = self._known.after(look.motion.inverse())
            for guess in (from_there, look.part.seek(picture, from_there, radius)):
                match = guess and look.part.find(picture, guess, self._motion)
                if (sure := confidence(match, picture)) >= _AGAIN:
                    found.append((match.motion.after(look.motion), look.worth * sure))
        return max(found, key=lambda each: each[1], default=None)

    def _leaves(self, picture) -> bool:
        """Whether most of the part would lie outside of the picture if it went on."""
        places = self._speed.after(self._speed).after(self._known)(self._first.points)
        height, width = picture.shape
        inside = (places.real >= 0) & (places.real < width) & (places.imag >= 0) & (places.imag < height)
        return inside.mean() < 0.5


@dataclass(frozen=True)
class _Look:
    """How a part looked in some picture; motion: from the first picture to that one; worth: the confidence of that."""

    part: Part
    motion: Similarity
    worth: float

    def find(self, picture, guess: Similarity, motion: Motion) -> tuple[Similarity, float] | None:
        """The motion from the first picture, and its confidence: by corners or, where these do not agree on the
        motion, on the location alone."""
        guess = guess.after(self.motion.inverse())
        for way, share in ((motion, 1.0), ("location", _SHIFTED)):
            match = self.part.find(picture, guess, way)
            if (sure := confidence(match, picture)) >= _LOST:
                return match.motion.after(self.motion), share * self.worth * sure
        return None


def confidence(match: Match | None, picture: np.ndarray) -> float:
    """How sure a match is, 0 to 1: by its expected error, how many corners agree, and how like the pixels are: the more
    alike, the fewer corners have to agree."""
    if match is None:
        return 0.0
    error = match.error * 640 / max(picture.shape)
    likeness = max(match.likeness, 0.0)
    factors = likeness / 0.6, match.share / (0.9 - 0.6 * likeness), match.visible / 0.6
    return float(np.prod([min(factor, 1.0) for factor in factors])) / (1 + (error / 0.7) ** 2)


def distinctness(part: Part, width: int) -> float:
    """How sure it is that a part is not taken for what is beside it in a picture of that width, up to 1."""
    return float(np.clip((1 - part.rival(_AROUND * width)) / (1 - registration.ALIKE), _REPEATED, 1))


def _falloff(away: np.ndarray, reach: float) -> np.ndarray:
    """How much pixels count that are so far away from a region, 0 to 1 float32; none beyond the reach."""
    return np.where(away <= reach, np.exp(-2 * (away / max(reach, 1e-9)) ** 2), 0).astype(np.float32)


def _blended(first: Tracked | None, second: Tracked | None, share: float) -> Tracked | None:
    """What two ways say of a frame, a share of the way from the first one's start to the second one's; the surer one
    counts for more. None: neither says anything."""
    if first is None or second is None:
        return first or second
    weights = (1 - share) * (first.confidence + 1e-3), share * (second.confidence + 1e-3)
    share = weights[1] / sum(weights)
    placement = motions.between(first.placement, second.placement, share)
    return Tracked(first.frame, placement, (1 - share) * first.confidence + share * second.confidence)
