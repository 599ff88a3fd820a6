"""Diffusion: coefficients for every pixel from the scribbles (paper §3.4.2).

The harmonic function with the scribbles as fixed values and free (Neumann) edges, by multigrid V-cycles on the
5-point Laplacian. Coarse cells lie on the even cells of the finer grid, and coarse operators are Galerkin products
PᵀAP (nine points). P is the bilinear prolongation, each cell's row scaled by t = 1 − HOLD · (row sum) / (diagonal),
and by 0 on fixed cells: the less a cell can move, the less it follows. So a coarse grid knows of scribbles far
thinner than its cells, without influence blocks and without a rule for coarsening constraints.
"""

from __future__ import annotations

import numpy as np

# Largest error × 255 over 67 scenes after 2, 3, 4, 5 cycles: 6.8, 1.1, 0.17, 0.03 (median 0.18, 0.014, 0.003, 0.0006).
CYCLES = 4
SWEEPS = 2
# Lower is faster at walls (two lines side by side), higher at dots and at holes in walls: 0.8 balances the two.
HOLD = 0.8
# Coefficients below this are none: regions that one shutter encloses get exactly that one.
NOTHING = 1 / 4096
COLOURS = ((0, 0), (1, 1), (0, 1), (1, 0))
_OFFSETS = tuple((y, x) for y in (-1, 0, 1) for x in (-1, 0, 1))


def diffuse(labels: np.ndarray, count: int) -> np.ndarray:
    """Coefficients (count, H, W) float32, ≥ 0 and of sum 1, from labels (H, W): 0 free, 1 + shutter fixed.

    Labels without any scribble give the first shutter everywhere.
    """
    levels = [_finest(labels)]
    while levels[-1].shape != (1, 1):
        levels.append(_coarser(levels[-1]))
    solution = padded(labels == np.arange(1, count + 1)[:, None, None])
    for cycle in range(CYCLES):
        _cycle(levels, solution, 0.0, SWEEPS if cycle else 0)
    return finished(inner(solution))


class _Level:
    """A grid's operator: `weights` {offset: what a cell gives its neighbour, a number or (H, W)}, and its diagonal."""

    def __init__(self, weights, diagonal, live, row_sum):
        self.shape = diagonal.shape
        self.weights = weights
        self.diagonal = diagonal
        self.inverse = np.divide(live, diagonal, where=live, out=np.zeros(self.shape, np.float32))
        self.live = live
        self.scale = live * np.maximum(0, 1 - HOLD * row_sum * self.inverse)


def _finest(labels: np.ndarray) -> _Level:
    """The 5-point Laplacian; solutions hold the fixed values, so every neighbour counts."""
    ones, fixed = padded(np.ones((1, *labels.shape))), padded(labels[None] != 0)
    cross = {offset: 1 for offset in _OFFSETS if 0 in offset and any(offset)}
    neighbours, held = (sum(part(a, offset)[0] for offset in cross) for a in (ones, fixed))
    return _Level(cross, np.maximum(neighbours, 1), labels == 0, held)


def _coarser(fine: _Level) -> _Level:
    def answer(values):
        return -_restrict(fine, missing(fine, padded(_prolong(fine, values)), 0.0))

    weights, diagonal = galerkin(fine.shape, answer)
    return _Level(weights, diagonal, diagonal > 0, diagonal - sum(weights.values()))


