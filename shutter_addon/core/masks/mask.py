"""Blender's masks: one as it stands at a frame, as plain data, and what it covers, as Blender's Mask strip shows it.

Mask space has its origin in the lower left corner of a square around the picture, as large as the picture's larger side
and centred on it: x to the right and y up, from 0 to 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import mask_filling, mask_outlines

# Share 0 to 1 of a feather's way inward -> value.
_FALLOFFS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "SMOOTH": lambda v: v * v * (3 - 2 * v),
    "SPHERE": lambda v: np.sqrt(2 * v - v * v),
    "ROOT": np.sqrt,
    "INVERSE_SQUARE": lambda v: v * (2 - v),
    "SHARP": np.square,
    "LINEAR": lambda v: v,
}
# What lies below and a layer's value -> both. Sums are clamped after each layer.
_BLENDS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "MERGE_ADD": lambda below, v: below + v * (1 - below),
    "MERGE_SUBTRACT": lambda below, v: below - v * below,
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "LIGHTEN": np.maximum,
    "DARKEN": np.minimum,
    "MUL": np.multiply,
    "DIFFERENCE": lambda below, v: np.abs(below - v),
}


@dataclass(frozen=True)
class MaskSpline:
    """A spline with its handles; numbers in mask space, tuples so that it can be a key.

    points: of each its left handle, itself and its right handle ((x, y), (x, y), (x, y))
    weights: the width of the feather at each point
    feathers: for each point, the feather points ((u, factor), …) of the segment that follows it, u ascending; the
    factors multiply the points' weights
    """

    points: tuple[tuple[tuple[float, float], ...], ...]
    weights: tuple[float, ...]
    feathers: tuple[tuple[tuple[float, float], ...], ...]
    cyclic: bool = True
    fill: bool = True
    weight_interpolation: str = "EASE"  # EASE | LINEAR


@dataclass(frozen=True)
class MaskLayer:
    """A layer; its words are those of Blender's MaskLayer."""

    splines: tuple[MaskSpline, ...]
    alpha: float = 1.0
    blend: str = "MERGE_ADD"
    invert: bool = False
    falloff: str = "SMOOTH"
    fill_solver: str = "CDT"  # CDT | SWEEP_LINE
    holes: bool = False


@dataclass(frozen=True)
class MaskShape:
    """A mask as it stands at one frame: the layers that are rendered, from the lowest up."""

    layers: tuple[MaskLayer, ...]

    def values(self, width: int, height: int) -> np.ndarray:
        """What it covers of a picture: (height, width) float32, 0 to 1, the top row first."""
        value = np.zeros((height, width), np.float32)
        for layer in self.layers:
            value = _blend(layer, value, _layer_value(layer, width, height))
        return np.ascontiguousarray(value[::-1])


def _blend(layer: MaskLayer, below: np.ndarray, value: np.ndarray) -> np.ndarray:
    """A layer's value (h, w) over what lies below."""
    alpha = np.float32(layer.alpha)
    if layer.blend != "REPLACE" and alpha != 1:
        value = value * alpha
    if layer.invert:
        value = 1 - value
    both = below + (value - below) * alpha if layer.blend == "REPLACE" else _BLENDS[layer.blend](below, value)
    return np.clip(both, 0, 1, out=both)


def _layer_value(layer: MaskLayer, width: int, height: int) -> np.ndarray:
    """What the splines of a layer cover: (height, width) float32, the lowest row first."""
    value = np.zeros((height, width), np.float32)
    outlines = [mask_outlines.outlines(spline, width, height) for spline in layer.splines]
    outlined = [(spline, both) for spline, both in zip(layer.splines, outlines, strict=True) if both is not None]
    if not outlined or layer.alpha == 0:
        return value
    filled = [edge for spline, (edge, _) in outlined if spline.fill]
    mask_filling.fill(value, filled, layer.fill_solver, layer.holes)
    quads = [mask_outlines.feather_quads(spline, *both, width, height) for spline, both in outlined]
    mask_filling.feather(value, np.concatenate(quads), _FALLOFFS[layer.falloff])
    return value
