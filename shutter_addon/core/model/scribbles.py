"""Scribbles: drawn strokes over time, where they lie at a frame, and which pixels they cover (paper §3.3).

Points are fractions of the picture, x to the right and y up from the lower left corner; widths are fractions of its
height. Pictures here have their top row first.
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

# In pixels, far beyond the limits of limits.py: float64 cannot locate a line's crossing with the picture from there on.
_FARTHEST = 1e12
FREE = 0
_FAR = 'region "{name}": a point of its strokes is too far from the picture'


@dataclass(frozen=True)
class Shape:
    """A region of strokes at one frame.

    Attributes:
        shutter: The index of the shutter that the region's pixels get.
        kind: "line": those that the strokes cover; "lasso": those that the strokes enclose.
        width: Of the lines, as a fraction of the picture's height; not used for a lasso.
        strokes: The points (n, 2) of each stroke, in fractions of the picture, y up.
        opacity: 0 to 1, how strongly the region acts.
    """

    shutter: int
    kind: str  # line | lasso
    width: float
    strokes: tuple[np.ndarray, ...]
    opacity: float = 1.0  # 0 to 1


def layers(shapes: Collection[Shape]) -> list[tuple[float, tuple[Shape, ...]]]:
    """Split shapes into sets in which all shapes are opaque. Their weighted mean acts like shapes with opacities.

    The caller rasterises each set, and averages how much of each shutter a pixel gets, with the sets' weights. So a
    shape with an opacity of one half has half of its effect. A set has all shapes whose opacity is above a limit, and
    the limit rises from set to set.

    Returns:
        (weight, shapes) for each set. The weights add up to 1. The first set has all shapes with an opacity above 0.
    """
    steps = sorted({0.0, 1.0, *(shape.opacity for shape in shapes)})
    return [(high - low, tuple(s for s in shapes if s.opacity >= high)) for low, high in pairwise(steps)]


def resample(stroke: ArrayLike, count: int, aspect: float = 1.0) -> np.ndarray:
    """Return `count` points (count, 2) at equal distances along a stroke (n, 2), with the same ends.

    Args:
        count: The number of points.
        aspect: The picture's width / height, for measuring distances.
    """
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
    """Interpolate the strokes of two drawings. Strokes are paired by their index in the drawings.

    A pair with equal numbers of points moves point by point. Otherwise both strokes get the larger number of points at
    equal distances first. A stroke without a partner stays as it is if it is in the first drawing, and appears at u = 1
    if it is in the second.

    Args:
        first, second: The strokes (n, 2) of the drawings, in fractions of the picture.
        u: The share of the way from the first drawing to the second, 0 to 1. At 0 and 1 the result is that drawing.
        aspect: The picture's width / height, for measuring distances.
    """
    before, after = ([np.asarray(stroke, dtype=np.float64) for stroke in strokes] for strokes in (first, second))
    if u <= 0:
        return before
    if u >= 1:
        return after
    for index, (a, b) in enumerate(zip(before, after, strict=False)):
        if len(a) != len(b):
            a, b = (resample(stroke, max(len(a), len(b)), aspect) for stroke in (a, b))
        before[index] = (1 - u) * a + u * b
    return before


def mapped(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points (n, 2) mapped by an affine matrix (3, 3)."""
    return points @ matrix[:2, :2].T + matrix[:2, 2]


