"""Track the camera by everything that stands still: the whole picture without regions. No bpy.

Each frame is compared with an anchor frame while enough of that is visible, then with the last frame before, which
becomes the anchor. So a shaking camera does not drift, and a panning one drifts only with each change of anchor.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ...core.model import scribbles
from ...core.model.effect import Region, Subject
from ...core.model.motions import Motion, Placement, Similarity
from ...media.footage import Footage
from . import registration, tracking
from .registration import TrackedPart
from .tracking import FoundMotion, Tracked, TrackingError

BARE = "the picture outside the regions has too few corners to follow"
UNLIKE = "the picture is too unlike those before"
GOES_ON = "the picture is too unlike those before; tracking goes on from here"

_ANEW = 0.6  # below this confidence the last frame is compared as well, and may become the anchor
_LEAST = 0.12  # below this confidence nothing was found
# How well a motion explains the picture: frames between the compared ones, cells along each side, the error in heights
# of the picture that a cell may have, the share of cells that may have more, and the share at which nothing is sure.
_SPAN, _CELLS, _OFF, _FEW, _MOST = 8, 8, 0.008, 0.3, 0.6
_FADING = 0.9  # how much doubt goes over to the next frame
_MARGIN = 0.02  # the margin around regions in heights of the picture: its corners may be those of the region's edge


class CameraTrack(tracking.Track):
    """Tracks the camera's motion in the picture."""

    def __init__(self, camera: Subject, regions: Sequence[Region]) -> None:
        """Prepare to track the camera.

        Args:
            camera: Gives its location, rotation and scale where tracking starts.
            regions: What to leave out at each frame, since it may move by itself.
        """
        super().__init__(camera)
        self._regions = regions
        self._begun: dict[int, Placement] = {}  # {frame where tracking began again: placement}

    def _placement(self, frame: int) -> Placement:
        return self._begun.get(frame) or super()._placement(frame)

    def _onward(self, start: int, frames: range) -> Iterator[Tracked]:
        """Yield where the camera is at frames on one side of `start`, also beyond cuts and failures.

        After these, tracking begins again with the last placement, at the frame that `_next_begin` finds. A Tracked
        with a fault marks the place, unless tracking goes on right after a cut: no exposure goes across cuts.
        """
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
        """Return the first frame that can be compared with the next one, or is the last of its shot; None: none can."""
        self._footage.want(frames)
        for frame, after in zip(frames, [*frames[1:], frames[-1]], strict=True):
            with suppress(TrackingError):
                found, _worth = self._tracker(frame)
                self._footage.picture(after)  # frames are read in order before cuts are looked for
                if self._footage.cut(frame, after) or found.next(after) is not None:
                    return frame
        return None

    def _part(self, frame: int) -> TrackedPart:
        """Return what stands still in a frame: the picture outside the regions.

        Raises:
            TrackingError: It has too few corners.
        """
        width, height = self._footage.size
        shapes = [region.at(frame) for region in self._regions]
        shapes = [replace(shape, shutter=0) for shape in shapes if shape.opacity]
        covered = scribbles.rasterise(shapes, width, height) > 0
        free = registration.distances(covered) > _MARGIN * height if covered.any() else ~covered
        if not free.any():
            raise TrackingError(BARE)
        part = TrackedPart(self._footage.picture(frame), free.astype(np.float32))
        if len(part.points) < registration.FEWEST[self._motion]:
            raise TrackingError(BARE)
        return part

    def _tracker(self, start: int) -> tuple[_CameraTracker, float]:
        found = _CameraTracker(self._part, self._footage, start, self._motion)
        return found, tracking.distinctness(found.anchor[0], self._footage.size[0])


class _CameraTracker:
    """The camera's motion from the frame where tracking starts to one frame after another.

    Attributes:
        anchor: The frame that others are compared with: what stands still in it, its number, and the motion to it from
            the frame where tracking starts.
    """

    reason = UNLIKE

    def __init__(self, part_at: Callable[[int], TrackedPart], footage: Footage, frame: int, motion: Motion) -> None:
        """Start to follow the camera at a frame.

        Args:
            part_at: Returns what stands still in a frame, or raises TrackingError.
            motion: What changes, as in Track.follow.
        """
        self._part_at, self._footage, self._motion = part_at, footage, motion
        self.anchor = part_at(frame), frame, Similarity()
        self._older = deque([self.anchor], 2)  # anchors from some time ago
        self._doubt = 0.0  # whether a motion explains the picture
        self._last = frame, Similarity()  # the last frame with a motion
        self._speed = Similarity()

    def next(self, frame: int) -> FoundMotion | None:
        """Return the camera's motion from the frame where tracking starts to this one; None: it is not found."""
        picture, (before, known) = self._footage.picture(frame), self._last
        sighting = self._compared(picture, self.anchor)
        if sighting.confidence < _ANEW and before != self.anchor[1] and (anchor := self._anchor_at(before, known)):
            anew = self._compared(picture, anchor)
            if anew.confidence > sighting.confidence:
                self.anchor, sighting = anchor, anew
        if sighting.confidence < _LEAST:
            self._speed = Similarity()
            return None
        self._speed = sighting.motion.after(known.inverse()) if abs(frame - before) == 1 else Similarity()
        self._last = frame, sighting.motion
        self._doubt = max(1 - self._explained(picture, frame, sighting.motion), _FADING * self._doubt)
        return sighting._replace(confidence=max((1 - self._doubt) * sighting.confidence, _LEAST))

    def _explained(self, picture: np.ndarray, frame: int, motion: Similarity) -> float:
        """Return how well a motion explains the whole picture, 0 to 1.

        An earlier frame is divided into cells. Many cells whose corners are not where the motion takes them lower the
        result; few do not, since things may move. If the camera moves through a scene, there are many.

        Args:
            motion: From the frame where tracking starts to `frame`.
        """
        part, _, known = self._older[0]
        points, off = part.astray(picture, motion.after(known.inverse()))
        if abs(frame - self._older[-1][1]) >= _SPAN and (anchor := self._anchor_at(frame, motion)):
            self._older.append(anchor)
        height, width = picture.shape
        cells = np.floor(points.real / width * _CELLS) + _CELLS * np.floor(points.imag / height * _CELLS)
        astray = [np.median(off[cells == cell]) > _OFF * height for cell in np.unique(cells)]
        return float(np.clip((_MOST - np.mean(astray)) / (_MOST - _FEW), 0, 1)) if astray else 1.0

    def _compared(self, picture: np.ndarray, anchor: tuple[TrackedPart, int, Similarity]) -> FoundMotion:
        """Find the motion from the frame where tracking starts to a picture, by comparison with an anchor frame.

        The search starts where the camera would be at its last speed. If nothing is found, the last motion is returned
        with confidence 0.

        Args:
            anchor: What stands still in that frame, its number, and the motion to it, as in the attribute.
        """
        (part, _, motion), known = anchor, self._last[1]
        match = part.find(picture, self._speed.after(known).after(motion.inverse()), self._motion)
        return FoundMotion(match.motion.after(motion) if match else known, tracking.confidence(match, picture))

    def _anchor_at(self, frame: int, motion: Similarity) -> tuple[TrackedPart, int, Similarity] | None:
        with suppress(TrackingError):
            return self._part_at(frame), frame, motion
        return None