def galerkin(shape, answer):
    """The next coarser grid's operator: {offset: what a cell gives its neighbour, (h, w)} and its diagonal (h, w).

    shape: of the finer grid; answer: gives PᵀAP of values (N, h, w). Coarse cells three apart do not meet in a row of
    it, so nine vectors tell all rows."""
    height, width = ((n + 1) // 2 for n in shape)
    rows, columns = np.arange(height) % 3, np.arange(width) % 3
    probes = np.stack([np.outer(rows == y, columns == x) for y in range(3) for x in range(3)]).astype(np.float32)
    answers, entries = answer(probes), {}
    for y, x in _OFFSETS:
        near = (rows[:, None] + y) % 3 * 3 + (columns + x) % 3
        entries[y, x] = np.take_along_axis(answers, near[None], axis=0)[0]
        # Grids of one or two cells: beyond the edge there is nothing.
        entries[y, x][_beyond(height, y)] = 0
        entries[y, x][:, _beyond(width, x)] = 0
    diagonal = entries.pop((0, 0))
    return {offset: -entry for offset, entry in entries.items()}, diagonal


def _beyond(size: int, offset: int) -> np.ndarray:
    neighbours = np.arange(size) + offset
    return (neighbours < 0) | (neighbours >= size)


def _cycle(levels, solution, right, sweeps) -> None:
    """One V-cycle on the padded solution (N, H + 2, W + 2), in place."""
    level, *below = levels
    for _ in range(sweeps):
        smooth(level, solution, right)
    if below:
        residual = _restrict(level, missing(level, solution, right))
        correction = padded(np.zeros_like(residual))
        _cycle(below, correction, residual, SWEEPS)
        inner(solution)[:] += _prolong(level, inner(correction))
    for _ in range(SWEEPS):
        smooth(level, solution, right)


def smooth(level, solution, right, colours=COLOURS) -> None:
    """A Gauss-Seidel sweep over the padded solution, in four colours: red-black where only four neighbours count."""
    height, width = level.shape
    for y, x in colours:
        cells = np.s_[y::2, x::2]
        total = right[:, *cells] if np.ndim(right) else 0.0
        for (dy, dx), weight in level.weights.items():
            near = solution[:, y + 1 + dy : height + 1 + dy : 2, x + 1 + dx : width + 1 + dx : 2]
            total = total + (near * weight[cells] if np.ndim(weight) else near)
        own = inner(solution)[:, *cells]
        np.copyto(own, total * level.inverse[cells], where=level.live[cells])


def missing(level, solution, right) -> np.ndarray:
    """What the equations of the live cells of a padded solution still miss, (N, H, W)."""
    total = right - level.diagonal * inner(solution)
    for offset, weight in level.weights.items():
        total += weight * part(solution, offset)
    return total * level.live


def _prolong(fine: _Level, coarse: np.ndarray) -> np.ndarray:
    height, width = fine.shape
    return _spread(_spread(coarse, height, 1), width, 2) * fine.scale


def _restrict(fine: _Level, residual: np.ndarray) -> np.ndarray:
    """The transpose of _prolong."""
    return _gather(_gather(residual * fine.scale, 1), 2)


def _spread(coarse: np.ndarray, size: int, axis: int) -> np.ndarray:
    """Linear interpolation to `size` cells along an axis; coarse cells lie on the even ones."""
    cells = np.arange(size)
    after = np.minimum((cells + 1) // 2, coarse.shape[axis] - 1)
    return (coarse.take(cells // 2, axis) + coarse.take(after, axis)) * np.float32(0.5)


def _gather(fine: np.ndarray, axis: int) -> np.ndarray:
    """The transpose of _spread."""
    fine = np.moveaxis(fine, axis, 0)
    odd = fine[1::2] * np.float32(0.5)
    coarse = fine[0::2].copy()
    coarse[: len(odd)] += odd
    coarse[1:] += odd[: len(coarse) - 1]
    if len(odd) == len(coarse):
        coarse[-1] += odd[-1]
    return np.moveaxis(coarse, 0, axis)


def finished(solution: np.ndarray) -> np.ndarray:
    coefficients = np.where(solution < NOTHING, np.float32(0), solution)
    total = coefficients.sum(axis=0)
    coefficients[0][total == 0] = 1
    return coefficients / np.where(total == 0, 1, total)


def padded(array: np.ndarray) -> np.ndarray:
    """(N, H, W) with a frame of zeros around, float32."""
    return np.pad(array.astype(np.float32), ((0, 0), (1, 1), (1, 1)))


def inner(padded: np.ndarray) -> np.ndarray:
    return padded[:, 1:-1, 1:-1]


def part(padded: np.ndarray, offset) -> np.ndarray:
    """The neighbours at an offset (dy, dx) of all cells."""
    dy, dx = offset
    return padded[:, 1 + dy : padded.shape[1] - 1 + dy, 1 + dx : padded.shape[2] - 1 + dx]
