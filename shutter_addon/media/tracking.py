"""Following what a region covers through footage, from the frame at which it was drawn.

Every frame is compared with the one that tracking started from, so that what is found does not drift; only where that
fails, with the last one in which the subject was surely seen. No bpy.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..core import motions, scribbles
from ..core.effect import Region
from ..core.frame_source import FrameSource
from ..core.motions import Placement, Similarity
from . import registration
from .errors import MediaError
from .registration import Match, Motion, Part, cv2

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
_REACHES = 0.015, 0.03, 0.06, 0.12, 0.24  # heights of the picture around a line within which corners are looked for
_ENOUGH = 14  # corners, where a shorter reach is enough


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
        self._upcoming: list[int] = []

    def want(self, frames: list[int]) -> None:
        """Says which timeline frames will be asked for next, in this order."""
        self._upcoming = list(dict.fromkeys(self._index_at(frame) for frame in frames))

    def picture(self, frame: int) -> np.ndarray:
        """The picture (H, W) uint8 at a timeline frame. MediaError: it cannot be read."""
        index = self._index_at(frame)
        if index not in self._kept:
            self._read(index)
        return self._kept[index]

    def cut(self, before: int, after: int) -> bool:
        """Whether there is a cut between what two timeline frames show."""
        first, second = self._index_at(before), self._index_at(after)
        return self._cut(min(first, second), max(first, second))

    def _cut(self, low: int, high: int) -> bool:
        shots = self._source.shots
        return shots is not None and low != high and high not in shots.around(low, low, high)

    def _read(self, index: int) -> None:
        """Reads a frame, and those that will be wanted after it if they lie before it."""
        place = self._upcoming.index(index) if index in self._upcoming else 0
        upcoming = [i for i in self._upcoming[place + 1 :] if i not in self._kept]
        backward = [i for i in upcoming[: BLOCK - 1] if i < index]
        block = sorted({index, *backward})
        self._source.want([*block, *(upcoming[:AHEAD] if not backward else ())])
        for before, i in pairwise([block[0], *block]):
            self._cut(before, i)  # finds cuts while frames are read upwards
            self._kept[i] = self._grey(self._source.read(i))
        while len(self._kept) > KEPT:
            del self._kept[next(iter(self._kept))]

    def _grey(self, frame: np.ndarray) -> np.ndarray:
        if frame.dtype != np.uint8:
            frame = _levels(frame, self._source.transfer)
        grey = cv2.cvtColor(np.ascontiguousarray(frame[..., :3]), cv2.COLOR_RGB2GRAY)
        return grey if grey.shape[::-1] == self.size else cv2.resize(grey, self.size, interpolation=cv2.INTER_AREA)


def _levels(frame: np.ndarray, transfer: str) -> np.ndarray:
    """Samples as levels of 8 bits, as they are shown."""
    from ..core import light

    if frame.dtype == np.uint16:
        return (frame >> 8).astype(np.uint8)
    values = np.nan_to_num(frame[..., :3].astype(np.float32)).clip(0, 1)
    return np.rint(255 * (light.to_encoded(values) if transfer == "linear" else values)).astype(np.uint8)


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

    region: its channels are evaluated at `start`, at anchors and where its drawings have frames
    frames: all that may be tracked, `start` among them
    motion: what changes beside the location: "rotation", or "scale" and rotation
    anchors: frames whose placement is right as it is. Tracking ends at the nearest one on each side; what lies between
    comes a second time then, blended with what is tracked back from there.
    A direction that ends early ends with a Tracked that has a fault. TrackingError: nothing can be tracked from there.
    MediaError, while it goes on: a frame cannot be read."""
    if start not in frames:
        raise TrackingError(NOT_SHOWN)
    if len(frames) < 2:
        raise TrackingError(ALONE)
    track = _Track(region, footage, motion, sorted({start, *anchors}))
    part = track.part(start)
    return track.both_ways(part, start, range(min(frames), max(frames) + 1), set(anchors))


