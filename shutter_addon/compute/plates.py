"""Plates: what lies behind layers where the window never saw it, from frames further away, or from what is around."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from ..core.model.frame_state import Following
from ..core.pixels import compositor

# How much of what lies behind has to be seen of a pixel that a plate is taken from.
SEEN = 0.9
# Kinds of pixels: seen, taken from another frame, filled from what is around.
OPEN, TAKEN, FILLED = 0, 1, 2


def nearest_frames(index: int, frames: range) -> Iterable[int]:
    """Source frames in the order in which a plate is taken from them: those nearest to frame `index`, of two the
    earlier."""
    return sorted(frames, key=lambda frame: (abs(frame - index), frame))


def plate(
    holes: np.ndarray,
    frames: Iterable[int],
    read: Callable[[int], np.ndarray],
    clear: Callable[[int], np.ndarray],
    camera: Following | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """What lies behind layers in the pixels `holes` (H, W) bool: a picture (H, W, 4) float32, scene-linear and
    premultiplied, and the kinds (H, W) uint8 of its pixels.

    frames: source frames, the first is asked first
    read, clear: a frame's picture, and how much (H, W) of what lies behind is seen in it
    camera: how what the camera sees moves; None: it stands still"""
    height, width = holes.shape
    picture, kinds = np.zeros((height, width, 4), np.float32), np.where(holes, FILLED, OPEN).astype(np.uint8)
    rows, columns = np.nonzero(holes)
    for frame in frames:
        if not rows.size:
            break
        seen, places = clear(frame), columns + 1j * rows
        if camera is not None:
            turns, shifts = camera.at([frame])
            places = turns[0, 0] * places + shifts[0, 0]
        x, y = np.rint(places.real).astype(int), np.rint(places.imag).astype(int)
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        found = inside & (seen[y.clip(0, height - 1), x.clip(0, width - 1)] >= SEEN)
        if found.any():
            at = rows[found], columns[found]
            picture[at] = compositor.seen(read(frame), places[found], sharp=False)
            kinds[at] = TAKEN
            rows, columns = rows[~found], columns[~found]
    return picture, kinds


def filled(picture: np.ndarray, known: np.ndarray) -> np.ndarray:
    """A picture (H, W, C) float32 whose pixels that are not known (H, W) bool go on smoothly from those around.

    By a pyramid: each level is the mean of what is known of the finer one, and the finer one takes from it what it
    lacks. It is what diffusion tends to, in one pass over each level."""
    if known.all() or min(known.shape) < 2:
        return picture if known.any() else np.zeros_like(picture)
    height, width = known.shape
    pad = [(0, height % 2), (0, width % 2)]
    weights = np.pad(known.astype(np.float32), pad)
    colors = np.pad(np.where(known[..., None], picture, 0), [*pad, (0, 0)]).astype(np.float32)
    halves = weights.shape[0] // 2, 2, weights.shape[1] // 2, 2
    count = weights.reshape(halves).sum(axis=(1, 3))
    mean = colors.reshape(*halves, -1).sum(axis=(1, 3)) / np.maximum(count, 1)[..., None]
    coarse = filled(mean, count > 0)
    return np.where(known[..., None], picture, _doubled(coarse)[:height, :width])


def _doubled(picture: np.ndarray) -> np.ndarray:
    """Twice as large, linearly between the pixels' centres."""
    for axis in (0, 1):
        before = np.concatenate([picture.take([0], axis), picture.take(range(picture.shape[axis] - 1), axis)], axis)
        after = np.concatenate([picture.take(range(1, picture.shape[axis]), axis), picture.take([-1], axis)], axis)
        pairs = np.stack([0.75 * picture + 0.25 * before, 0.75 * picture + 0.25 * after], axis + 1)
        shape = list(picture.shape)
        shape[axis] *= 2
        picture = pairs.reshape(shape)
    return picture.astype(np.float32)
