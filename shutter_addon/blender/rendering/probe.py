"""What one pixel of the preview is made with: its coefficients and its shutter."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...compute import plates
from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core.pixels import compositor
from ..devices import blender_gpu


@dataclass(frozen=True)
class Probed:
    """A pixel's coefficients (N,), which sum to 1, and its shutter's bars (L,).

    layers: how much of each layer covers it; hole: of compute.plates, how it gets what lies behind these"""

    coefficients: np.ndarray
    bars: np.ndarray
    layers: tuple[float, ...] = ()
    hole: int = plates.OPEN


def at(renderer: Renderer, request: Request, point: Sequence[float]) -> Probed | None:
    """What the pixel at a point is made with; None: the point lies beside the picture.

    point: fractions of the picture, y up. It is called where Blender's GPU draws; one texel is read, and coefficients
    are solved for only if what they depend on has changed since they were drawn."""
    source = renderer.source
    column, row = int(np.floor(point[0] * source.width)), int(np.floor((1 - point[1]) * source.height))
    if not (0 <= column < source.width and 0 <= row < source.height):
        return None
    texture, block = renderer.drawn_coefficients(replace(request, quick=True))
    values = np.maximum(blender_gpu.texel(texture, column // block, row // block)[: len(request.state.bars)], 0).astype(
        np.float64
    )
    coefficients = values / values.sum()
    holes = renderer.holes if request.state.layers else None
    return Probed(
        coefficients=coefficients,
        bars=compositor.mixed_shutter(renderer.slid(request, known=True).state, coefficients),
        layers=tuple(float(matte[row, column]) for matte in renderer.layer_mattes(request)),
        hole=plates.OPEN if holes is None else int(holes[row, column]),
    )
