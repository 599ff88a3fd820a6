"""Diffusion with NumPy: from scribbles, compute how much of each shutter every pixel gets (paper §3.4.2).

These coefficients are harmonic functions with the scribbles as fixed values and free (Neumann) edges. Conductances keep
them from spreading across edges of the picture. They are solved for by conjugate gradients, preconditioned with a
multigrid cycle. A coarse cell has one value for 2 × 2 cells, and its conductances are sums of theirs. Such corrections
are about half too small, and are scaled up (Braess, "Towards algebraic multigrid for elliptic problems of second
order", 1995). It is slow; devices have compute.diffusion_gpu.
"""

from typing import NamedTuple

import numpy as np

from ..core import stopping
from ..core.pixels.conductances import conductances

# The most iterations.
ITERATIONS = 1000
# Iterations end when one changes every coefficient by less.
ENOUGH = 1 / 65536
# The factors of a Jacobi step and of a coarse correction.
DAMPING, CORRECTION = 0.8, 1.8
# Coefficients below this become 0, so that a region enclosed by one shutter gets exactly that one.
NOTHING = 1 / 4096


def diffuse(labels: np.ndarray, count: int, guide: np.ndarray | None = None, strength: float = 0.0) -> np.ndarray:
    """Return how much of each shutter a pixel gets: coefficients (count, H, W) float32, at least 0, with a sum of 1.

    A shutter that is not drawn gets 0 everywhere, except that without any scribble every pixel gets shutter 0.

    Args:
        labels: (H, W): 0 where a pixel is free, 1 + shutter where that shutter is drawn.
        count: The number of shutters.
        guide: A reduced or full-size picture whose edges stop the diffusion, (h, w, 3 or more), as for
            core.pixels.conductances. Its cells are 1, 2, 4, … pixels wide. None: nothing stops the diffusion.
        strength: How strictly edges stop it, from 0 (not at all) to 1.

    Raises:
        StoppedError: The calling thread's work was cancelled.
    """
    drawn = np.flatnonzero(np.bincount(labels.ravel(), minlength=count + 1)[1:])  # the others are 0 everywhere
    coefficients = np.zeros((count, *labels.shape), np.float32)
    if drawn.size < 2:
        coefficients[drawn.sum()] = 1
        return coefficients
    height, width = labels.shape
    across, down = np.ones((height, width - 1), np.float32), np.ones((height - 1, width), np.float32)
    if guide is not None:
        across, down = (ties.astype(np.float32) for ties in conductances(guide, strength, labels.shape))
    *solved, last = drawn  # the last one gets the rest
    coefficients[solved] = _solved(labels, np.array(solved), across, down)
    coefficients[last] = 1 - coefficients.sum(axis=0)
    coefficients[coefficients < NOTHING] = 0
    coefficients /= coefficients.sum(axis=0)
    return coefficients


class _Grid(NamedTuple):
    """The linear equations of a grid (h, w) of cells, whose values are unknown except in fixed cells (drawn ones).

    Attributes:
        across: The conductance between each cell and the one to its right, (h, w − 1); 0 if either is fixed.
        down: The conductance between each cell and the one below, (h − 1, w); 0 if either is fixed.
        ground: The sum of a cell's conductances to fixed cells, (h, w).
        inverse: 1 / the sum of all conductances of a cell, (h, w); 0 if that sum is 0, as in fixed cells.
    """

    across: np.ndarray
    down: np.ndarray
    ground: np.ndarray
    inverse: np.ndarray


