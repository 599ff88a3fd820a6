"""Layers: regions that are exposed by themselves, each by its own shutter, before what lies behind all of them.

With mₖ the matte of a layer in source frame k, hₖ = Π (1 − mₖ) over all layers, q a pixel's shutter by the other
regions and s the layer's own, both normalised:

    B = Σ qₖ hₖ Vₖ / Σ qₖ hₖ    what lies behind, exposed without them
    F = Σ sₖ mₖ Vₖ              the layer, premultiplied by A = Σ sₖ mₖ
    F + (1 − A) B               the picture, layer by layer, the first farthest

So no layer leaves its ghost beside it. The sums are made in the light of Options.light, laid over one another in linear
light. Where Σ qₖ hₖ is less than CLEAR, too little of B was seen: a plate takes the place of what lacks.
"""

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

# The share of the exposure that must have fallen on what lies behind layers.
CLEAR = 1 / 16
# The share from where on no layer was in the way, but for rounding: there the picture is that without layers.
UNCOVERED = 1 - 2e-5
# Diffused coefficients that are no matte yet, and those that are a whole one: far from its stroke a subject has little
# more than half of its shutter, and what is around has a little of it (scripts/layer_truth.py).
NONE, WHOLE = 0.3, 0.5


def matte_of(coefficients: ArrayLike) -> np.ndarray:
    """The matte of a layer that is drawn, of its coefficients."""
    values = (np.asarray(coefficients) - NONE) / (WHOLE - NONE)
    return np.clip(values, 0, 1)


def behind(mattes: Sequence[np.ndarray]) -> np.ndarray:
    """How much of what lies behind layers with these mattes (h, w) is seen: Π (1 − m)."""
    return reduce(np.multiply, [1 - matte for matte in mattes])


def laid_over(under: np.ndarray, color: np.ndarray, cover: np.ndarray) -> np.ndarray:
    """A layer's F (H, W, 4), premultiplied, with its A (H, W), over a picture (H, W, 4)."""
    return color + (1 - cover[..., None]) * under


def with_plate(sums: np.ndarray, clear: np.ndarray, plate: np.ndarray | None) -> np.ndarray:
    """B (H, W, 4) of its sums Σ qₖ hₖ Vₖ (H, W, 4) and Σ qₖ hₖ (H, W); plate: what lies behind where that is little."""
    if plate is None:
        return sums / np.maximum(clear, 1e-6)[..., None]
    lacking = np.maximum(CLEAR - clear, 0)[..., None]
    return (sums + lacking * plate) / np.maximum(clear, CLEAR)[..., None]
