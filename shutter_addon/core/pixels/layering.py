"""Layers: regions that are exposed by their own shutter, by themselves, and laid over everything else.

With mₖ the matte of a layer in source frame k, hₖ = Π (1 − mₖ) over all layers, q a pixel's shutter by the other
regions and s the layer's own, both normalised:

    B = Σ qₖ hₖ Vₖ / Σ qₖ hₖ    the background, exposed without the layers
    F = Σ sₖ mₖ Vₖ              the layer, premultiplied by A = Σ sₖ mₖ
    F + (1 − A) B               the picture, layer by layer, the farthest first

So layers leave no ghosts. Sums use the light of Options.light and are composed in linear light. Where Σ qₖ hₖ is less
than CLEAR, too little of B was visible. A plate, made from frames outside the exposure, fills in.

A pixel V at the edge of a subject is m S + (1 − m) P, a mix of the subject's color S and the background's P, which
`separated` finds. Both are first estimated from their surroundings. The remaining error of V is then distributed to
both by coverage ("Fast Multi-Level Foreground Estimation", Germer et al. 2020, and "blur fusion", Forte 2021): twice,
from wide and from near surroundings.
"""

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from .matte_grid import block_sums, box_around

# The share of the exposure that has to be background.
CLEAR = 1 / 16
# The share from which on no layer was in front, except for rounding: the picture is then that without layers.
UNCOVERED = 1 - 2e-5
# Diffused coefficients that mean matte values 0 and 1. Far from its stroke, a subject has just over half of its
# shutter, and its surroundings have some of it (scripts/layer_truth.py).
NONE, WHOLE = 0.3, 0.5
# Radii of surroundings as fractions of the picture's height: wider than soft edges, then at the scale of detail.
WIDE, NEAR = 1 / 18, 1 / 90
# Larger radii, in cells, use larger cells.
_CELLS = 4


def matte_of(coefficients: ArrayLike) -> np.ndarray:
    """Convert the coefficients (…) that were diffused from a layer's strokes to the layer's matte (…), 0 to 1."""
    values = (np.asarray(coefficients) - NONE) / (WHOLE - NONE)
    return np.clip(values, 0, 1)


def behind(mattes: Sequence[np.ndarray]) -> np.ndarray:
    """Return the visible share (h, w) of the background behind layers with mattes m (h, w): Π (1 − m)."""
    return reduce(np.multiply, [1 - matte for matte in mattes])


def with_plate(sums: np.ndarray, clear: np.ndarray, plate: np.ndarray | None) -> np.ndarray:
    """Return the background's picture B (H, W, 4), filled by a plate where too little of the exposure shows it.

    The sum of shares is raised to CLEAR with the plate. Where the background's share is at least CLEAR, the plate does
    not count.

    Args:
        sums: Σ qₖ hₖ Vₖ, the exposed background's light, (H, W, 4).
        clear: Σ qₖ hₖ, (H, W): the share of the exposure that shows the background, 0 to 1.
        plate: The picture that fills in, (H, W, 4). None: nothing does, and B is the light divided by the share.
    """
    if plate is None:
        return sums / np.maximum(clear, 1e-6)[..., None]
    lacking = np.maximum(CLEAR - clear, 0)[..., None]
    return (sums + lacking * plate) / np.maximum(clear, CLEAR)[..., None]