def transform(
    strokes: Iterable[ArrayLike], location: ArrayLike, rotation: float, scale: float, aspect: float
) -> tuple[np.ndarray, ...]:
    """Return strokes scaled, turned and moved, all about the center of their common bounding box.

    Args:
        strokes: Points (n, 2) each, in fractions of the picture, y up.
        location: By how much they move: x as a fraction of the picture's width, y of its height.
        rotation: Degrees counter-clockwise.
        scale: A factor.
        aspect: The picture's width / height, so that the rotation keeps shapes.
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
    """Return the strokes that `transform` would turn into the given ones, for the same other arguments."""
    strokes = tuple(np.asarray(s, dtype=np.float64) for s in strokes)
    turned = transform(strokes, (0, 0), -rotation, 1 / scale, aspect)  # the center may differ
    (there, *_) = transform(turned, location, rotation, scale, aspect)
    return tuple(points + (np.asarray(strokes[0]) - there)[0] for points in turned)


@dataclass(frozen=True)
class Drawings:
    """What is drawn of a region over time, before the keys of the region's placement move it.

    A drawing is a list of strokes (n, 2) at a frame. Between two drawings, strokes change as `eases` says.

    Attributes:
        name: The region's name, for error messages.
        frames: The frames of the drawings, ascending.
        strokes: The strokes of each drawing; None for a drawing that is not needed.
        eases: For each drawing, how strokes change from it to the next one.
        aspect: The picture's width / height.
        placement: Channel of the affine matrix (3, 3) that converts strokes to fractions of the picture, or of None at
            frames where no strokes are visible. Without a channel, strokes already are fractions of the picture.
        origins: The placement that the region had when each drawing was made. Drawn strokes include it, so its inverse
            is applied to them, before keys place the region; only used with a `placement`. Empty: there is nothing to
            remove.
    """

    name: str
    frames: tuple[float, ...]
    strokes: tuple
    eases: tuple[keyframes.Ease, ...]
    aspect: float
    placement: Channel | None = None
    origins: tuple[Placement, ...] = ()

    def at(self, frame: float) -> list[np.ndarray]:
        """Return the strokes (n, 2) at a frame, in fractions of the picture, before keys move the region.

        The list is empty without drawings, or where strokes are not visible.

        Raises:
            EffectError: A coordinate is beyond ±limits.MAX_DISTANCE; this is checked only if there is a `placement`.
        """
        if not self.frames:
            return []
        before, after, share = keyframes.eased_span(self.frames, self.eases, frame)
        return between_strokes(self.drawing(before, frame), self.drawing(after, frame), share, self.aspect)

    def moved(self, frame: float, placed: Placement) -> tuple[np.ndarray, ...]:
        """Return the strokes at a frame, moved, turned and scaled about their center by the region's keys.

        Args:
            placed: The placement that the region's keys give it.

        Raises:
            EffectError: As for `at`.
        """
        return transform(self.at(frame), placed.location, placed.rotation, placed.scale, self.aspect)

    def drawing(self, index: int, frame: float) -> list[np.ndarray]:
        """Return the strokes (n, 2) of one drawing, in fractions of the picture, before keys move the region.

        The list is empty where strokes are not visible.

        Args:
            index: The index of the drawing.
            frame: The frame at which `placement` and so the strokes' place is wanted. It need not be the drawing's own.

        Raises:
            EffectError: As for `at`.
        """
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
    """Return which shutter is drawn on each pixel: labels (height, width) uint16, the top row first.

    A label is 1 + the shutter's index if a shape covers the pixel's middle, else 0. Later shapes lie over earlier ones.
    A line is at least 1.4 pixels wide. A lasso that encloses no pixel's middle is drawn as such a line.

    Args:
        shapes: The shapes. Their opacities do not count.
        width, height: Of the picture, in pixels.
        border: Whether the pixels along the picture's edge get the label of shutter 0, beneath all shapes.
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
            # A hand-drawn lasso crosses itself, and even-odd would leave holes in it.
            filled = shape.kind == "lasso" and scanlines.fill(labels, [pixels], shape.shutter + 1)
            if not filled:
                _draw(labels, pixels, shape.width * height / 2 if shape.kind == "line" else 0, shape.shutter + 1)
    return labels


def _draw(labels: np.ndarray, points: np.ndarray, radius: float, label: int) -> None:
    """Label the pixels within `radius` pixels of a polyline (n, 2) in pixels, y down."""
    radius = max(radius, 0.7072)  # pixels: a 5-point diffusion would leak through a thinner line
    if len(points) == 1:
        points = np.repeat(points, 2, axis=0)
    seen = _seen(points[:-1], np.diff(points, axis=0), np.array(labels.shape[::-1]), radius + 1)
    for k in np.flatnonzero(seen[0] <= seen[1]):
        a, b = points[k : k + 2]
        # Cut long segments to 128 pixels, so that the box around each stays small.
        pieces = max(1, int(np.ceil(np.hypot(*(b - a)) / max(128.0, 4 * radius))))
        first, last = max(int(seen[0, k] * pieces) - 1, 0), min(int(seen[1, k] * pieces) + 2, pieces)
        shares = np.arange(first, last + 1) * (1 / pieces)
        ends = a + (b - a) * np.where(np.arange(first, last + 1) == pieces, 1.0, shares)[:, None]
        for p, q in pairwise(ends):
            _draw_segment(labels, p, q, radius, label)


def _seen(starts: np.ndarray, steps: np.ndarray, size: np.ndarray, reach: float) -> np.ndarray:
    """Return which part of each line segment is inside the picture or near it, so that only that part is drawn.

    Args:
        starts: Where the segments start, (n, 2) in pixels.
        steps: The vectors from the starts to the ends, (n, 2) in pixels.
        size: Width and height of the picture, in pixels.
        reach: How far outside of the picture is near, in pixels.

    Returns:
        (2, n): where the part begins and where it ends, each as a share 0 to 1 of the segment's length. If a segment is
        nowhere near, its first share is above its second.
    """
    inside = (starts >= -reach) & (starts <= size + reach)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        low, high = np.sort([(-reach - starts) / steps, (size + reach - starts) / steps], axis=0)
    # Along an axis on which it does not move, a segment is either always inside or never.
    low[steps == 0], high[steps == 0] = 0, np.where(inside, 1, -1)[steps == 0]
    return np.stack([low.max(axis=1, initial=0), high.min(axis=1, initial=1)])


def _draw_segment(labels: np.ndarray, a: np.ndarray, b: np.ndarray, radius: float, label: int) -> None:
    """Label the pixels within `radius` pixels of the segment from `a` to `b`, (2,) in pixels, y down."""
    height, width = labels.shape
    limit = np.array([width, height])
    low = np.clip(np.floor(np.minimum(a, b) - radius), 0, limit).astype(int)
    high = np.clip(np.ceil(np.maximum(a, b) + radius), 0, limit).astype(int)
    box = labels[low[1] : high[1], low[0] : high[0]]
    if (box == label).all():  # also for an empty box; segments of a thick line overlap
        return
    x = np.arange(low[0], high[0]) + 0.5 - a[0]
    y = (np.arange(low[1], high[1]) + 0.5 - a[1])[:, None]
    d = b - a
    along = np.clip((x * d[0] + y * d[1]) / max(d @ d, 1e-12), 0, 1)
    near = (x - along * d[0]) ** 2 + (y - along * d[1]) ** 2 <= radius * radius
    box[near] = label
