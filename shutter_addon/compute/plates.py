"""Plates: what lies behind layers where a frame does not show it, from other frames, or from what is around."""

from collections.abc import Callable, Iterable

import numpy as np

from ..core.pixels import compositor

# How much of what lies behind has to be seen of a pixel that a plate is taken from.
SEEN = 0.9
# How much of an exposed frame counts that is taken from others: a little less than all of it, which would say that no
# layer was in the way (layering.UNCOVERED).
TAKEN_SHARE = 1 - 1 / 64
# The most that it counts: less than whole in half floats, too.
TAKEN_MOST = 1 - 1 / 1024
# Kinds of pixels: seen, taken from another frame, filled from what is around.
OPEN, TAKEN, FILLED = 0, 1, 2


def nearest_frames(index: int, frames: range, step: int) -> Iterable[int]:
    """The filmed ones of source frames, every step-th, in the order in which a plate is taken from them: those nearest
    to frame `index`, of two the earlier. Moments between them are made of these."""
    filmed = (frame for frame in frames if frame % step == 0)
    return sorted(filmed, key=lambda frame: (abs(frame - index), frame))


def plate(
    holes: np.ndarray,
    frames: Iterable[int],
    read: Callable[[int, tuple[slice, slice]], np.ndarray],
    clear: Callable[[int], np.ndarray],
    motion: Callable[[int], tuple[complex, complex]],
) -> tuple[np.ndarray, np.ndarray]:
    """What lies behind layers in the pixels `holes` (H, W) bool: a picture (H, W, 4) float32, scene-linear and
    premultiplied, and the kinds (H, W) uint8 of its pixels.

    frames: source frames, the first is asked first
    read: gives rows and columns of a frame's picture; clear: how much (H, W) of what lies behind is seen in it
    motion: where a point z of this picture lies in a frame: turn · z + shift"""
    height, width = holes.shape
    picture, kinds = np.zeros((height, width, 4), np.float32), np.where(holes, FILLED, OPEN).astype(np.uint8)
    rows, columns = np.nonzero(holes)
    for frame in frames:
        if not rows.size:
            break
        seen, (turn, shift) = clear(frame), motion(frame)
        places = turn * (columns + 1j * rows) + shift
        x, y = np.rint(places.real).astype(int), np.rint(places.imag).astype(int)
        inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
        found = inside & (seen[y.clip(0, height - 1), x.clip(0, width - 1)] >= SEEN)
        if found.any():
            at = rows[found], columns[found]
            top, left = max(y[found].min() - 2, 0), max(x[found].min() - 2, 0)
            part = read(frame, (slice(top, y[found].max() + 3), slice(left, x[found].max() + 3)))
            picture[at] = compositor.seen(part, places[found] - (left + 1j * top), sharp=False)
            kinds[at] = TAKEN
            rows, columns = rows[~found], columns[~found]
    return picture, kinds


def uncovered(colors: np.ndarray, seen: np.ndarray, plate: np.ndarray, kinds: np.ndarray) -> tuple[np.ndarray, ...]:
    """What lies behind layers in a frame, of which it shows `seen` (H, W), with the rest from a plate: colours
    (H, W, 3), scene-linear, and how much (H, W) float32 they count.

    colors: (H, W, 3) what it shows; plate, kinds: as from `plate`, with holes where it does not show all"""
    taken = kinds == TAKEN
    mixed = seen[..., None] * colors + (1 - seen)[..., None] * plate[..., :3]
    share = np.where(taken, np.minimum(seen + (1 - seen) * np.float32(TAKEN_SHARE), np.float32(TAKEN_MOST)), seen)
    return np.where(taken[..., None], mixed, colors), share.astype(np.float32)


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
