"""Strokes over time, before they are moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..messages import EffectError
from . import keyframes, limits, motions, scribbles
from .keyframes import Channel
from .motions import Placement

_FAR = 'region "{name}": a point of its strokes is nowhere near the picture'


@dataclass(frozen=True)
class Drawings:
    """A region's strokes over time, before it is moved: drawings at ascending frames, each a list of strokes (n, 2); in
    between every stroke goes from one drawing to the next with the ease of the span.

    name: the region's; aspect: the picture's width over its height
    placement: channel of the matrix (3, 3) from the strokes' space to fractions of the picture, or of None where they
    are not on it; without one, strokes are fractions of the picture
    origins: where the region was as each was drawn, which is seen there; none: where it has not moved"""

    name: str
    frames: tuple[float, ...]
    strokes: tuple
    eases: tuple[keyframes.Ease, ...]
    aspect: float
    placement: Channel | None = None
    origins: tuple[Placement, ...] = ()

    def at(self, frame: float) -> list[np.ndarray]:
        """Strokes (n, 2) in fractions of the picture. EffectError: a point is nowhere near it (limits.MAX_DISTANCE)."""
        placement = self.placement.at(frame) if self.placement else None
        if not self.frames or (self.placement and placement is None):
            return []
        before, after, share = keyframes.eased_span(self.frames, self.eases, frame)
        first, second = (self._on_picture(index, placement) for index in (before, after))
        return scribbles.between_strokes(first, second, share, self.aspect)

    def moved(self, frame: float, placed: Placement) -> tuple[np.ndarray, ...]:
        """As `at`, moved about the centre of what is drawn."""
        return scribbles.transform(self.at(frame), placed.location, placed.rotation, placed.scale, self.aspect)

    def centre(self, frame: float) -> np.ndarray | None:
        """See Subject."""
        strokes = self.at(frame)
        return motions.centre(strokes) if strokes else None

    def corners(self, frame: float, placed: Placement) -> np.ndarray:
        """See Subject; placed: where it lies at the frame."""
        strokes = self.moved(frame, placed)
        return motions.corners(strokes) if strokes else np.empty((0, 2))

    def drawing(self, index: int, frame: float) -> list[np.ndarray]:
        """The strokes of a drawing as they lie on the picture at a frame; raises as `at`."""
        placement = self.placement.at(frame) if self.placement else None
        return [] if self.placement and placement is None else self._on_picture(index, placement)

    def _on_picture(self, index: int, placement: np.ndarray | None) -> list[np.ndarray]:
        if placement is None:
            return self.strokes[index]
        placed = [scribbles.mapped(placement, points) for points in self.strokes[index]]
        if not all((np.abs(points) <= limits.MAX_DISTANCE).all() for points in placed):
            raise EffectError(_FAR, name=self.name)
        origin = self.origins[index] if self.origins and placed else Placement()
        if origin == Placement():
            return placed
        return list(scribbles.taken_back(placed, origin.location, origin.rotation, origin.scale, self.aspect))
