"""Conductances between neighbouring pixels: how freely coefficients spread between them.

They are small at edges of the picture, so that scribbles end there. Every cell of a guide has a resistance, from 1
where it is flat to 1 / FLOOR at an edge, by the steeper of its horizontal and vertical slopes: an edge does not conduct
along itself, either. Cells can be larger than pixels; resistances are linear between their middles. Two pixels are
connected by half the resistance of each in series.
"""

import numpy as np

# Slope of a guide per cell at which the conductance is 1/e.
SIGMA = 0.03
# The smallest conductance: every pixel stays reachable, and the equations stay solvable in single precision.
FLOOR = 3e-3
# Squared slope, in units of SIGMA, from which on the conductance is FLOOR.
STEEPEST = float(-np.log(FLOOR))
# Resistances are rounded to 1 / STEPS, since exponentials differ in their last bits between processors.
STEPS = 1 << 10


def resistances(guide: np.ndarray, strength: float) -> np.ndarray:
    """Return resistances (h, w) float32 of cells, in 1 … 1 / FLOOR.

    Args:
        guide: (h, w, 3 or more), finite: display colours, 0 … 1, times the picture's scale; three channels count.
        strength: 0 … 1; 0 gives 1 everywhere, 1 the full contrast.
    """
    colours = np.pad(np.asarray(guide)[..., :3].astype(np.float32), ((1, 1), (1, 1), (0, 0)), mode="edge")
    across, down = colours[1:-1, 2:] - colours[1:-1, :-2], colours[2:, 1:-1] - colours[:-2, 1:-1]
    largest = np.maximum(np.abs(across), np.abs(down)).max(axis=-1) / 2
    exact = np.exp(strength * np.minimum((largest.astype(np.float64) / SIGMA) ** 2, STEEPEST))
    return (np.rint(exact * STEPS) / STEPS).astype(np.float32)


def cell_side(cells: tuple[int, int], pixels: tuple[int, int]) -> int:
    """Return the side of a cell in pixels, a power of two; `cells` and `pixels` are (rows, columns)."""
    sides = (1 << k for k in range(16))
    return next(side for side in sides if all(-(-n // side) == count for n, count in zip(pixels, cells, strict=True)))


def of_pixels(cells: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Interpolate values (h, w) of cells linearly at each pixel of a picture with shape (rows, columns)."""
    side = cell_side(cells.shape, shape)
    for axis, length in enumerate(shape):
        place = ((np.arange(length) + 0.5) / side - 0.5).clip(0, cells.shape[axis] - 1)
        before = place.astype(int)
        share = np.expand_dims((place - before).astype(cells.dtype), 1 - axis)
        after = np.minimum(before + 1, cells.shape[axis] - 1)
        cells = (1 - share) * cells.take(before, axis) + share * cells.take(after, axis)
    return cells


def conductances(guide: np.ndarray, strength: float, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return conductances to the right neighbour (h, w − 1) and to the one below (h − 1, w), float64 in FLOOR … 1.

    Args:
        guide, strength: As for `resistances`.
        shape: (h, w) pixels; a cell of the guide is one pixel, or 2 × 2, 4 × 4, …
    """
    pixels = of_pixels(resistances(guide, strength).astype(np.float64), shape)
    return 2 / (pixels[:, 1:] + pixels[:, :-1]), 2 / (pixels[1:] + pixels[:-1])
