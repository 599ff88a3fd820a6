"""How the camera has moved, by what stands still in front of it: the whole picture but what regions cover.

Every frame is compared with one and the same, the anchor, as long as enough of that is seen; then with the last frame
before. So a camera that shakes does not drift, and one that pans drifts by one comparison for every picture that it
has passed: what a window shows at once is right, what it comes back to after a turn is a little elsewhere. No bpy.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..core.model import scribbles
from ..core.model.effect import Region, Subject
from ..core.model.motions import Motion, Placement, Similarity
from . import pursuit, registration, tracking
from .footage import Footage
from .pursuit import Sighting
from .registration import Part
from .tracking import Tracked, TrackingError

BARE = "what the regions leave of the picture has too few corners to follow"
UNLIKE = "the picture is too unlike those before"
GOES_ON = "the picture is too unlike those before, and it goes on from here"

_ANEW = 0.6  # below this confidence the last frame is compared as well, and becomes the anchor if that is surer
_LEAST = 0.12  # below it nothing was found
# Frames from one look to the next by which it is seen whether a motion explains the picture; cells of its width and its
# height; heights of the picture that they may be off; the share of them that may be off more, and from which on nothing
# is sure.
_SPAN, _CELLS, _OFF, _FEW, _MOST = 8, 8, 0.008, 0.3, 0.6
_FADING = 0.9  # what a frame keeps of the doubt in the one before
_MARGIN = 0.02  # heights of the picture about a region, where corners may be those of its edge


class CameraTrack(tracking.Track):
    """Tracks what the camera sees."""

    def __init__(self, camera: Subject, regions: Sequence[Region]) -> None:
        """regions: what they cover is left out; evaluated at any of the frames"""
        super().__init__(camera)
        self._regions = regions
        self._begun: dict[int, Placement] = {}  # where it has begun anew

    def _placement(self, frame: int) -> Placement:
        return self._begun.get(frame) or super()._placement(frame)

    def _onward(self, start: int, frames: range) -> Iterator[Tracked]:
        """As `_from`; where that ends, it begins anew, in place of where it was last: behind a cut, for windows end
        there; and where two frames can be compared again. How it moved in between, nobody knows: there is a fault."""
        last, fault = Tracked(frame=start, placement=self._placement(start), confidence=1.0), None
        for tracked in self._from(start, frames):
            if tracked.fault:
                fault = tracked
            else:
                last = tracked
                yield tracked
        if fault is None:
            return
        rest = frames[frames.index(fault.frame) :]
        begin = self._next_begin(rest)
        is_cut = fault.fault == tracking.SHOT_ENDS
        if begin is None or begin != fault.frame:
            yield replace(fault, fault=BARE) if is_cut else fault
        elif not is_cut:
            yield replace(fault, fault=GOES_ON)
        if begin is not None:
            self._begun[begin] = last.placement
            yield Tracked(frame=begin, placement=last.placement, confidence=1.0)
            yield from self._onward(begin, rest[rest.index(begin) + 1 :])

    def _next_begin(self, frames: range) -> int | None:
        """The first of these frames with which the next one, or none of its shot, can be compared; None: there is
        none."""
        self._footage.want(frames)
        for frame, after in zip(frames, [*frames[1:], None], strict=True):
            if not self._has_part(frame):
                continue
            if after is None or self._cut(frame, after):
                return frame
            if self._pursuit(frame)[0].next(after) is not None:
                return frame
        return None

    def _cut(self, frame: int, after: int) -> bool:
        self._footage.picture(after)  # in the order in which they are read, before cuts are looked for
        return self._footage.cut(frame, after)

    def _part(self, frame: int) -> tuple[Part, float]:
        width, height = self._footage.size
        shapes = [region.at(frame) for region in self._regions]
        shapes = [replace(shape, shutter=0) for shape in shapes if shape.opacity]
        covered = scribbles.rasterise(shapes, width, height) > 0
        free = registration.distances(covered) > _MARGIN * height if covered.any() else ~covered
        if not free.any():
            raise TrackingError(BARE)
        part = Part(self._footage.picture(frame), free.astype(np.float32))
        if len(part.points) < registration.FEWEST[self._motion]:
            raise TrackingError(BARE)
        return part, 1.0

    def _pursuit(self, start: int) -> tuple[_Pursuit, float]:
        worth = pursuit.distinctness(self.part(start)[0], self._footage.size[0])
        return _Pursuit(lambda frame: self._part(frame)[0], self._footage, start, self._motion), worth


class _Pursuit:
    """The motion of what stands still, from one frame to others after it."""

    reason = UNLIKE

    def __init__(self, part_at: Callable[[int], Part], footage: Footage, frame: int, motion: Motion) -> None:
        """part_at: what of a frame stands still; TrackingError: too little"""
        self._part_at, self._footage, self._motion = part_at, footage, motion
        self._anchor = part_at(frame), frame, Similarity()  # with the motion from the first frame to it
        self._older = deque([self._anchor], 2)  # looks from some time ago
        self._doubt = 0.0  # whether a motion explains what is seen
        self._last = frame, Similarity()  # where it was found last
        self._speed = Similarity()

    def next(self, frame: int) -> Sighting | None:
        """Where it is in a frame; None: it is not found."""
        picture, (before, known) = self._footage.picture(frame), self._last
        sighting = self._compared(picture, self._anchor)
        if sighting.confidence < _ANEW and before != self._anchor[1] and (anchor := self._anchor_at(before, known)):
            anew = self._compared(picture, anchor)
            if anew.confidence > sighting.confidence:
                self._anchor, sighting = anchor, anew
        if sighting.confidence < _LEAST:
            self._speed = Similarity()
            return None
        self._speed = sighting.motion.after(known.inverse()) if abs(frame - before) == 1 else Similarity()
        self._last = frame, sighting.motion
        self._doubt = max(1 - self._explained(picture, frame, sighting.motion), _FADING * self._doubt)
        return sighting._replace(confidence=max((1 - self._doubt) * sighting.confidence, _LEAST))

    def _explained(self, picture: np.ndarray, frame: int, motion: Similarity) -> float:
        """How far a motion is that of all that is seen, up to 1: by the cells of a frame some time ago that are not
        where it has them. What moves by itself fills few of them; where the camera moves through a scene, many."""
        part, _, known = self._older[0]
        points, off = part.astray(picture, motion.after(known.inverse()))
        if abs(frame - self._older[-1][1]) >= _SPAN and (anchor := self._anchor_at(frame, motion)):
            self._older.append(anchor)
        columns, rows = (
            np.floor(side / length * _CELLS)
            for side, length in ((points.real, picture.shape[1]), (points.imag, picture.shape[0]))
        )
        cells = columns + _CELLS * rows
        astray = [np.median(off[cells == cell]) > _OFF * picture.shape[0] for cell in np.unique(cells)]
        return float(np.clip((_MOST - np.mean(astray)) / (_MOST - _FEW), 0, 1)) if astray else 1.0

    def _compared(self, picture: np.ndarray, anchor: tuple[Part, int, Similarity]) -> Sighting:
        """The surer one of two looks: where it would be if it went on, and where it was last."""
        part, _, motion = anchor
        known, sightings = self._last[1], []
        for guess in (self._speed.after(known), known):
            match = part.find(picture, guess.after(motion.inverse()), self._motion)
            sure = pursuit.confidence(match, picture)
            sightings.append(Sighting(match.motion.after(motion) if match else known, sure))
            if sure >= _ANEW:
                break
        return max(sightings, key=lambda each: each.confidence)

    def _anchor_at(self, frame: int, motion: Similarity) -> tuple[Part, int, Similarity] | None:
        try:
            return self._part_at(frame), frame, motion
        except TrackingError:
            return None
