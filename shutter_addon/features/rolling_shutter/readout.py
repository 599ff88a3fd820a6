"""Measure the readout time of a rolling shutter from footage, by lines that lean as they move. No bpy.

A row at height y of H is filmed y/H of the readout after the first one. So a line that moves sideways by v pixels per
frame leans by v · readout / H more than its own direction. Nearly upright edges are followed from frame to frame. A
regression of their leans on their speeds, with a direction for each edge, gives the readout. Speeds must change: an
edge that always moves alike may lean by itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...core import stopping
from ...core.frames.frame_source import FrameSource
from ...core.messages import MediaError
from ...media import flow, opencv
from ...media.opencv import cv2

ROWS = 540  # the most rows of the pictures
FRAMES = 48  # successive frames that tell the readout
# An edge's least length in heights of the picture, its largest lean, and the most edges.
LONG, UPRIGHT, MOST = 0.1, 0.35, 60
_ANEW = 6  # frames after which more edges are looked for
_REACH, _NEAR = 6, 3  # pixels around the expected place of an edge, and around the place found there
_STEEP = 6.0  # the least difference of an edge in levels, across a pixel
_ROUGH = 0.3  # the error of a row in pixels, beyond which it hardly counts
_SEEN, _OFF = 0.6, 1.0  # the share of an edge's rows that must be found, and their largest median error in pixels
# What a readout needs: edges, frames of each, the spread of speeds in pixels per frame, and the largest standard error,
# as a share of a frame or of the readout.
LINES, _SAMPLES, CHANGING = 3, 5, 0.7
SURE, SURE_SHARE = 0.02, 0.1
_LONGEST = 1.2  # the longest readout in frames


class ReadoutError(MediaError):
    """The readout cannot be measured. The message is the end of a sentence, which the interface translates."""


TOO_FEW_FRAMES = "there are too few frames"
TOO_FEW_LINES = "too few straight lines go across the picture"
TOO_LITTLE_MOTION = "lines move too little, or always alike"
UNLIKE = "lines do not lean as one readout would have them"


def of_source(source: FrameSource, indices: Sequence[int], *, columns: bool = False) -> float:
    """Measure how long the sensor takes to read all rows, in frames; negative: it reads the last row first.

    Args:
        source: The footage.
        indices: Successive frames of it in one shot; FRAMES are enough.
        columns: Whether the sensor reads column by column. The result is then positive if it begins at the left.

    Raises:
        ReadoutError: There are too few frames or lines, they move too little, or no readout time explains how they
            lean.
        MediaError: The frames cannot be read, or OpenCV is missing.
    """
    opencv.check("the readout is found by")
    source.want(indices)
    return of_pictures([flow.of_rows(source.read(index), source, ROWS, turned=columns) for index in indices])


def of_pictures(pictures: Sequence[np.ndarray]) -> float:
    """Measure the readout time in frames, as `of_source` does, from successive grey pictures (H, W) uint8.

    Raises:
        ReadoutError: It cannot be measured.
    """
    if len(pictures) < _SAMPLES + 2:
        raise ReadoutError(TOO_FEW_FRAMES)
    if min(pictures[0].shape) < flow.SMALLEST:
        raise ReadoutError(TOO_FEW_LINES)
    samples = [found for edge in _followed(pictures) if (found := edge.samples()) is not None]
    if len(samples) < LINES:
        raise ReadoutError(TOO_FEW_LINES)
    return _fitted(samples, pictures[0].shape[0])


@dataclass
class _Edge:
    """A nearly upright edge that is followed from picture to picture.

    Attributes:
        rows: Numbers of the rows of pixels that it crosses, (n,), the same in all pictures.
        polarity: 1 if the picture is lighter on its right, −1 if on its left.
        places: Where it is in each picture, from the one where it was found to the last where it is visible: its x in
            the middle of its rows, in pixels, and its lean, in pixels to the right per row down.
    """

    rows: np.ndarray
    polarity: float
    places: list[tuple[float, float]] = field(default_factory=list)

    def samples(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the edge's speeds in pixels per frame and leans in pixels per row; None: it has too few places.

        Both are (k - 2,) for k places, since the first and the last one are left out.
        """
        if len(self.places) < _SAMPLES + 2:
            return None
        x, lean = np.array(self.places).T
        return _speeds(x)[1:-1], lean[1:-1]

    def at(self, x: float, lean: float) -> np.ndarray:
        """Return the edge's x in each of its rows, (n,), as a straight line.

        Args:
            x: x in the middle of the edge's rows, in pixels.
            lean: Pixels to the right per row down.
        """
        return x + lean * (self.rows - self.rows.mean())


def _speeds(x: np.ndarray) -> np.ndarray:
    """Return an edge's speed in each frame, (n,), in pixels per frame: the slope of a cubic spline through its x.

    Plain differences between the frames before and after would be too small by a fifth where hands shake.

    Args:
        x: The edge's x in each frame, (n,), in pixels.
    """
    of = 4 * np.eye(len(x)) + np.eye(len(x), k=1) + np.eye(len(x), k=-1)
    of[[0, -1], [0, -1]] = 2
    outer = np.pad(x, 1, mode="edge")
    return np.linalg.solve(of, 3 * (outer[2:] - outer[:-2]))