def _solved(labels: np.ndarray, shutters: np.ndarray, across: np.ndarray, down: np.ndarray) -> np.ndarray:
    """Compute the coefficients (N, H, W) of some shutters by conjugate gradients.

    They have small errors, and can lie slightly outside 0 to 1.

    Args:
        labels: As for `diffuse`.
        shutters: (N,) indices of the shutters.
        across: (H, W − 1), conductances between each pixel and the one to its right.
        down: (H − 1, W), conductances between each pixel and the one below.
    """
    free = labels == 0
    ground = _inflow(across, down, (~free).astype(np.float32)) * free
    grids = [_grid(across * (free[:, 1:] & free[:, :-1]), down * (free[1:] & free[:-1]), ground)]
    while (last := grids[-1]).ground.shape != (1, 1):
        grids.append(_grid(_in_twos(last.across[:, 1::2], 0), _in_twos(last.down[1::2], 1), _in_fours(last.ground)))
    solution = (labels == shutters[:, None, None] + 1).astype(np.float32)
    direction, residual = np.zeros_like(solution), np.zeros_like(solution)
    power = np.zeros((len(solution), 1, 1), np.float32)
    for _ in range(ITERATIONS):
        last_residual, before = residual, power
        residual = _inflow(across, down, solution) * free
        guess = _cycle(grids, residual)
        power = _dot(residual, guess)
        # Polak and Ribière's formula: with others, rounding errors would grow where the solution is already exact.
        direction = guess + _ratio(np.maximum(_dot(residual - last_residual, guess), 0), before) * direction
        step = _ratio(_dot(residual, direction), -_dot(direction, _inflow(across, down, direction) * free)) * direction
        solution += step
        if np.abs(step).max() < ENOUGH:
            break
    return solution


def _grid(across: np.ndarray, down: np.ndarray, ground: np.ndarray) -> _Grid:
    """Return a grid with these conductances, and with 1 / the sum of each cell's conductances (0 if the sum is 0)."""
    diagonal = ground.copy()
    for ties, cells in ((across, diagonal), (down.T, diagonal.T)):
        cells[:, :-1] += ties
        cells[:, 1:] += ties
    inverse = np.divide(1, diagonal, where=diagonal > 0, out=np.zeros_like(diagonal))
    return _Grid(across, down, ground, inverse)


def _inflow(across: np.ndarray, down: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the net flow into each cell (…, h, w) from its four neighbors.

    The flow between two cells is their conductance times the difference of their values. It is added to one and
    subtracted from the other, so that flows cancel in the sum over all cells.

    Args:
        across, down: As for `_Grid`.
        values: The values of cells (…, h, w).

    Raises:
        StoppedError: The calling thread's work was cancelled.
    """
    stopping.check()
    flow = np.zeros_like(values)
    for passed, before, after in (
        (across * np.diff(values, axis=-1), flow[..., :-1], flow[..., 1:]),
        (down * np.diff(values, axis=-2), flow[..., :-1, :], flow[..., 1:, :]),
    ):
        before += passed
        after -= passed
    return flow


def _missing(grid: _Grid, values: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the residual of the equations of a grid for values (N, h, w) and a right-hand side `right`."""
    return right + _inflow(grid.across, grid.down, values) - grid.ground * values


def _cycle(grids: list[_Grid], right: np.ndarray) -> np.ndarray:
    """Return an approximate solution (N, h, w) of the first grid's equations, by one multigrid V-cycle.

    It serves as the preconditioner of the conjugate gradients.

    Args:
        grids: The grid and all coarser ones, the coarsest of one cell last.
        right: The right-hand side (N, h, w).
    """
    grid, *below = grids
    if not below:
        return grid.inverse * right
    values = DAMPING * grid.inverse * right
    coarse = _cycle(below, _in_fours(_missing(grid, values, right))).repeat(2, -2).repeat(2, -1)
    height, width = grid.ground.shape
    values += CORRECTION * coarse[..., :height, :width] * (grid.inverse > 0)
    return values + DAMPING * grid.inverse * _missing(grid, values, right)


def _in_twos(values: np.ndarray, axis: int) -> np.ndarray:
    """Return the sums of successive pairs of values along an axis. An odd last value stays as it is."""
    along = values.swapaxes(axis, 0)
    total, others = along[::2].copy(order="K"), along[1::2]
    total[: len(others)] += others
    return total.swapaxes(axis, 0)


def _in_fours(values: np.ndarray) -> np.ndarray:
    """Return the sums over blocks of 2 × 2 cells of values (…, h, w). Blocks at the far edges may have fewer cells."""
    return _in_twos(_in_twos(values, values.ndim - 2), values.ndim - 1)


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the scalar product (N, 1, 1) of each pair of fields (N, h, w)."""
    return (one * other).sum(axis=(1, 2), keepdims=True)


def _ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a / b, or 0 where b is not positive."""
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0)
