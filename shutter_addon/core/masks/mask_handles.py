"""Handles of a mask's splines, as Blender makes them follow the points."""

from __future__ import annotations

import numpy as np

# Types of handles, as Blender numbers them.
FREE, AUTO, VECTOR, ALIGNED, ALIGNED_DOUBLESIDE = 0, 1, 2, 3, 5
# By which an automatic handle is about as long as a circle's.
_ROUND = 2.5614
_SHORTEST = 1e-5


def with_handles(points: np.ndarray, types: np.ndarray, selected: np.ndarray, cyclic: bool) -> np.ndarray:
    """The points of a spline (n, 3, 2), of each its left handle, itself and its right one, with the handles that follow
    from their types (n, 2). selected: of which points (n,) the left handle is, which aligned handles follow."""
    if len(points) < 2:
        return points
    middle = points[:, 1]
    before, after = np.roll(middle, 1, axis=0), np.roll(middle, -1, axis=0)
    if not cyclic:
        before[0], after[-1] = 2 * middle[0] - after[0], 2 * middle[-1] - before[-1]
    return _aligned(_smoothed(points, types, middle - before, after - middle), types, selected)


def _smoothed(points: np.ndarray, types: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The points with automatic and vector handles; before, after: the ways (n, 2) from and to the neighbours."""
    long_before, long_after = (np.where(length > 0, length, 1) for length in map(_lengths, (before, after)))
    along = after / long_after + before / long_before
    unit = _lengths(along) * _ROUND
    short_before = np.minimum(long_before, 5 * long_after)
    short_after = np.minimum(long_after, 5 * short_before)
    # Where the way turns back, Blender leaves automatic handles as they are.
    turns = np.where(unit > 0, unit, 1)
    automatic = (types == AUTO) & (unit > 0)
    middle = points[:, 1]
    left = np.where(automatic[:, :1], middle - along * (short_before / turns), points[:, 0])
    right = np.where(automatic[:, 1:], middle + along * (short_after / turns), points[:, 2])
    left = np.where(types[:, :1] == VECTOR, middle - before / 3, left)
    right = np.where(types[:, 1:] == VECTOR, middle + after / 3, right)
    return np.stack([left, middle, right], axis=1)


def _aligned(points: np.ndarray, types: np.ndarray, selected: np.ndarray) -> np.ndarray:
    """The points with aligned handles in line: one of the two is turned, its length kept."""
    turned = ((types == ALIGNED) | (types == ALIGNED_DOUBLESIDE)) & (types != FREE).all(axis=1, keepdims=True)
    left, middle, right = points[:, 0], points[:, 1], points[:, 2]
    long_left, long_right = _lengths(left - middle), _lengths(right - middle)
    ratio = np.where(long_left > 0, long_left, 1) / np.where(long_right > 0, long_right, 1)
    turn_left = turned[:, 0] & ((long_right == 0) | (long_right > _SHORTEST))[:, 0]
    turn_right = turned[:, 1] & ((long_left == 0) | (long_left > _SHORTEST))[:, 0]
    # Once one is in line, turning the other changes nothing.
    left_first = turn_left & ~(selected & turn_right)
    right_first = turn_right & ~left_first
    new_left = np.where(left_first[:, None], middle + ratio * (middle - right), left)
    new_right = np.where(right_first[:, None], middle + (middle - left) / ratio, right)
    return np.stack([new_left, middle, new_right], axis=1)


def _lengths(vectors: np.ndarray) -> np.ndarray:
    return np.linalg.norm(vectors, axis=1, keepdims=True)