def _followed(pictures: Sequence[np.ndarray]) -> list[_Edge]:
    """Return all edges that are found in pictures, each followed for as long as it is visible."""
    edges: list[_Edge] = []
    seen: list[_Edge] = []  # those visible in the last picture
    for index, picture in enumerate(pictures):
        stopping.check()
        steepness = _steepness(picture)
        if index:
            vectors = flow.vectors(pictures[index - 1], picture)
            seen = [edge for edge in seen if _follow(edge, vectors[..., 0], steepness)]
        if index % _ANEW == 0:
            new = _new(seen, picture, steepness)
            edges, seen = edges + new, seen + new
    return edges


def _steepness(picture: np.ndarray) -> np.ndarray:
    """Return the horizontal gradient of a grey picture, (H, W) float32, in levels per pixel."""
    smooth = cv2.GaussianBlur(picture.astype(np.float32), (5, 1), 0.8, sigmaY=1e-6)
    return cv2.filter2D(smooth, -1, np.array([[-0.5, 0, 0.5]], np.float32), borderType=cv2.BORDER_REPLICATE)


def _follow(edge: _Edge, vectors: np.ndarray, steepness: np.ndarray) -> bool:
    """Follow an edge into the next picture. If it is visible there, add its place to `places`. Return whether it is.

    Args:
        edge: The edge, which was visible in the last picture.
        vectors: Horizontal optical flow from the last picture to the next, (H, W), in pixels.
        steepness: Horizontal gradient of the next picture, (H, W), from `_steepness`.
    """
    x, lean = edge.places[-1]
    columns = np.clip(np.rint(edge.at(x, lean)).astype(int), 0, vectors.shape[1] - 1)
    moved = float(np.median(vectors[edge.rows, columns]))
    if (place := _placed(edge, (x + moved, lean), steepness)) is not None:
        edge.places.append(place)
    return place is not None


def _new(seen: list[_Edge], picture: np.ndarray, steepness: np.ndarray) -> list[_Edge]:
    """Find edges of a picture that do not coincide with known ones, and return them, the tallest first.

    Args:
        seen: The known edges that are visible in this picture. With the new ones, they are MOST at most.
        picture: The picture in grey, (H, W) uint8.
        steepness: Its horizontal gradient, (H, W), from `_steepness`.
    """
    new: list[_Edge] = []
    for x0, y0, x1, y1 in _segments(picture):
        if len(seen) + len(new) >= MOST:
            break
        rows = np.arange(max(int(np.ceil(y0)), 0), min(int(y1), len(picture) - 1) + 1)
        edge, lean = _Edge(rows, 1.0), (x1 - x0) / (y1 - y0)
        x = x0 + lean * (rows.mean() - y0)
        columns = np.clip(np.rint(edge.at(x, lean)).astype(int), 0, picture.shape[1] - 1)
        edge.polarity = 1.0 if np.median(steepness[rows, columns]) > 0 else -1.0
        place = _placed(edge, (x, lean), steepness)
        if place is not None and not any(_is_same(edge, place, other) for other in seen + new):
            edge.places.append(place)
            new.append(edge)
    return new


def _is_same(edge: _Edge, place: tuple[float, float], other: _Edge) -> bool:
    """Tell whether a new edge coincides with a known one.

    Then they have the same polarity, and are less than 2 pixels apart in the middle of the rows that both cross.

    Args:
        edge: The new edge.
        place: Its x and lean, as in _Edge.places.
        other: The known edge, at its last place.
    """
    if edge.polarity != other.polarity or not np.intersect1d(edge.rows, other.rows).size:
        return False
    x, lean = other.places[-1]
    row = np.intersect1d(edge.rows, other.rows).mean()
    own = place[0] + place[1] * (row - edge.rows.mean())
    return bool(abs(own - (x + lean * (row - other.rows.mean()))) < 2)


def _segments(picture: np.ndarray) -> np.ndarray:
    """Find nearly upright edges in a picture, the tallest first, (n, 4): x and y of their upper and lower ends."""
    found = cv2.createLineSegmentDetector().detect(picture)[0]
    if found is None:
        return np.empty((0, 4))
    lines = found.reshape(-1, 4).astype(np.float64)
    lines = np.where(lines[:, 1:2] > lines[:, 3:4], lines[:, [2, 3, 0, 1]], lines)
    wide, high = lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1]
    lines = lines[(high >= LONG * len(picture)) & (np.abs(wide) <= UPRIGHT * high)]
    return lines[np.argsort(lines[:, 1] - lines[:, 3], kind="stable")]