def separated(colors: np.ndarray, matte: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Separate the colors of a subject from those of its background in pixels that mix both.

    A mixed pixel at the subject's edge is m · subject + (1 − m) · background, with m its matte value. Both colors are
    estimated from the surroundings.

    Args:
        colors: The picture (H, W, C) float32, linear light.
        matte: The subject's matte (H, W), 0 to 1. Pixels where it is neither 0 nor 1 are mixed.

    Returns:
        The subject's colors and the background's, (H, W, C) float32 each. In pixels that are not mixed, both are the
        colors given.
    """
    own, behind = colors.copy(), colors.copy()
    mixed = (matte > 0) & (matte < 1)
    height = len(matte)
    wide, near = max(round(height * WIDE), 2), max(round(height * NEAR), 1)
    if (box := box_around(mixed, wide + near)) is None:
        return own, behind
    # Planes of colors (C, h, w), which NumPy sums faster than pixels.
    picture, m = np.moveaxis(colors[box], -1, 0).copy(), matte[box].astype(np.float32)
    first, second = _nearer(picture, m, *_surroundings(picture, picture, m, wide, np.ogrid[: len(m), : m.shape[1]]))
    inside = mixed[box]
    first, second = _nearer(picture[:, inside], m[inside], *_surroundings(first, second, m, near, inside.nonzero()))
    own[box][inside] = np.maximum(first, 0).T
    behind[box][inside] = np.maximum(second, 0).T
    return own, behind


def _nearer(picture: np.ndarray, matte: np.ndarray, own: np.ndarray, behind: np.ndarray) -> tuple[np.ndarray, ...]:
    """Correct estimated colors of a subject and its background so that their mix comes nearer to the picture.

    A part of the error is added to the subject's color, in proportion to its matte, and a part to the background's, in
    proportion to 1 − matte. With a matte of 0 or 1 the mix becomes exact; at 0.5, half of the error remains.

    Args:
        picture: The picture's colors (C, …), each a mix of the subject's and the background's.
        matte: The subject's share in the mix (…), 0 to 1.
        own: The estimated colors of the subject (C, …).
        behind: The estimated colors of the background (C, …).

    Returns:
        The corrected colors of the subject and those of the background, (C, …) each.
    """
    left = picture - matte * own - (1 - matte) * behind
    return own + matte * left, behind + (1 - matte) * left


def _surroundings(
    own: np.ndarray, behind: np.ndarray, matte: np.ndarray, radius: int, places: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """Estimate the colors of a subject and its background at some pixels: weighted means over the square around each.

    Each pixel in the square is weighted by the matte for the subject, and by 1 − matte for the background. To be quick,
    means for a large radius are computed on a grid of cells of several pixels.

    Args:
        own: The subject's colors (C, h, w).
        behind: The background's colors (C, h, w).
        matte: The subject's matte (h, w), 0 to 1.
        radius: How far the square reaches to each side, in pixels; only approximate where cells are used.
        places: The row indices and the column indices of the pixels, two integer arrays that broadcast to a shape (…).

    Returns:
        The subject's means and the background's, (C, …) float32 each; 0 where all weights are 0.
    """
    cell = max(radius // _CELLS, 1)
    rows, columns = (place // cell for place in places)
    means = []
    for colors, weight in ((own, matte), (behind, 1 - matte)):
        sums = _box_sums(_cells(np.concatenate([colors * weight, weight[None]]), cell), radius // cell)
        means.append((sums[:-1] / np.maximum(sums[-1], 1e-6)).astype(np.float32)[:, rows, columns])
    return means


def _cells(planes: np.ndarray, size: int) -> np.ndarray:
    """Return sums (C, ⌈h/size⌉, ⌈w/size⌉) over squares of size × size pixels of planes (C, h, w)."""
    if size == 1:
        return planes
    return np.moveaxis(block_sums(np.moveaxis(planes, 0, -1), size, np.float32, beyond="constant"), -1, 0)


def _box_sums(values: np.ndarray, radius: int) -> np.ndarray:
    """Sum values over the square of cells around each cell.

    Args:
        values: The cells' values (C, h, w). Cells beyond the edges count as 0.
        radius: How many cells the square reaches to each side. Its side is 2 · radius + 1 cells.

    Returns:
        The sums (C, h, w) float64.
    """
    for axis in (1, 2):
        pads = [(0, 0)] * 3
        pads[axis] = radius + 1, radius
        sums = np.cumsum(np.pad(values, pads), axis=axis, dtype=np.float64)
        ends, starts = [slice(None)] * 3, [slice(None)] * 3
        ends[axis], starts[axis] = slice(2 * radius + 1, None), slice(None, -2 * radius - 1)
        values = sums[tuple(ends)] - sums[tuple(starts)]
    return values
