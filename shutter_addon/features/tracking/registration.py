"""Find how a part of a picture moved: corners, Lucas and Kanade's optical flow, RANSAC.

Pictures are grey, (H, W) uint8. Points are complex: x + iy in pixels, y down, whole numbers at the centers of pixels.
Motions are similarities (movement, rotation and scale) between such points. Results do not depend on the number of
threads.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import get_args

import numpy as np

from ...core.model.motions import Motion, Similarity
from ...media.opencv import cv2

# What may change, from only the location to location, rotation and scale.
MOTIONS = get_args(Motion)

MOST_CORNERS = 200
FEWEST = {"location": 4, "rotation": 5, "scale": 5}  # corners that must agree
_QUALITY = 0.01  # the least quality of a corner, as a share of the best one's
_WEAKEST = 2e-4  # the least quality of any corner; noise of a few levels has less
_LEVELS = 3  # motions up to about 2 ** _LEVELS half windows are found
_WINDOWS = 9, 21  # sides of the compared windows in pixels, for small and large parts
_UNTIL = 3, 30, 0.01  # OpenCV's criteria: 30 steps, or a step below 0.01 pixels
_THERE_AND_BACK = 1.0  # pixels by which a corner that is traced back may miss its start
_HYPOTHESES = 300
_SOUGHT = 64  # the size in pixels of a part that is searched for or compared as a whole
ALIKE = 0.6  # the correlation from which on something else may be confused with a part
_NOWHERE = -2.0  # instead of a correlation, where a part has no room
_RIVAL = 0.85  # the share of its own likeness from which on something else may be the part
_TRACED = 13  # the side of the windows that trace points through pictures
_NOISE = 16.0  # contrast in levels² that may be noise, and does not make pictures unlike
# The largest scale and turn between two pictures of a film.
_MOST_SCALE, _MOST_TURN = 1.5, 0.8


def distances(mask: np.ndarray) -> np.ndarray:
    """Return the distance of each pixel, in pixels, to the nearest one where a mask (H, W) bool is true."""
    return cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 0)


@dataclass(frozen=True)
class Match:
    """Where a part of one picture was found in another picture.

    Attributes:
        motion: From the part's picture to the other one.
        agreeing: Which of the part's corners move like this, (n,) bool.
        seen: Which corners are expected inside the other picture, (n,) bool.
        share: Total weight of the agreeing corners, as a fraction of that of the seen ones.
        visible: Total weight of the seen corners, as a fraction of that of all.
        error: Standard error of the motion, in pixels, where it is largest in the part's bounding box.
        held: Positions of the agreeing corners in the other picture, (k,) complex.
        likeness: Correlation of the part's pixels with the picture there, −1 to 1.
    """

    motion: Similarity
    agreeing: np.ndarray
    seen: np.ndarray
    share: float
    visible: float
    error: float
    held: np.ndarray
    likeness: float = 0.0


class TrackedPart:
    """A part of a picture that can be found in other pictures, by its corners: points that optical flow can follow.

    Corners have weights: how much they belong to the part. `learn` lowers those of corners of the background.
    """

    def __init__(self, picture: np.ndarray, weight: np.ndarray) -> None:
        """Take a part of a picture, and find its corners.

        Args:
            picture: (H, W) uint8.
            weight: (H, W) float32, 0 to 1: how much each pixel belongs to the part; not 0 everywhere.
        """
        self.weight, self._whole = weight, picture
        x, y, width, height = cv2.boundingRect((weight > 0).astype(np.uint8))
        self.box = x, y, width, height
        self._side = int(np.clip(max(width, height) / 4, *_WINDOWS)) // 2 * 2 + 1
        margin = self._side * 2
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
        """Find the part in a picture by its corners.

        Args:
            guess: The motion to expect, from the part's picture to this one.
            motion: What may change, one of MOTIONS.

        Returns:
            None if its corners are not found near the guess, or do not agree on a motion.
        """
        match = self._match(picture, guess, motion)
        for _ in range(2):  # after a bad guess, start again from what was found
            if match is None or np.abs(match.motion(self._ends) - guess(self._ends)).max() < 2:
                break
            guess = match.motion
            match = self._match(picture, guess, motion)
        return match and replace(match, likeness=self._likeness(picture, match.motion))

    def seek(self, picture: np.ndarray, known: Similarity, radius: float) -> Similarity | None:
        """Return the motion to the place in a picture that looks most like the part, as a guess for `find`.

        Args:
            picture: (H, W) uint8.
            known: Motion from the part's own picture to the place around which to search, with the result's rotation
                and scale.
            radius: How far from there to search, in pixels.

        Returns:
            The motion from the part's own picture. None: nowhere there does the whole part fit into the picture.
        """
        scores, alone, around = self._scores(picture, known, radius)
        _, likeness, _, best = cv2.minMaxLoc(scores)
        return None if likeness <= _NOWHERE else around.inverse().after(Similarity(1, complex(*best))).after(alone)

    def lookalike(self, picture: np.ndarray, known: Similarity) -> bool:
        """Tell whether something elsewhere in a picture looks nearly as much like the part as its own place does.

        Args:
            known: Motion from the part's own picture to its place in this one.
        """
        scores, _, _ = self._scores(picture, known, max(picture.shape))
        y, x = (length // 2 for length in scores.shape)
        apart = [max(1, round(_SOUGHT / 2 * length / max(self.box[2:]))) for length in self.box[2:]]
        own = np.s_[max(y - apart[1], 0) : y + apart[1] + 1, max(x - apart[0], 0) : x + apart[0] + 1]
        here, scores[own] = scores[own].max(), _NOWHERE
        return bool(scores.max() > max(_RIVAL * here, ALIKE))

    def _scores(
        self, picture: np.ndarray, known: Similarity, radius: float
    ) -> tuple[np.ndarray, Similarity, Similarity]:
        """Correlate the part with a picture, at each place around a known one. Both are reduced, which saves time.

        Args:
            known: Motion from the part's own picture to the known place.
            radius: How far from there, in pixels.

        Returns:
            The correlations (rows, columns), with the known place in the middle, and _NOWHERE where the part does not
            fit into the picture; the motion from the part's own picture to its reduced one; and that from `picture` to
            the reduced picture of the surroundings.
        """
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
        place = cv2.warpAffine(picture, matrix(around), (room, room))
        inside = cv2.warpAffine(np.ones(picture.shape, np.uint8), matrix(around), (room, room))
        scores = cv2.matchTemplate(place, look, cv2.TM_CCOEFF_NORMED, mask=weight)
        fits = cv2.erode(inside, np.ones((side, side), np.uint8), anchor=(0, 0), borderValue=0)
        fits = fits[: scores.shape[0], : scores.shape[1]].astype(bool) & np.isfinite(scores)
        return np.where(fits, scores, np.float32(_NOWHERE)), alone, around

    def rival(self, radius: float) -> float:
        """Return how much the part's surroundings look like it, 0 to 1: how easily tracking slips onto them.

        It is the highest correlation of the part with places up to `radius` pixels away in its own picture, apart from
        the peak around the part's place; 0 if none is above ALIKE. Gradual shading, which does not distinguish corners,
        is ignored.
        """
        x, y, width, height = self.box
        room = round(radius)
        fine = self._whole - cv2.GaussianBlur(self._whole.astype(np.float32), (0, 0), _WINDOWS[1] / 2)
        place = cv2.copyMakeBorder(fine, room, room, room, room, cv2.BORDER_CONSTANT)
        place = place[y : y + height + 2 * room, x : x + width + 2 * room]
        # noise of a level, so that flat areas correlate with nothing
        place = place + np.random.default_rng(0).normal(0, 1, place.shape).astype(np.float32)
        part = place[room : room + height, room : room + width]
        weight = self.weight[y : y + height, x : x + width]
        scores = cv2.matchTemplate(place, part, cv2.TM_CCOEFF_NORMED, mask=weight)
        _, hills = cv2.connectedComponents((scores > ALIKE).astype(np.uint8))
        others = (hills > 0) & (hills != hills[room, room])
        return float(scores[others].max(initial=0.0))

    def astray(self, picture: np.ndarray, known: Similarity) -> tuple[np.ndarray, np.ndarray]:
        """Return how far corners of the part are from where a known motion takes them, in another picture.

        Args:
            known: The motion from the part's own picture to that one.

        Returns:
            Positions of the corners that were found, in the part's own picture, (n,) complex; and how far each is off,
            in pixels of it, (n,).
        """
        moved, good = self._flow(picture, known)
        good &= inside(picture, known(self.points))
        return self.points[good], np.abs(moved - self.points)[good]

    def again(self, picture: np.ndarray, motion: Similarity) -> TrackedPart | None:
        """Take the part anew from another picture, where `motion` takes it; None: that is outside the picture."""
        weight = cv2.warpAffine(self.weight, matrix(motion), picture.shape[::-1])
        return TrackedPart(picture, weight) if (weight > 0).any() else None

    def learn(self, match: Match) -> None:
        """Lower the weights of seen corners that did not move with the part in a match; restore those that did."""
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
        share, visible = float(weights[agreeing].sum() / weights.sum()), float(weights.sum() / total)
        held = found(self.points[agreeing])
        return Match(motion=found, agreeing=agreeing, seen=seen, share=share, visible=visible, error=error, held=held)

    def _flow(self, picture: np.ndarray, guess: Similarity) -> tuple[np.ndarray, np.ndarray]:
        """Find each corner in another picture by optical flow, near where a guess takes it.

        Args:
            guess: The motion to expect, from the part's own picture to this one.

        Returns:
            Where each corner is found, after undoing the guess: the corner itself if the guess is right, (n,) complex.
            And whether flow from there leads back to the corner, (n,) bool.
        """
        size, flags = self._picture.shape[::-1], cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        back = cv2.warpAffine(picture, matrix(guess, self._origin), size, flags=flags)
        there, is_good = _there_and_back(self._picture, back, self.points - self._origin, self._side)
        return there + self._origin, is_good

    def _likeness(self, picture: np.ndarray, motion: Similarity) -> float:
        """Return the correlation of the part's pixels with another picture where a motion takes them, −1 to 1.

        Both are reduced, and only what is inside that picture counts; 0 if nothing is.
        """
        x, y, width, height = self.box
        share = min(1.0, _SOUGHT / max(width, height))
        size = max(1, round(share * width)), max(1, round(share * height))
        small = Similarity(share, -share * complex(x, y))
        there = matrix(small.after(motion.inverse()))
        first, weight = (cv2.warpAffine(each, matrix(small), size) for each in (self._whole, self.weight))
        inside = cv2.warpAffine(np.ones(picture.shape, np.uint8), there, size)
        return correlation(first, cv2.warpAffine(picture, there, size), weight * inside)


def traced(pictures: Sequence[np.ndarray], points: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Follow points through pictures by optical flow, and return their places in the last picture.

    Args:
        pictures: Successive pictures, (H, W) uint8 each.
        points: (n,), in the first picture.
        step: (n,), a guess of their motion to the second picture.

    Returns:
        (n,), NaN for points that were lost.
    """
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
    """Find points in another picture by optical flow, and check that flow leads back from there.

    Args:
        first: (H, W) uint8.
        second: (H, W) uint8.
        points: (n,), in `first`.
        side: Of the compared windows, in pixels.
        step: (n,), a guess of their motion; None: none.

    Returns:
        Their places in `second` (n,), and whether flow leads back to the points (n,) bool.
    """
    ways = None, None, (side, side), _LEVELS, _UNTIL, cv2.OPTFLOW_USE_INITIAL_FLOW
    start = _pairs(points)
    guess = start.copy() if step is None else _pairs(points + step)
    there, forth, _ = cv2.calcOpticalFlowPyrLK(first, second, start, guess, *ways)
    guess = there.copy() if step is None else start.copy()
    again, back, _ = cv2.calcOpticalFlowPyrLK(second, first, there, guess, *ways)
    return plane(there), (forth & back).ravel().astype(bool) & (np.abs(plane(again) - points) < _THERE_AND_BACK)