def _placed(edge: _Edge, expected: tuple[float, float], steepness: np.ndarray) -> tuple[float, float] | None:
    """Find an edge near an expected place.

    Args:
        edge: The edge, of which the rows and the polarity count.
        expected: Its expected x and lean, as in _Edge.places.
        steepness: The picture's horizontal gradient, (H, W), from `_steepness`.

    Returns:
        Its x and lean, as in _Edge.places. None: too few of its rows show it, they do not lie on a line, or its middle
        is outside the picture.
    """
    place = expected
    for reach in (_REACH, _NEAR, _NEAR):
        centres, is_there = _centres(edge, place, steepness, reach)
        if is_there.mean() < _SEEN:
            return None
        place = _line(edge.rows, centres, is_there)
    off = np.abs(centres - edge.at(*place))[is_there]
    return place if np.median(off) <= _OFF and 0 <= place[0] < steepness.shape[1] else None


def _centres(
    edge: _Edge, place: tuple[float, float], steepness: np.ndarray, reach: int
) -> tuple[np.ndarray, np.ndarray]:
    """Find the exact x of an edge in each of its rows, near an expected place.

    Args:
        edge: The edge, of which the rows and the polarity count.
        place: Its expected x and lean, as in _Edge.places.
        steepness: The picture's horizontal gradient, (H, W), from `_steepness`.
        reach: How far from that place the edge is looked for, in pixels to the left and right.

    Returns:
        Its x in each row, (n,), and whether it was found there, (n,) bool. Where it was not, x means nothing.
    """
    width = steepness.shape[1]
    middle = np.rint(edge.at(*place)).astype(int)
    columns = middle[:, None] + np.arange(-reach, reach + 1)
    is_inside = (middle >= reach) & (middle < width - reach)
    values = np.maximum(edge.polarity * steepness[edge.rows[:, None], np.clip(columns, 0, width - 1)], 0)
    # Use only pixels around the steepest one, without other edges of the same polarity.
    peak = columns[np.arange(len(columns)), values.argmax(axis=1)]
    values = np.where(np.abs(columns - peak[:, None]) <= 2, values, 0)
    total = values.sum(axis=1)
    is_there = is_inside & (values.max(axis=1) >= _STEEP / 2)
    return (values * columns).sum(axis=1) / np.maximum(total, 1e-6), is_there


def _line(rows: np.ndarray, centres: np.ndarray, is_there: np.ndarray) -> tuple[float, float]:
    """Fit a straight line to an edge, robustly, and return its x in the middle row and its lean, as in _Edge.places.

    Args:
        rows: The edge's rows, (n,).
        centres: Its x in each row, (n,), from `_centres`.
        is_there: Whether it was found in each row, (n,) bool. Other rows do not count.
    """
    points = np.column_stack([centres, rows - rows.mean()])[is_there].astype(np.float32)
    right, down, x, y = cv2.fitLine(points, cv2.DIST_WELSCH, _ROUGH, 1e-3, 1e-4).ravel()
    lean = right / down
    return float(x - lean * y), float(lean)


def _fitted(samples: list[tuple[np.ndarray, np.ndarray]], height: int) -> float:
    """Return the readout time in frames, by a robust regression of the leans of edges on their speeds.

    The readout time is the common slope. Each edge has an intercept of its own, as it may lean even without motion.

    Args:
        samples: For each edge, its speeds in pixels per frame and its leans in pixels per row, (n,) each.
        height: Number of rows of the pictures.

    Raises:
        ReadoutError: Speeds change too little, the edges do not agree on one readout time, or it exceeds _LONGEST.
    """
    speeds, leans = (np.concatenate(part) for part in zip(*samples, strict=True))
    of = np.repeat(np.arange(len(samples)), [len(speed) for speed, _lean in samples])
    leans = leans * height
    weight = np.ones(len(of))
    share = 0.0
    for _ in range(30):
        own_speeds, own_leans = (_without_mean(values, weight, of) for values in (speeds, leans))
        spread = (weight * own_speeds**2).sum()
        if spread <= (CHANGING**2) * weight.sum():
            raise ReadoutError(TOO_LITTLE_MOTION)
        share = float((weight * own_speeds * own_leans).sum() / spread)
        off = own_leans - share * own_speeds
        scale = max(2.5 * 1.48 * float(np.median(np.abs(off))), 0.02)
        weight = 1 / (1 + (off / scale) ** 2) ** 2
    # Errors of one edge are correlated.
    error = float(np.sqrt((np.bincount(of, weight * own_speeds * off) ** 2).sum()) / spread)
    if error > max(SURE, SURE_SHARE * abs(share)) or abs(share) > _LONGEST:
        raise ReadoutError(UNLIKE)
    return share


def _without_mean(values: np.ndarray, weight: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Subtract from each value the weighted mean of all values of the same edge. Return the differences (n,).

    Args:
        values: Values of all edges, (n,).
        weight: The weight of each value, (n,).
        of: The index of the edge to which each value belongs, (n,).
    """
    return values - (np.bincount(of, weight * values) / np.bincount(of, weight))[of]
