"""How far what footage shows moves from frame to frame: whether an exposure over several of them streaks, or shows
copies of what moves side by side. No bpy."""

from typing import NamedTuple

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model.motions import Similarity
from . import flow

ROWS = 270  # of the pictures that are compared
# The share of the picture that moves at least so far, of all whose motion is known: what is smaller is not looked at.
SHARE = 0.01
_THERE_AND_BACK = 0.2, 0.5  # of a vector, and pixels beside that, by which the way back may miss where it started
# Copies that lie so far apart, in heights of the picture, look like a streak: 3 pixels of 1080; at 4, lines show in
# sharp lettering. Edges of footage are some 2 pixels wide, however small it is.
_SMOOTH, _SMOOTH_PIXELS = 3 / 1080, 2.0
_KNOWN = 0.25  # of the picture whose motion has to be known: across a cut, that of little is


class Moved(NamedTuple):
    """Where places of a frame, (n,) complex, lie in the next one: x + iy in fractions of the height, y down."""

    before: np.ndarray
    after: np.ndarray


def moved(source: FrameSource, index: int, other: int | None = None) -> Moved | None:
    """What moves from a frame to another, or else to the next one; None: that cannot be told, as across a cut. It reads
    both. It takes OpenCV. MediaError: they cannot be read."""
    first, second = (flow.of_rows(source.read(i), source, ROWS) for i in (index, other or index + 1))
    if min(first.shape) < flow.SMALLEST:
        return None
    forth, back = flow.vectors(first, second), flow.vectors(second, first)
    rows, columns = np.mgrid[: first.shape[0], : first.shape[1]]
    places = columns + 1j * rows
    forth, back = (vectors[..., 0] + 1j * vectors[..., 1] for vectors in (forth, back))
    ends = places + forth
    x, y = np.rint(ends.real).astype(int), np.rint(ends.imag).astype(int)
    inside = (x >= 0) & (x < first.shape[1]) & (y >= 0) & (y < first.shape[0])
    returned = np.abs(forth + back[np.where(inside, y, 0), np.where(inside, x, 0)])
    known = inside & (returned <= _THERE_AND_BACK[0] * np.abs(forth) + _THERE_AND_BACK[1])
    if known.mean() < _KNOWN:
        return None
    known[:, ::2] = known[::2] = False  # a quarter of them is enough
    return Moved(*(points[known].astype(np.complex64) / first.shape[0] for points in (places, ends)))


def step(moved: Moved, before: Similarity, after: Similarity) -> float:
    """How far, in heights of the picture, what moves most goes in an exposure that follows something: SHARE of the
    picture goes as far or farther.

    before, after: where the points of the shown picture lie in the two frames, in heights of the picture"""
    ways = after.inverse()(moved.after) - before.inverse()(moved.before)
    return float(np.quantile(np.abs(ways), 1 - SHARE))


def smooth(height: int) -> float:
    """Up to how many pixels from frame to frame a streak looks smooth, in a picture of that height."""
    return max(_SMOOTH * height, _SMOOTH_PIXELS)
