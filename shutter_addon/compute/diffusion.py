"""Diffusion with NumPy: coefficients for every pixel from the scribbles (paper §3.4.2), which spread freely within what
the picture shows as one, and hardly across its edges.

The harmonic function with the scribbles as fixed values and free (Neumann) edges, by conjugate gradients, each
iteration a cycle over grids. A coarse cell is 2 × 2 cells of the finer grid, and has one value for them: its ties are
the sums of theirs. Such corrections are about half as large as they should be, and are made larger (Braess, "Towards
algebraic multigrid for elliptic problems of second order", 1995). It is slow: devices have compute.diffusion_gpu.
"""

from typing import NamedTuple

import numpy as np

from ..core import stopping
from ..core.pixels.conductances import conductances

# Iterations at most.
ITERATIONS = 1000
# They end where one changes no coefficient by as much.
ENOUGH = 1 / 65536
# How much of a Jacobi step is taken, and how much larger than its grid says a coarse correction is made.
DAMPING, CORRECTION = 0.8, 1.8
# Coefficients below this are none: regions that one shutter encloses get exactly that one.
NOTHING = 1 / 4096


def diffuse(labels: np.ndarray, count: int, guide: np.ndarray | None = None, strength: float = 0.0) -> np.ndarray:
    """Coefficients (count, H, W) float32, ≥ 0 and of sum 1, from labels (H, W): 0 free, 1 + shutter fixed.

    Labels without any scribble give the first shutter everywhere.
    guide: (h, w, 3 or more) as for core.pixels.conductances; its cells are pixels, or 2 × 2, 4 × 4, … of them
    strength: 0 … 1, how much conductances follow it
    """
    drawn = np.flatnonzero(np.bincount(labels.ravel(), minlength=count + 1)[1:])  # the others are 0 everywhere
    coefficients = np.zeros((count, *labels.shape), np.float32)
    if drawn.size < 2:
        coefficients[drawn.sum()] = 1
        return coefficients
    height, width = labels.shape
    across, down = np.ones((height, width - 1), np.float32), np.ones((height - 1, width), np.float32)
    if guide is not None and strength > 0:
        across, down = (ties.astype(np.float32) for ties in conductances(guide, strength, labels.shape))
    *solved, last = drawn  # the last one has what the others leave
    coefficients[solved] = _solved(labels, np.array(solved), across, down)
    coefficients[last] = 1 - coefficients.sum(axis=0)
    coefficients[coefficients < NOTHING] = 0
    coefficients /= coefficients.sum(axis=0)
    return coefficients


def follows_edges(labels: np.ndarray, guide: np.ndarray | None, strength: float) -> bool:
    """Whether there is anything to diffuse with other conductances than 1."""
    return guide is not None and strength > 0 and 0 < int(np.count_nonzero(labels)) < labels.size


class _Grid(NamedTuple):
    """A grid's equations: what ties a cell to its right neighbour (h, w − 1), to the one below (h − 1, w) and to fixed
    cells (h, w), and one over the sum of these, 0 for cells that are not free."""

    across: np.ndarray
    down: np.ndarray
    ground: np.ndarray
    inverse: np.ndarray


def _solved(labels: np.ndarray, shutters: np.ndarray, across: np.ndarray, down: np.ndarray) -> np.ndarray:
    """The harmonic functions (N, H, W) of some shutters, not yet clipped.

    across, down: conductances to the right neighbours and to those below"""
    free = labels == 0
    ground = _inflow(across, down, (~free).astype(np.float32)) * free
    grids = [_grid(across * (free[:, 1:] & free[:, :-1]), down * (free[1:] & free[:-1]), ground)]
    while grids[-1].ground.shape != (1, 1):
        grids.append(_coarser(grids[-1]))
    solution = (labels == shutters[:, None, None] + 1).astype(np.float32)
    direction, residual = np.zeros_like(solution), np.zeros_like(solution)
    power = np.zeros((len(solution), 1, 1), np.float32)
    for _ in range(ITERATIONS):
        last, before = residual, power
        residual = _inflow(across, down, solution) * free
        guess = _cycle(grids, residual)
        power = _dot(residual, guess)
        # By how the residual has changed (Polak and Ribière): of what is solved already, directions of rounding's noise
        # would grow without end.
        direction = guess + _ratio(np.maximum(_dot(residual - last, guess), 0), before) * direction
        step = _ratio(_dot(residual, direction), -_dot(direction, _inflow(across, down, direction) * free)) * direction
        solution += step
        if np.abs(step).max() < ENOUGH:
            break
    return solution


def _grid(across: np.ndarray, down: np.ndarray, ground: np.ndarray) -> _Grid:
    diagonal = ground.copy()
    for ties, cells in ((across, diagonal), (down.T, diagonal.T)):
        cells[:, :-1] += ties
        cells[:, 1:] += ties
    inverse = np.divide(1, diagonal, where=diagonal > 0, out=np.zeros_like(diagonal))
    return _Grid(across, down, ground, inverse)


def _coarser(grid: _Grid) -> _Grid:
    """The next grid, of the ties from one of its cells to another."""
    return _grid(_in_twos(grid.across[:, 1::2], 0), _in_twos(grid.down[1::2], 1), _in_fours(grid.ground))


def _inflow(across: np.ndarray, down: np.ndarray, values: np.ndarray) -> np.ndarray:
    """What flows into each cell (…, h, w) from its neighbours. By differences: a diagonal that is rounded would leak
    like a ground."""
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
    """What a grid's equations still miss with values (N, h, w)."""
    return right + _inflow(grid.across, grid.down, values) - grid.ground * values


def _cycle(grids: list[_Grid], right: np.ndarray) -> np.ndarray:
    """An approximate solution (N, h, w), by a cycle over these grids."""
    grid, *below = grids
    if not below:
        return grid.inverse * right
    values = DAMPING * grid.inverse * right
    coarse = _cycle(below, _in_fours(_missing(grid, values, right))).repeat(2, -2).repeat(2, -1)
    height, width = grid.ground.shape
    values += CORRECTION * coarse[..., :height, :width] * (grid.inverse > 0)
    return values + DAMPING * grid.inverse * _missing(grid, values, right)


def _in_twos(values: np.ndarray, axis: int) -> np.ndarray:
    """Sums of two neighbours along an axis; the last one may be alone."""
    along = values.swapaxes(axis, 0)
    total, others = along[::2].copy(order="K"), along[1::2]
    total[: len(others)] += others
    return total.swapaxes(axis, 0)


def _in_fours(values: np.ndarray) -> np.ndarray:
    """Sums over 2 × 2 cells (…, h, w)."""
    return _in_twos(_in_twos(values, values.ndim - 2), values.ndim - 1)


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return (one * other).sum(axis=(1, 2), keepdims=True)


def _ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0)