class _Track:
    """What tracking a region needs to know."""

    def __init__(self, region: Region, footage: Footage, motion: Motion, evaluated: list[int]):
        self._region, self._footage, self._motion = region, footage, motion
        redrawn = region.drawings.frames if len(region.drawings.frames) > 1 else ()
        self._drawn = sorted({*evaluated, *redrawn})
        shapes = [region.unmoved(frame) for frame in self._drawn]
        if not all(map(len, shapes)):
            raise TrackingError(EMPTY)
        self._centres = np.array([motions.centre(shape) for shape in shapes])

    def part(self, frame: int) -> Part:
        """What the region covers at a frame. TrackingError: there is nothing to follow."""
        shape, (width, height) = self._region.at(frame), self._footage.size
        covered = scribbles.rasterise([replace(shape, shutter=0)], width, height) > 0
        if not covered.any():
            raise TrackingError(OUTSIDE)
        picture = self._footage.picture(frame)
        for weight in _weights(covered, shape.kind):
            part = Part(picture, weight)
            if len(part.points) >= _ENOUGH:
                return part
        if len(part.points) < registration.FEWEST[self._motion]:
            raise TrackingError(FEW)
        return part

    def both_ways(self, part: Part, start: int, frames: range, anchors: set[int]) -> Iterator[Tracked]:
        yield Tracked(start, self._placement(start), 1.0)
        for rest in (range(start + 1, frames.stop), range(start - 1, frames.start - 1, -1)):
            anchor = next((frame for frame in rest if frame in anchors), None)
            if anchor is None:
                yield from self._from(part, start, rest)
            else:
                yield from self._between(part, start, anchor)

    def _between(self, part: Part, start: int, anchor: int) -> Iterator[Tracked]:
        """From `start` towards an anchor, and then blended with the way back from there."""
        step = 1 if anchor > start else -1
        there, back, faults = {}, {}, []
        for found in self._from(part, start, range(start + step, anchor, step)):
            if found.fault:
                faults.append(found)
            else:
                there[found.frame] = found
                yield found
        try:
            returning = self._from(self.part(anchor), anchor, range(anchor - step, start, -step))
            back = {found.frame: found for found in returning if not found.fault}
        except TrackingError:  # what was found from the start alone has to do
            pass
        for frame in range(start + step, anchor, step):
            share = (frame - start) / (anchor - start)
            if blended := _blended(there.get(frame), back.get(frame), share):
                yield blended
        yield Tracked(anchor, self._placement(anchor), 1.0)
        yield from (fault for fault in faults if fault.frame not in back)

    def _from(self, part: Part, start: int, frames: range) -> Iterator[Tracked]:
        """Frames one after another, away from `start`."""
        self._footage.want(list(frames))
        pursuit = _Pursuit(part, self._footage.picture(start), self._motion)
        last, shown, lost = Tracked(start, self._placement(start), 1.0), start, []
        for frame in frames:
            if self._footage.cut(shown, frame):
                fault = pursuit.reason if lost else SHOT_ENDS
                yield Tracked((lost or [frame])[0], last.placement, 0.0, fault)
                return
            found, shown = pursuit.next(self._footage.picture(frame), len(lost)), frame
            if found is None:
                lost.append(frame)
                if len(lost) > PATIENCE:
                    break
                continue
            placement = self._carried(start, frame, found[0], last.placement)
            yield from _bridged(last, placement, lost, frame)
            last, lost = Tracked(frame, placement, found[1]), []
            yield last
        if lost:
            yield Tracked(lost[0], last.placement, 0.0, pursuit.reason)

    def _placement(self, frame: int) -> Placement:
        region = self._region
        x, y = (float(number) for number in region.location.at(frame))
        return Placement((x, y), float(region.rotation.at(frame)), float(region.scale.at(frame)))

    def _carried(self, start: int, frame: int, motion: Similarity, near: Placement) -> Placement:
        before, after = self._centre(start), self._centre(frame)
        moved = motions.carried(self._placement(start), motion, before, after, self._footage.size)
        return motions.unwound(moved, near)

    def _centre(self, frame: int) -> tuple[float, float]:
        """The centre of the region's shape as it is drawn at a frame; between drawings it goes straight."""
        return tuple(float(np.interp(frame, self._drawn, axis)) for axis in self._centres.T)


class _Pursuit:
    """A part of a picture, looked for in one picture after another.

    reason: why it was not found in the last one"""

    def __init__(self, part: Part, picture: np.ndarray, motion: Motion):
        self._first, self._motion, self.reason = part, motion, COVERED
        # the motion up to the last picture in which it was found, and its last step
        self._known = self._speed = Similarity()
        self._look = _Look(part, Similarity(), 1.0)  # how it looked later, if it is no longer like the first
        self._seen = picture, Similarity(), 1.0  # the last picture in which it was found, the motion, its confidence

    def next(self, picture: np.ndarray, missed: int) -> tuple[Similarity, float] | None:
        """The motion from the first picture, and its confidence; None: it is not there. missed: for how many pictures
        before this one it was not."""
        found = None if missed else self._found(picture, self._speed.after(self._known))
        if found is None:
            self._look_anew()
            found = self._found_elsewhere(picture, missed, self._look)
        elif found[1] < _DOUBTFUL:
            found = self._found_elsewhere(picture, missed) or found
        if found is None:
            if not missed:
                self.reason = LEFT if self._leaves(picture) else COVERED
            return None
        self._speed = found[0].after(self._known.inverse()) if not missed else Similarity()
        self._known, self._seen = found[0], (picture, *found)
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
        if sure < SURE:  # from there the first look may be near enough
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
        weight = cv2.warpAffine(self._first.weight, registration.matrix(motion), picture.shape[::-1])
        if (weight > 0).any():
            self._look = _Look(Part(picture, weight), motion, max(_DRIFT * worth, _LEAST))

    def _found_elsewhere(self, picture, missed: int, *looks: _Look) -> tuple[Similarity, float] | None:
        """As `_found`, of all places where it may be by now; only if it looks as it did first, or as in other looks."""
        radius = 0.05 * picture.shape[1] * (1 + missed / 4)
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


def _weights(covered: np.ndarray, kind: str) -> Iterator[np.ndarray]:
    """How much each pixel (H, W) belongs to what a region covers, 0 to 1: the fill of a lasso; around a line farther
    and farther, the less the farther away it is."""
    if kind == "lasso":
        yield covered.astype(np.float32)
        return
    away = cv2.distanceTransform((~covered).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    for share in _REACHES:
        reach = share * covered.shape[0]
        yield np.where(away <= reach, np.exp(-2 * (away / reach) ** 2), 0).astype(np.float32)


def _bridged(last: Tracked, placement: Placement, lost: list[int], frame: int) -> Iterator[Tracked]:
    """Frames at which the subject was not seen, on a straight way between those beside them."""
    for missing in lost:
        share = (missing - last.frame) / (frame - last.frame)
        yield Tracked(missing, motions.between(last.placement, placement, share), 0.0)


def _blended(first: Tracked | None, second: Tracked | None, share: float) -> Tracked | None:
    """What two ways say of a frame, a share of the way from the first one's start to the second one's; the surer one
    counts for more. None: neither says anything."""
    if first is None or second is None:
        return first or second
    weights = (1 - share) * (first.confidence + 1e-3), share * (second.confidence + 1e-3)
    share = weights[1] / sum(weights)
    placement = motions.between(first.placement, second.placement, share)
    return Tracked(first.frame, placement, (1 - share) * first.confidence + share * second.confidence)
