"""Conductances between neighbouring pixels: how freely coefficients spread from one to the other.

They are small where the picture has an edge, so that what a scribble says ends there. Every cell of a guide has a
resistance, from 1 where it is level to 1 / FLOOR at an edge, by the steeper of its slopes across and down: an edge does
not conduct along itself either. Cells may be larger than pixels; between their middles resistances are linear. Two
pixels are tied by half the resistance of each, one after the other.
"""

import numpy as np

# The slope of a guide, per cell, at which a conductance has fallen to 1/e.
SIGMA = 0.03
# No conductance is smaller: every pixel can be reached, and the equations stay solvable in single precision.
FLOOR = 3e-3
# The squared slope in units of SIGMA from which on a conductance is FLOOR.
STEEPEST = float(-np.log(FLOOR))
# Resistances are multiples of 1 / STEPS: exponentials differ in their last bits from processor to processor.
STEPS = 1 << 10


def resistances(guide: np.ndarray, strength: float) -> np.ndarray:
    """Resistances (h, w) float32 of cells, in 1 … 1 / FLOOR.

    guide: (h, w, 3 or more), finite: display colours, 0 … 1, times the picture's scale; the first three channels count
    strength: 0 … 1; 0 gives 1 everywhere, 1 the full contrast
    """
    colours = np.pad(np.asarray(guide)[..., :3].astype(np.float32), ((1, 1), (1, 1), (0, 0)), mode="edge")
    across, down = colours[1:-1, 2:] - colours[1:-1, :-2], colours[2:, 1:-1] - colours[:-2, 1:-1]
    largest = np.maximum(np.abs(across), np.abs(down)).max(axis=-1) / 2
    exact = np.exp(strength * np.minimum((largest.astype(np.float64) / SIGMA) ** 2, STEEPEST))
    return (np.rint(exact * STEPS) / STEPS).astype(np.float32)


def cell_side(cells: tuple[int, int], pixels: tuple[int, int]) -> int:
    """How many pixels a cell is wide and high, a power of two, where so many (rows, columns) of them cover so many
    pixels. ValueError: none does."""
    for side in (1 << k for k in range(16)):
        if all(-(-n // side) == count for n, count in zip(pixels, cells, strict=True)):
            return side
    raise ValueError(f"a guide of {cells[1]} × {cells[0]} cells does not fit {pixels[1]} × {pixels[0]} pixels")


def of_pixels(cells: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Values (h, w) of cells at each pixel of a picture of this shape (rows, columns), linear between their middles."""
    side = cell_side(cells.shape, shape)
    for axis, length in enumerate(shape):
        place = ((np.arange(length) + 0.5) / side - 0.5).clip(0, cells.shape[axis] - 1)
        before = place.astype(int)
        share = np.expand_dims((place - before).astype(cells.dtype), 1 - axis)
        after = np.minimum(before + 1, cells.shape[axis] - 1)
        cells = (1 - share) * cells.take(before, axis) + share * cells.take(after, axis)
    return cells


def conductances(guide: np.ndarray, strength: float, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Conductances (h, w − 1) to the right neighbour and (h − 1, w) to the one below, float64 in FLOOR … 1.

    guide, strength: as for `resistances`
    shape: (h, w) pixels; each cell of the guide is one of them, or 2 × 2, 4 × 4, …
    """
    pixels = of_pixels(resistances(guide, strength).astype(np.float64), shape)
    return 2 / (pixels[:, 1:] + pixels[:, :-1]), 2 / (pixels[1:] + pixels[:-1])
