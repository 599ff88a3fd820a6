"""Conductances between neighboring pixels: how freely the coefficients of shutters spread from one to the other.

They are small at edges of a picture, the guide, so that the effect of scribbles ends there. Every cell of the guide has
a resistance, from 1 where it is flat to 1 / FLOOR at an edge, by the steeper of its horizontal and vertical slopes: an
edge does not conduct along itself, either. Cells can be larger than pixels; resistances are linear between their
middles. Two pixels are connected by half the resistance of each in series.
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
    """Return how strongly each cell of a guide resists diffusion, (h, w) float32 from 1 (flat) to 1 / FLOOR (edge).

    Args:
        guide: The picture at whose edges scribbles stop, (h, w, 3 or more), finite: display colors 0 … 1, scaled by
            the number of cells along the picture's shorter side / 240 (compute/guide.py). The first three channels
            count.
        strength: 0 … 1, how strictly scribbles stop at edges; 0 gives 1 everywhere.
    """
    colours = np.pad(np.asarray(guide)[..., :3].astype(np.float32), ((1, 1), (1, 1), (0, 0)), mode="edge")
    across, down = colours[1:-1, 2:] - colours[1:-1, :-2], colours[2:, 1:-1] - colours[:-2, 1:-1]
    largest = np.maximum(np.abs(across), np.abs(down)).max(axis=-1) / 2
    exact = np.exp(strength * np.minimum((largest.astype(np.float64) / SIGMA) ** 2, STEEPEST))
    return (np.rint(exact * STEPS) / STEPS).astype(np.float32)


def cell_side(cells: tuple[int, int], pixels: tuple[int, int]) -> int:
    """Return how many pixels wide and high a cell of the guide (the reduced picture) is: a power of two.

    Args:
        cells: The rows and columns of the guide.
        pixels: The rows and columns of the picture.
    """
    sides = (1 << k for k in range(16))
    return next(side for side in sides if all(-(-n // side) == count for n, count in zip(pixels, cells, strict=True)))


def of_pixels(cells: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Interpolate the values (h, w) of a guide's cells linearly for each pixel of a picture.

    Args:
        cells: The values.
        shape: The picture's (rows, columns).
    """
    side = cell_side(cells.shape, shape)
    for axis, length in enumerate(shape):
        place = ((np.arange(length) + 0.5) / side - 0.5).clip(0, cells.shape[axis] - 1)
        before = place.astype(int)
        share = np.expand_dims((place - before).astype(cells.dtype), 1 - axis)
        after = np.minimum(before + 1, cells.shape[axis] - 1)
        cells = (1 - share) * cells.take(before, axis) + share * cells.take(after, axis)
    return cells


def conductances(guide: np.ndarray, strength: float, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return how freely coefficients spread between neighboring pixels (conductances), float64 from FLOOR to 1.

    Args:
        guide, strength: As for `resistances`.
        shape: The picture's (h, w) pixels; a cell of the guide is a square of 1, 2, 4 … pixels a side.

    Returns:
        Two arrays: between each pixel and its right neighbor, (h, w − 1), and between each pixel and the one below it,
        (h − 1, w).
    """
    pixels = of_pixels(resistances(guide, strength).astype(np.float64), shape)
    return 2 / (pixels[:, 1:] + pixels[:, :-1]), 2 / (pixels[1:] + pixels[:-1])
