"""Outlines as splines with shape keys: curves of some frames, joined to chains whose number of points stays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from . import outlines, scribbles

ALIKE = 0.1  # how much two curves have in common, from 0 to 1, from which on one goes into the other
FAR = 2.0  # of both their radii, taken for circles: what is farther apart has nothing in common
_LINES = 128  # rows of the picture in which that is measured
_STEP, _POINTS = 0.008, (12, 256)  # parts of the picture's height from point to point; how many these may be


class Chain(NamedTuple):
    """A curve that goes from frame to frame.

    frames: ascending; points: (frames, points, 2) float64, fractions of the picture, y up
    gone: the first of all frames from which on it is not there; None: it stays"""

    frames: tuple[int, ...]
    points: np.ndarray
    gone: int | None


def chains(drawn: Sequence[tuple[int, outlines.Curves]], aspect: float) -> list[Chain]:
    """Chains of all curves of some frames, which ascend: a curve goes on as the one of the next frame with which it
    has most in common. aspect: the picture's width over its height"""
    open_ones: list[list[tuple[int, np.ndarray]]] = []
    found: list[tuple[list[tuple[int, np.ndarray]], int | None]] = []
    for frame, curves in drawn:
        shapes = [_turned(np.asarray(curve, np.float64)) for curve in curves if len(curve) > 2]
        pairs = _pairs([chain[-1][1] for chain in open_ones], shapes, aspect)
        found += [(chain, frame) for index, chain in enumerate(open_ones) if index not in pairs]
        going = [[*open_ones[index], (frame, shapes[to])] for index, to in pairs.items()]
        new = set(range(len(shapes))) - set(pairs.values())
        open_ones = going + [[(frame, shapes[index])] for index in sorted(new)]
    return [_chain(curves, gone, aspect) for curves, gone in (*found, *((chain, None) for chain in open_ones))]


def _pairs(before: list[np.ndarray], after: list[np.ndarray], aspect: float) -> dict[int, int]:
    """Which curve goes into which, those first that have most in common."""
    shapes = [[_Shape.of(curve, aspect) for curve in curves] for curves in (before, after)]
    alike = {(i, j): a.alike(b) for i, a in enumerate(shapes[0]) for j, b in enumerate(shapes[1])}
    pairs: dict[int, int] = {}
    for (i, j), share in sorted(alike.items(), key=lambda entry: -entry[1]):
        if share >= ALIKE and i not in pairs and j not in pairs.values():
            pairs[i] = j
    return pairs


class _Shape(NamedTuple):
    """What a curve encloses.

    middle: (2,) heights of the picture; inside: (rows, columns) 0 to 1, moved to the middle of the picture"""

    middle: np.ndarray
    inside: np.ndarray

    @staticmethod
    def of(curve: np.ndarray, aspect: float) -> _Shape:
        middle = (curve.min(axis=0) + curve.max(axis=0)) / 2
        inside = outlines.coverage([curve - middle + 0.5], max(1, round(_LINES * aspect)), _LINES)
        return _Shape(middle * (aspect, 1), inside)

    def alike(self, other: _Shape) -> float:
        """How much both have in common, from 0 to 1: of what they enclose, and of where."""
        reach = sum(np.sqrt(shape.inside.sum() / np.pi) / _LINES for shape in (self, other)) * FAR
        if reach == 0:
            return 0.0
        common = np.minimum(self.inside, other.inside).sum() / np.maximum(self.inside, other.inside).sum()
        return float(common * max(0.0, 1 - np.hypot(*(self.middle - other.middle)) / reach))


def _turned(curve: np.ndarray) -> np.ndarray:
    """Counter-clockwise."""
    x, y = curve.T
    return curve if np.dot(x, np.roll(y, -1)) >= np.dot(y, np.roll(x, -1)) else curve[::-1]


def _chain(curves: list[tuple[int, np.ndarray]], gone: int | None, aspect: float) -> Chain:
    closed = [np.concatenate([curve, curve[:1]]) for _frame, curve in curves]
    longest = max(np.hypot(*(np.diff(curve, axis=0) * (aspect, 1)).T).sum() for curve in closed)
    count = int(np.clip(np.ceil(longest / _STEP), *_POINTS))
    points = [scribbles.resample(curve, count + 1, aspect)[:-1] for curve in closed]
    for before, index in enumerate(range(1, len(points))):
        points[index] = _aligned(points[before], points[index], aspect)
    return Chain(tuple(frame for frame, _curve in curves), np.stack(points), gone)


def _aligned(before: np.ndarray, curve: np.ndarray, aspect: float) -> np.ndarray:
    """The points of a curve, from that on which is best to begin with, for each to lie near that of the one before."""
    fixed, moved = ((points - points.mean(axis=0)) * (aspect, 1) for points in (before, curve))
    alike = sum(np.fft.irfft(np.conj(np.fft.rfft(fixed[:, k])) * np.fft.rfft(moved[:, k]), len(curve)) for k in (0, 1))
    return np.roll(curve, -int(np.argmax(alike)), axis=0)
