"""Scribbles: strokes over time, how they move, and the label image they leave (paper §3.3).

Points are fractions of the picture, x to the right and y up from the lower left corner; widths are fractions
of its height. Pictures here have their top row first.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from .. import scanlines
from ..messages import EffectError
from . import keyframes, limits, motions
from .keyframes import Channel
from .motions import Placement

# A line never gets thinner than this radius in pixels: a 5-point diffusion would leak through it.
_MIN_RADIUS = 0.7072
# Long segments are cut to this many pixels, so that the box around each stays small.
_MAX_SEGMENT = 128.0
# In pixels, far beyond all that limits.py allows: from here on float64 could not say where a line crosses the picture.
_FARTHEST = 1e12
FREE = 0
_FAR = 'region "{name}": a point of its strokes is nowhere near the picture'


@dataclass(frozen=True)
class Shape:
    """A region as it stands at one frame: strokes (n, 2) already moved, and the index of its shutter."""

    shutter: int
    kind: str  # line | lasso
    width: float
    strokes: tuple[np.ndarray, ...]
    opacity: float = 1.0  # 0 to 1


def layers(shapes: Collection[Shape]) -> list[tuple[float, tuple[Shape, ...]]]:
    """What coefficients are the mean of where shapes are not quite opaque: shares, which add up to 1, each with the
    shapes that hold in it; the first has all that hold anywhere. So coefficients at an opacity of one half are halfway
    between those with the shape and those without it, and nothing jumps where it goes."""
    steps = sorted({0.0, 1.0, *(shape.opacity for shape in shapes)})
    return [(high - low, tuple(s for s in shapes if s.opacity >= high)) for low, high in pairwise(steps)]


def resample(stroke: ArrayLike, count: int, aspect: float = 1.0) -> np.ndarray:
    """`count` points (count, 2) at equal arc lengths along a stroke (n, 2), its ends kept. aspect: the picture's width
    over its height, by which lengths are measured."""
    stroke = np.asarray(stroke, dtype=np.float64)
    steps = np.hypot(*(np.diff(stroke, axis=0) * (aspect, 1)).T) if len(stroke) > 1 else np.zeros(0)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    if length[-1] == 0:
        return np.repeat(stroke[:1], count, axis=0)
    at = np.linspace(0, length[-1], count)
    return np.stack([np.interp(at, length, stroke[:, axis]) for axis in (0, 1)], axis=1)


def between_strokes(
    first: Sequence[ArrayLike], second: Sequence[ArrayLike], u: float, aspect: float = 1.0
) -> list[np.ndarray]:
    """Strokes a share u of the way from one drawing to the next, paired in order.

    Strokes of the same number of points move point by point, others by arc length (aspect: see `resample`). A stroke
    without a partner stays as it is until the next drawing.
    """
    if u <= 0:
        return [np.asarray(s, dtype=np.float64) for s in first]
    if u >= 1:
        return [np.asarray(s, dtype=np.float64) for s in second]
    result = []
    for index, a in enumerate(first):
        a = np.asarray(a, dtype=np.float64)
        if index < len(second):
            b = np.asarray(second[index], dtype=np.float64)
            if len(a) != len(b):
                a, b = (resample(s, max(len(a), len(b)), aspect) for s in (a, b))
            a = (1 - u) * a + u * b
        result.append(a)
    return result


def mapped(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (n, 2) through a matrix (3, 3)."""
    return points @ matrix[:2, :2].T + matrix[:2, 2]


def transform(
    strokes: Iterable[ArrayLike], location: ArrayLike, rotation: float, scale: float, aspect: float
) -> tuple[np.ndarray, ...]:
    """Strokes scaled, turned by `rotation` degrees counter-clockwise about the centre of their common bounding
    box, and moved by `location` (fractions). `aspect` is the picture's width over its height: circles stay round.
    """
    strokes = [np.asarray(s, dtype=np.float64) for s in strokes]
    if not strokes:
        return ()
    centre = motions.centre(strokes)
    sin, cos = np.sin(np.radians(rotation)) * scale, np.cos(np.radians(rotation)) * scale
    turn = np.array([[cos, -sin / aspect], [sin * aspect, cos]])
    return tuple((s - centre) @ turn.T + centre + np.asarray(location, dtype=np.float64) for s in strokes)


