"""How a part of a picture has moved in another one: corners, Lucas and Kanade's optical flow, RANSAC.

Pictures are grey, (H, W) uint8; points are complex, x + iy in pixels, y down, whole numbers in the middle of a pixel.
Equal pictures give equal results, whatever the number of threads.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import get_args

import numpy as np

from ..core.model.motions import Motion, Similarity
from .opencv import cv2

# What may change beside the location, each with what comes before it.
MOTIONS = get_args(Motion)

MOST_CORNERS = 200
FEWEST = {"location": 4, "rotation": 5, "scale": 5}  # corners that have to agree
_QUALITY = 0.01  # of a corner, as a share of the best one's
_WEAKEST = 2e-4  # the same, whatever the best one is: noise of some levels has less
_LEVELS = 3  # a motion between two frames is found up to about 2 ** _LEVELS half windows
_WINDOWS = 9, 21  # sides of the windows that are compared, in pixels: for small and for large parts
_UNTIL = 3, 30, 0.01  # OpenCV's own: after 30 steps, or at one of less than 0.01 pixels
_THERE_AND_BACK = 1.0  # pixels from where a corner started that it may come back to
_HYPOTHESES = 300
_SOUGHT = 64  # pixels to which a part is made smaller to be sought, or compared as a whole
ALIKE = 0.6  # the correlation from which on something else may be taken for a part
_NOWHERE = -2.0  # in place of a correlation, where no part has room
_RIVAL = 0.85  # of its own likeness, from which on something else may be it as well
_TRACED = 13  # side of the windows by which points are traced through pictures
_NOISE = 16.0  # levels² of contrast that noise may have: they make no two pictures unlike
# Beyond these the motion between two pictures is none that a film has.
_MOST_SCALE, _MOST_TURN = 1.5, 0.8


def distances(mask: np.ndarray) -> np.ndarray:
    """How far in pixels each pixel lies from where a mask (H, W) bool is true."""
    return cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 0)


@dataclass(frozen=True)
class Match:
    """Where a part of a picture is in another one.

    motion: from its picture to the other; agreeing: which of its corners move so (n,) bool, of those `seen` (n,) bool
    share: of the corners' weight, of those that lie in the picture, that moves so
    visible: share of the corners' weight that lies in the picture
    error: pixels by which the part's farthest point is expected to be off
    likeness: correlation of its pixels with those found, −1 to 1
    held: where the corners that agree are in the other picture"""

    motion: Similarity
    agreeing: np.ndarray
    seen: np.ndarray
    share: float
    visible: float
    error: float
    held: np.ndarray
    likeness: float = 0.0


class Part:
    """What is looked for: a part of a picture, and its corners.

    Weights of the corners say how much each one counts; `learn` lowers those of corners that move otherwise, as
    those of the background do."""

    def __init__(self, picture: np.ndarray, weight: np.ndarray) -> None:
        """weight: (H, W) float32, 0 to 1: how much each pixel belongs to it; there has to be one above 0."""
        self.weight, self._whole = weight, picture
        x, y, width, height = cv2.boundingRect((weight > 0).astype(np.uint8))
        self.box = x, y, width, height
        side = int(np.clip(max(width, height) / 4, *_WINDOWS)) // 2 * 2 + 1
        self._side = side
        margin = side * 2
        left, top = max(x - margin, 0), max(y - margin, 0)
        crop = np.s_[top : y + height + margin, left : x + width + margin]
        self._picture, self._mask = np.ascontiguousarray(picture[crop]), np.ascontiguousarray(weight[crop])
        self._origin = complex(left, top)
        corners = _corners(self._picture, self._mask)
        self.points = corners + self._origin
        columns, rows = corners.real.astype(int), corners.imag.astype(int)
        self._believed = self._mask[rows, columns].astype(np.float64)
        self._weights = self._believed.copy()
        self._ends = np.array([complex(a, b) for a in (x, x + width) for b in (y, y + height)])

    def find(self, picture: np.ndarray, guess: Similarity, motion: Motion) -> Match | None:
        """Where it is in a picture, near to a guess. None: its corners are not found there, or do not agree."""
        match = self._match(picture, guess, motion)
        for _ in range(2):  # where the guess was far off, what was found is a better one
            if match is None or np.abs(match.motion(self._ends) - guess(self._ends)).max() < 2:
                break
            guess = match.motion
            match = self._match(picture, guess, motion)
        return match and replace(match, likeness=self._likeness(picture, match.motion))

    def seek(self, picture: np.ndarray, known: Similarity, radius: float) -> Similarity | None:
        """Where in a picture its pixels are most alike, turned and scaled as in `known`, within a radius of pixels of
        where that puts it: a guess for `find`. None: there is no room for it in the picture."""
        scores, alone, around = self._scores(picture, known, radius)
        _, likeness, _, best = cv2.minMaxLoc(scores)
        return None if likeness <= _NOWHERE else around.inverse().after(Similarity(1, complex(*best))).after(alone)

    def lookalike(self, picture: np.ndarray, known: Similarity) -> bool:
        """Whether something elsewhere in a picture looks nearly as much like it as what `known` takes it to."""
        scores, _, _ = self._scores(picture, known, max(picture.shape))
        y, x = (length // 2 for length in scores.shape)
        apart = [max(1, round(_SOUGHT / 2 * length / max(self.box[2:]))) for length in self.box[2:]]
        own = np.s_[max(y - apart[1], 0) : y + apart[1] + 1, max(x - apart[0], 0) : x + apart[0] + 1]
        here, scores[own] = scores[own].max(), _NOWHERE
        return bool(scores.max() > max(_RIVAL * here, ALIKE))

    def _scores(
        self, picture: np.ndarray, known: Similarity, radius: float
    ) -> tuple[np.ndarray, Similarity, Similarity]:
        """How like it places in a picture are, in its middle that where `known` has it, _NOWHERE beyond the picture;
        the motions to the part by itself, and around its known place, both made smaller."""
        x, y, width, height = self.box
        middle = complex(x + width / 2, y + height / 2)
        extent = abs(known.turn) * max(width, height)
        share = min(1.0, _SOUGHT / extent)
        side = max(8, round(share * extent))
        half = complex(side, side) / 2
        alone = Similarity(share * known.turn, half - share * known.turn * middle)
        room = int(side + 2 * share * radius)
        around = Similarity(share, complex(room, room) / 2 - share * known(middle))
        look, weight = (cv2.warpAffine(each, matrix(alone), (side, side)) for each in (self._whole, self.weight))
        place, inside = (
            cv2.warpAffine(each, matrix(around), (room, room)) for each in (picture, np.ones(picture.shape, np.uint8))
        )
        scores = cv2.matchTemplate(place, look, cv2.TM_CCOEFF_NORMED, mask=weight)
        fits = cv2.erode(inside, np.ones((side, side), np.uint8), anchor=(0, 0), borderValue=0)
        fits = fits[: scores.shape[0], : scores.shape[1]].astype(bool) & np.isfinite(scores)
        return np.where(fits, scores, np.float32(_NOWHERE)), alone, around

    def rival(self, radius: float) -> float:
        """How like it something beside it looks, up to 1: the highest correlation with its own picture displaced by up
        to a radius of pixels, but for the hill around no displacement; 0: none is above ALIKE. Shading that is coarser
        than the windows does not count, as it tells no corner from another."""
        x, y, width, height = self.box
        room = round(radius)
        fine = self._whole - cv2.GaussianBlur(self._whole.astype(np.float32), (0, 0), _WINDOWS[1] / 2)
        place = cv2.copyMakeBorder(fine, room, room, room, room, cv2.BORDER_CONSTANT)
        place = place[y : y + height + 2 * room, x : x + width + 2 * room]
        # a level of noise: what is flat is like nothing
        place = place + np.random.default_rng(0).normal(0, 1, place.shape).astype(np.float32)
        part = place[room : room + height, room : room + width]
        weight = self.weight[y : y + height, x : x + width]
        scores = cv2.matchTemplate(place, part, cv2.TM_CCOEFF_NORMED, mask=weight)
        _, hills = cv2.connectedComponents((scores > ALIKE).astype(np.uint8))
        others = (hills > 0) & (hills != hills[room, room])
        return float(scores[others].max(initial=0.0))

    def astray(self, picture: np.ndarray, known: Similarity) -> tuple[np.ndarray, np.ndarray]:
        """Its corners that are found in a picture, around where a motion has them: where they were in its own, and how
        many pixels each has moved otherwise."""
        moved, good = self._flow(picture, known)
        good &= inside(picture, known(self.points))
        return self.points[good], np.abs(moved - self.points)[good]

    def again(self, picture: np.ndarray, motion: Similarity) -> Part | None:
        """The part as it looks in another picture after a motion; None: it is not in it."""
        weight = cv2.warpAffine(self.weight, matrix(motion), picture.shape[::-1])
        return Part(picture, weight) if (weight > 0).any() else None

    def learn(self, match: Match) -> None:
        """Takes in which corners move with the part, and which do not."""
        wanted = self._weights * np.where(match.agreeing, 1.0, 0.05)
        self._believed += np.where(match.seen, 0.2 * (wanted - self._believed), 0)

    def _match(self, picture: np.ndarray, guess: Similarity, motion: Motion) -> Match | None:
        seen = inside(picture, guess(self.points), 2)
        total, weights = self._believed.sum(), np.where(seen, self._believed, 0)
        if seen.sum() < FEWEST[motion] or weights.sum() <= 0.02 * total:
            return None
        moved, good = self._flow(picture, guess)
        good &= seen
        tolerance = max(1.0, max(picture.shape) / 640)
        fitted = fit(self.points, moved, np.where(good, weights, 0), motion, tolerance)
        if fitted is None:
            return None
        change, agreeing = fitted
        off = np.abs(change(self.points) - moved)
        error = _expected_error(self.points[agreeing], off[agreeing], weights[agreeing], self._ends, motion)
        found = guess.after(change)
        return Match(
            motion=found,
            agreeing=agreeing,
            seen=seen,
            share=float(weights[agreeing].sum() / weights.sum()),
            visible=float(weights.sum() / total),
            error=error,
            held=found(self.points[agreeing]),
        )

    def _flow(self, picture: np.ndarray, guess: Similarity) -> tuple[np.ndarray, np.ndarray]:
        """Where each corner is in a picture that is taken back by a guess, and whether it comes back from there."""
        size, flags = self._picture.shape[::-1], cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        back = cv2.warpAffine(picture, matrix(guess, self._origin), size, flags=flags)
        there, is_good = _there_and_back(self._picture, back, self.points - self._origin, self._side)
        return there + self._origin, is_good

    def _likeness(self, picture: np.ndarray, motion: Similarity) -> float:
        """Correlation of the part's pixels with those in another picture, as far as they lie in it; both smaller."""
        x, y, width, height = self.box
        share = min(1.0, _SOUGHT / max(width, height))
        size = max(1, round(share * width)), max(1, round(share * height))
        small = Similarity(share, -share * complex(x, y))
        there = matrix(small.after(motion.inverse()))
        first, weight = (cv2.warpAffine(each, matrix(small), size) for each in (self._whole, self.weight))
        inside = cv2.warpAffine(np.ones(picture.shape, np.uint8), there, size)
        return correlation(first, cv2.warpAffine(picture, there, size), weight * inside)