def correlation(first: np.ndarray, second: np.ndarray, weight: np.ndarray) -> float:
    """Return the weighted correlation of two pictures, −1 to 1. Differences that may be noise alone do not lower it."""
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
    """Fit a similarity to pairs of points: by RANSAC, which ignores those that do not agree, then by least squares.

    Args:
        source: (n,), the points before.
        target: (n,), the points after.
        weights: (n,); points with 0 do not count.
        motion: What may change, one of MOTIONS.
        tolerance: Pixels up to which a pair agrees.

    Returns:
        The similarity, and which points agree (n,) bool. None: too few agree.
    """
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
    """Return candidates for a similarity that takes points p to points q (n,), from which `fit` chooses (RANSAC).

    Each is made from two pairs of a point and its target, or from one (motion "location", or if the points lie
    too close together).

    Args:
        motion: What may change, one of MOTIONS.

    Returns:
        For k candidates: factors (k,) (rotation and scale as a complex number) and shifts (k,). A point z moves to
        factor · z + shift.
    """
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
    """Return the similarity from points p (n,) to points q (n,) with the least weighted squares of errors.

    Args:
        motion: What may change, one of MOTIONS.
    """
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
    """Return the largest standard error, in pixels, of a fitted motion at the ends of a part.

    Errors of close corners are correlated, so four corners count as one.

    Args:
        points: The agreeing corners (n,).
        off: How far the motion misses each, in pixels (n,).
        weights: Of the corners (n,).
        ends: The corners of the part's bounding box (4,).
        motion: What was fitted, one of MOTIONS.
    """
    count = max(len(points) / 4, 1.0)
    variance = float((weights * off**2).sum() / weights.sum()) / count
    if motion == "location":
        return float(np.sqrt(variance))
    middle = (weights * points).sum() / weights.sum()
    spread = float((weights * np.abs(points - middle) ** 2).sum() / weights.sum())
    lever = float((np.abs(ends - middle) ** 2).max()) / max(spread, 1e-9)
    return float(np.sqrt(variance * (1 + lever)))