def taken_back(
    strokes: Iterable[ArrayLike], location: ArrayLike, rotation: float, scale: float, aspect: float
) -> tuple[np.ndarray, ...]:
    """The strokes that `transform` takes to these."""
    strokes = tuple(np.asarray(s, dtype=np.float64) for s in strokes)
    turned = transform(strokes, (0, 0), -rotation, 1 / scale, aspect)  # about another centre, perhaps
    (there, *_) = transform(turned, location, rotation, scale, aspect)
    return tuple(points + (np.asarray(strokes[0]) - there)[0] for points in turned)


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
        if not self.frames:
            return []
        before, after, share = keyframes.eased_span(self.frames, self.eases, frame)
        return between_strokes(self.drawing(before, frame), self.drawing(after, frame), share, self.aspect)

    def moved(self, frame: float, placed: Placement) -> tuple[np.ndarray, ...]:
        """As `at`, moved about the centre of what is drawn."""
        return transform(self.at(frame), placed.location, placed.rotation, placed.scale, self.aspect)

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
        if self.placement is None:
            return self.strokes[index]
        if (placement := self.placement.at(frame)) is None:
            return []
        placed = [mapped(placement, points) for points in self.strokes[index]]
        if not all((np.abs(points) <= limits.MAX_DISTANCE).all() for points in placed):
            raise EffectError(_FAR, name=self.name)
        origin = self.origins[index] if self.origins and placed else Placement()
        if origin == Placement():
            return placed
        return list(taken_back(placed, origin.location, origin.rotation, origin.scale, self.aspect))


def rasterise(shapes: Iterable[Shape], width: int, height: int, *, border: bool = False) -> np.ndarray:
    """Labels (height, width) uint16: 0 where free, 1 + shutter where a shape covers the pixel's centre.

    Later shapes win. `border` fixes the frame's edge to the first shutter, under every shape.
    """
    labels = np.zeros((height, width), dtype=np.uint16)
    if border:
        labels[[0, -1], :] = labels[:, [0, -1]] = 1
    size = np.array([width, height], dtype=np.float64)
    for shape in shapes:
        for stroke in shape.strokes:
            if len(stroke) == 0:
                continue
            pixels = np.clip(np.asarray(stroke, dtype=np.float64) * size, -_FARTHEST, _FARTHEST)
            pixels[:, 1] = height - pixels[:, 1]
            # A hand-drawn lasso crosses itself: even-odd would leave holes in it.
            filled = shape.kind == "lasso" and scanlines.fill(labels, [pixels], shape.shutter + 1)
            if not filled:
                _draw(labels, pixels, shape.width * height / 2 if shape.kind == "line" else 0, shape.shutter + 1)
    return labels


def _draw(labels: np.ndarray, points: np.ndarray, radius: float, label: int) -> None:
    """Labels the pixels within `radius` of a polyline in pixels, y down."""
    radius = max(radius, _MIN_RADIUS)
    if len(points) == 1:
        points = np.repeat(points, 2, axis=0)
    seen = _seen(points[:-1], np.diff(points, axis=0), np.array(labels.shape[::-1]), radius + 1)
    for k in np.flatnonzero(seen[0] <= seen[1]):
        a, b = points[k : k + 2]
        pieces = max(1, int(np.ceil(np.hypot(*(b - a)) / max(_MAX_SEGMENT, 4 * radius))))
        first, last = max(int(seen[0, k] * pieces) - 1, 0), min(int(seen[1, k] * pieces) + 2, pieces)
        shares = np.arange(first, last + 1) * (1 / pieces)
        ends = a + (b - a) * np.where(np.arange(first, last + 1) == pieces, 1.0, shares)[:, None]
        for p, q in pairwise(ends):
            _draw_segment(labels, p, q, radius, label)


def _seen(starts: np.ndarray, steps: np.ndarray, size: np.ndarray, reach: float) -> np.ndarray:
    """The shares (2, n) of segments between which they are within `reach` of a picture of this size (x, y), in either
    direction; the first is above the second where they are nowhere. starts, steps: (n, 2) in pixels."""
    inside = (starts >= -reach) & (starts <= size + reach)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        low, high = np.sort([(-reach - starts) / steps, (size + reach - starts) / steps], axis=0)
    # Along an axis that it does not move on, a segment is inside throughout, or nowhere.
    low[steps == 0], high[steps == 0] = 0, np.where(inside, 1, -1)[steps == 0]
    return np.stack([low.max(axis=1, initial=0), high.min(axis=1, initial=1)])


def _draw_segment(labels: np.ndarray, a: np.ndarray, b: np.ndarray, radius: float, label: int) -> None:
    height, width = labels.shape
    limit = np.array([width, height])
    low = np.clip(np.floor(np.minimum(a, b) - radius), 0, limit).astype(int)
    high = np.clip(np.ceil(np.maximum(a, b) + radius), 0, limit).astype(int)
    box = labels[low[1] : high[1], low[0] : high[0]]
    if (box == label).all():  # or there is none; a thick line's segments cover one another
        return
    x = np.arange(low[0], high[0]) + 0.5 - a[0]
    y = (np.arange(low[1], high[1]) + 0.5 - a[1])[:, None]
    d = b - a
    along = np.clip((x * d[0] + y * d[1]) / max(d @ d, 1e-12), 0, 1)
    near = (x - along * d[0]) ** 2 + (y - along * d[1]) ** 2 <= radius * radius
    box[near] = label
