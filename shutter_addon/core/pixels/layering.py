"""Layers: regions that are exposed by their own shutter in front of everything else.

With mₖ the matte of a layer in source frame k, hₖ = Π (1 − mₖ) over all layers, q a pixel's shutter by the other
regions and s the layer's own, both normalised:

    B = Σ qₖ hₖ Vₖ / Σ qₖ hₖ    the background, exposed without the layers
    F = Σ sₖ mₖ Vₖ              the layer, premultiplied by A = Σ sₖ mₖ
    F + (1 − A) B               the picture, layer by layer, the farthest first

So layers leave no ghosts. Sums use the light of Options.light and are composed in linear light. Where Σ qₖ hₖ is less
than CLEAR, too little of B was visible, and a plate fills in.

A pixel V at the edge of a subject is m S + (1 − m) P (`separated`). S and P are first estimated from their
surroundings. The remaining error of V is then distributed to both by coverage ("Fast Multi-Level Foreground
Estimation", Germer et al. 2020, and "blur fusion", Forte 2021): twice, from wide and from near surroundings.
"""

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from .matte_grid import block_sums

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
    """Return the matte of a drawn layer from its coefficients."""
    values = (np.asarray(coefficients) - NONE) / (WHOLE - NONE)
    return np.clip(values, 0, 1)


def behind(mattes: Sequence[np.ndarray]) -> np.ndarray:
    """Return the visible share of the background behind layers with mattes (h, w): Π (1 − m)."""
    return reduce(np.multiply, [1 - matte for matte in mattes])


def laid_over(under: np.ndarray, color: np.ndarray, cover: np.ndarray) -> np.ndarray:
    """Compose a layer's F (H, W, 4), premultiplied, with its A (H, W), over a picture (H, W, 4)."""
    return color + (1 - cover[..., None]) * under


def with_plate(sums: np.ndarray, clear: np.ndarray, plate: np.ndarray | None) -> np.ndarray:
    """Return B (H, W, 4) from Σ qₖ hₖ Vₖ (H, W, 4) and Σ qₖ hₖ (H, W), filled by the plate where that is small."""
    if plate is None:
        return sums / np.maximum(clear, 1e-6)[..., None]
    lacking = np.maximum(CLEAR - clear, 0)[..., None]
    return (sums + lacking * plate) / np.maximum(clear, CLEAR)[..., None]


def separated(colors: np.ndarray, matte: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the colours (H, W, C) float32 of a subject and of its background, from linear light.

    Only mixed pixels of the matte (H, W) change.
    """
    own, behind = colors.copy(), colors.copy()
    mixed = (matte > 0) & (matte < 1)
    if not mixed.any():
        return own, behind
    height = len(matte)
    wide, near = max(round(height * WIDE), 2), max(round(height * NEAR), 1)
    box = tuple(_around(mixed.any(axis=1 - axis), wide + near) for axis in (0, 1))
    picture, m, inside = colors[box], matte[box][..., None].astype(np.float32), mixed[box]
    first = second = picture
    for radius in (wide, near):
        first, second = _surroundings(first, second, m, radius)
        left = picture - m * first - (1 - m) * second
        first, second = first + m * left, second + (1 - m) * left
    own[box][inside] = np.maximum(first, 0)[inside]
    behind[box][inside] = np.maximum(second, 0)[inside]
    return own, behind


def _around(mixed: np.ndarray, reach: int) -> slice:
    """Return the rows, or columns, from the first to the last mixed pixel, extended by `reach`."""
    places = np.flatnonzero(mixed)
    return slice(max(int(places[0]) - reach, 0), int(places[-1]) + reach + 1)


def _surroundings(own: np.ndarray, behind: np.ndarray, matte: np.ndarray, radius: int) -> tuple[np.ndarray, np.ndarray]:
    """Return means (h, w, C) around each pixel of subject colours, weighted by a matte (h, w, 1), and of the others."""
    cell = max(radius // _CELLS, 1)
    weighted = np.concatenate([own * matte, behind * (1 - matte), matte, 1 - matte], axis=-1)
    sums = _box_sums(block_sums(weighted, cell, np.float32, beyond="constant"), radius // cell)
    count = own.shape[-1]
    totals = np.maximum(sums[..., 2 * count :], 1e-6)
    means = sums[..., :count] / totals[..., :1], sums[..., count : 2 * count] / totals[..., 1:]
    height, width = matte.shape[:2]
    whole = [mean.repeat(cell, 0).repeat(cell, 1)[:height, :width].astype(np.float32) for mean in means]
    return whole[0], whole[1]


def _box_sums(values: np.ndarray, radius: int) -> np.ndarray:
    """Return sums (h, w, C) float64 over squares of 2 · radius + 1 cells, with nothing beyond the edges."""
    for axis in (0, 1):
        length = values.shape[axis]
        sums = np.cumsum(values, axis=axis, dtype=np.float64)
        sums = np.concatenate([np.zeros_like(sums.take([0], axis)), sums], axis=axis)
        places = np.arange(length)
        ends = np.minimum(places + radius + 1, length), np.maximum(places - radius, 0)
        values = sums.take(ends[0], axis) - sums.take(ends[1], axis)
    return values