def traced(pictures: Sequence[np.ndarray], points: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Where points (n,) of the first picture are in the last one, by flow from each picture to the next; NaN: lost.

    step: (n,) how they may move up to the second picture; they go on like that, more or less"""
    places = np.full(len(points), complex(np.nan, np.nan))
    left = np.arange(len(points))
    reach = _SOUGHT + len(pictures) * int(np.abs(step).max())
    low = [max(int(side.min()) - reach, 0) for side in (points.imag, points.real)]
    high = [int(side.max()) + reach for side in (points.imag, points.real)]
    pictures = [np.ascontiguousarray(each[low[0] : high[0], low[1] : high[1]]) for each in pictures]
    points = points - complex(low[1], low[0])
    for first, second in pairwise(pictures):
        there, is_good = _there_and_back(first, second, points, _TRACED, step)
        if not is_good.any():
            return places
        left, step, points = left[is_good], (there - points)[is_good], there[is_good]
    places[left] = points + complex(low[1], low[0])
    return places


def _there_and_back(
    first: np.ndarray, second: np.ndarray, points: np.ndarray, side: int, step: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Where points (n,) of a picture are in another one, and whether they come back from there (n,) bool.

    side: of the windows that are compared, in pixels; step: (n,) how they may move"""
    ways = None, None, (side, side), _LEVELS, _UNTIL, cv2.OPTFLOW_USE_INITIAL_FLOW
    start = _pairs(points)
    guess = start.copy() if step is None else _pairs(points + step)
    there, forth, _ = cv2.calcOpticalFlowPyrLK(first, second, start, guess, *ways)
    guess = there.copy() if step is None else start.copy()
    again, back, _ = cv2.calcOpticalFlowPyrLK(second, first, there, guess, *ways)
    return plane(there), (forth & back).ravel().astype(bool) & (np.abs(plane(again) - points) < _THERE_AND_BACK)


def correlation(first: np.ndarray, second: np.ndarray, weight: np.ndarray) -> float:
    """Correlation of two pictures, −1 to 1, each pixel by its weight; contrast that noise may have counts for none."""
    total = float(weight.sum(dtype=np.float64))
    if total <= 0:
        return 0.0
    first, second = first.astype(np.float32), second.astype(np.float32)
    first -= float((first * weight).sum(dtype=np.float64)) / total
    second -= float((second * weight).sum(dtype=np.float64)) / total
    cross, *powers = (
        float((weight * a * b).sum(dtype=np.float64)) / total for a, b in ((first, second), (first,) * 2, (second,) * 2)
    )
    return (cross + _NOISE) / (np.sqrt((powers[0] + _NOISE) * (powers[1] + _NOISE)))


def fit(
    source: np.ndarray, target: np.ndarray, weights: np.ndarray, motion: Motion, tolerance: float
) -> tuple[Similarity, np.ndarray] | None:
    """The similarity close to none that takes most weight of the source's points to the target's within a tolerance in
    pixels, and which points (n,) bool; None: too few agree. By RANSAC, then by least squares."""
    usable = np.flatnonzero(weights > 0)
    if len(usable) < FEWEST[motion]:
        return None
    p, q, w = source[usable], target[usable], weights[usable]
    turns, shifts = _hypotheses(p, q, motion)
    off = np.abs(turns[:, None] * p + shifts[:, None] - q)
    scores = (w * np.maximum(0, 1 - (off / tolerance) ** 2)).sum(axis=1)
    best = int(scores.argmax())
    fitted = Similarity(complex(turns[best]), complex(shifts[best]))
    for _ in range(4):
        off = np.abs(fitted(p) - q)
        close = off < tolerance
        if close.sum() < FEWEST[motion]:
            return None
        fitted = least_squares(p[close], q[close], (w * (1 - (off / tolerance) ** 2))[close], motion)
    agreeing = np.zeros(len(source), bool)
    agreeing[usable[np.abs(fitted(p) - q) < tolerance]] = True
    return (fitted, agreeing) if agreeing.sum() >= FEWEST[motion] else None


def _hypotheses(p: np.ndarray, q: np.ndarray, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Turns and shifts (k,) of similarities, each by one or two pairs of points."""
    count = len(p)
    shifts = (q - p)[:: -(-count // _HYPOTHESES)]
    if motion == "location":
        return np.ones(len(shifts), complex), shifts
    random = np.random.default_rng(0)
    first = random.integers(count, size=_HYPOTHESES)
    second = (first + random.integers(1, count, size=_HYPOTHESES)) % count
    apart = np.abs(p[second] - p[first]) > 2
    if not apart.any():
        return np.ones(len(shifts), complex), shifts
    first, second = first[apart], second[apart]
    turns = (q[second] - q[first]) / (p[second] - p[first])
    size = np.abs(turns)
    likely = (size > 1 / _MOST_SCALE) & (size < _MOST_SCALE) & (np.abs(np.angle(turns)) < _MOST_TURN)
    turns = np.where(likely, turns, 1)
    if motion == "rotation":
        turns = turns / np.abs(turns)
    return turns, (q[first] + q[second] - turns * (p[first] + p[second])) / 2


def least_squares(p: np.ndarray, q: np.ndarray, weights: np.ndarray, motion: Motion) -> Similarity:
    """The best similarity between points, by complex regression."""
    total = weights.sum()
    middle, target = (weights * p).sum() / total, (weights * q).sum() / total
    turn = 1 + 0j
    if motion != "location":
        turn = (weights * (p - middle).conj() * (q - target)).sum()
        spread = (weights * np.abs(p - middle) ** 2).sum()
        if motion == "rotation":
            spread = np.abs(turn)
        turn = complex(turn / spread) if spread > 0 else 1 + 0j
    return Similarity(turn, complex(target - turn * middle))


def _expected_error(
    points: np.ndarray, off: np.ndarray, weights: np.ndarray, ends: np.ndarray, motion: Motion
) -> float:
    """Standard error in pixels, where it is largest, of a motion that was fitted to points which it leaves off by so
    much. Corners beside one another err alike: only every fourth counts as one by itself."""
    count = max(len(points) / 4, 1.0)
    variance = float((weights * off**2).sum() / weights.sum()) / count
    if motion == "location":
        return float(np.sqrt(variance))
    middle = (weights * points).sum() / weights.sum()
    spread = float((weights * np.abs(points - middle) ** 2).sum() / weights.sum())
    lever = float((np.abs(ends - middle) ** 2).max()) / max(spread, 1e-9)
    return float(np.sqrt(variance * (1 + lever)))


def _corners(picture: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The corners (n,) in the part of a picture whose weight is above 0, more than noise and apart from one another."""
    mask = (weight > 0).astype(np.uint8)
    apart = max(3.0, np.sqrt(mask.sum() / MOST_CORNERS) * 0.6)
    strength = cv2.cornerMinEigenVal(picture, 5)
    mask &= (strength > _WEAKEST).astype(np.uint8)
    corners = cv2.goodFeaturesToTrack(picture, MOST_CORNERS, _QUALITY, apart, mask=mask, blockSize=5)
    return np.zeros(0, complex) if corners is None else plane(corners)


def plane(places: np.ndarray) -> np.ndarray:
    """Points (…, 2) as complex numbers (n,)."""
    x, y = places.reshape(-1, 2).astype(np.float64).T
    return x + 1j * y


def _pairs(points: np.ndarray) -> np.ndarray:
    return np.stack([points.real, points.imag], axis=-1).astype(np.float32, order="C").reshape(-1, 1, 2)


def inside(picture: np.ndarray, points: np.ndarray, margin: float = 0) -> np.ndarray:
    """Which points (n,) lie in a picture (H, W), a margin in pixels away from its edges (n,) bool."""
    height, width = picture.shape
    across = (points.real >= margin) & (points.real < width - margin)
    return across & (points.imag >= margin) & (points.imag < height - margin)


def matrix(motion: Similarity, origin: complex = 0) -> np.ndarray:
    """OpenCV's (2, 3) of a motion that begins in a picture cropped to `origin`."""
    shift = motion(origin)
    turn = motion.turn
    return np.array([[turn.real, -turn.imag, shift.real], [turn.imag, turn.real, shift.imag]])