def _corners(picture: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Find corners (n,) of a picture where the weight is above 0: stronger than noise, and not too close together."""
    mask = (weight > 0).astype(np.uint8)
    apart = max(3.0, np.sqrt(mask.sum() / MOST_CORNERS) * 0.6)
    strength = cv2.cornerMinEigenVal(picture, 5)
    mask &= (strength > _WEAKEST).astype(np.uint8)
    corners = cv2.goodFeaturesToTrack(picture, MOST_CORNERS, _QUALITY, apart, mask=mask, blockSize=5)
    return np.zeros(0, complex) if corners is None else plane(corners)


def plane(places: np.ndarray) -> np.ndarray:
    """Convert points (…, 2), x and y, to complex numbers x + iy, (n,)."""
    x, y = places.reshape(-1, 2).astype(np.float64).T
    return x + 1j * y


def _pairs(points: np.ndarray) -> np.ndarray:
    return np.stack([points.real, points.imag], axis=-1).astype(np.float32, order="C").reshape(-1, 1, 2)


def inside(picture: np.ndarray, points: np.ndarray, margin: float = 0) -> np.ndarray:
    """Return which points (n,) are inside a picture (H, W), at least `margin` pixels from its edges."""
    height, width = picture.shape
    across = (points.real >= margin) & (points.real < width - margin)
    return across & (points.imag >= margin) & (points.imag < height - margin)


def matrix(motion: Similarity, origin: complex = 0) -> np.ndarray:
    """Return OpenCV's (2, 3) matrix of a motion, for points relative to `origin`. What they move to is not relative."""
    shift = motion(origin)
    turn = motion.turn
    return np.array([[turn.real, -turn.imag, shift.real], [turn.imag, turn.real, shift.imag]])
