"""Diffusion with NumPy: coefficients for every pixel from the scribbles (paper §3.4.2), which spread freely within what
the picture shows as one, and hardly across its edges.

The harmonic function with the scribbles as fixed values and free (Neumann) edges, by conjugate gradients, each
iteration a cycle over grids. Coarse cells lie on the even cells of the finer grid, and coarse operators are Galerkin
products PᵀAP (nine points). The prolongation P follows the operator: what a cell takes of the coarse cells around it
goes by how it is tied to them (Dendy's black box multigrid, 1982). It is slow: devices have compute.diffusion_gpu.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..core import stopping
from ..core.pixels.conductances import conductances

# Iterations at most.
ITERATIONS = 200
# They end where a cycle would change no coefficient by as much.
ENOUGH = 1 / 65536
# Gauss-Seidel sweeps over a grid before its correction by coarser ones, and again after it.
SWEEPS = 2
# A cell of which more than this share of the diagonal is no tie to free cells does not follow them fully.
GROUNDED = 1e-3
# Coefficients below this are none: regions that one shutter encloses get exactly that one.
NOTHING = 1 / 4096
# Cells (y, x) of 2 × 2 in the order of a sweep: red-black where only four neighbours count.
COLOURS = ((0, 0), (1, 1), (0, 1), (1, 0))
Ties = dict[tuple[int, int], np.ndarray]  # arrays (H, W) by offset (dy, dx)


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


def _solved(labels: np.ndarray, shutters: np.ndarray, across: np.ndarray, down: np.ndarray) -> np.ndarray:
    """The harmonic functions (N, H, W) of some shutters, not yet clipped.

    across, down: conductances to the right neighbours and to those below"""
    grids = [_finest(labels == 0, across, down)]
    while grids[-1].shape != (1, 1):
        grids.append(_coarser(grids[-1]))
    solution = (labels == shutters[:, None, None] + 1).astype(np.float32)
    live, direction, before = grids[0].live, np.zeros_like(solution), np.zeros((len(solution), 1, 1), np.float32)
    for _ in range(ITERATIONS):
        residual = _unbalanced(solution, across, down) * live
        guess = _cycle(grids, residual)
        if np.abs(guess).max() < ENOUGH:
            break
        power = _dot(residual, guess)
        direction = guess + _ratio(power, before) * direction
        answer = _unbalanced(direction, across, down) * live
        solution += _ratio(power, -_dot(direction, answer)) * direction
        before = power
    return solution


class _Grid:
    """A grid's operator A between its free cells, and the prolongation P from the next grid.

    weights: {(dy, dx): (H, W)} what ties a cell to its neighbour, −A
    diagonal: (H, W) of A, 0 for cells that are not free
    takes: {(b, a): (H, W)} what cell (y, x) takes of the next grid's cell (y // 2 + b, x // 2 + a)
    """

    def __init__(self, weights: Ties, diagonal: np.ndarray) -> None:
        self.shape, self.weights, self.diagonal = diagonal.shape, weights, diagonal
        self.live = diagonal > 0
        self.inverse = np.divide(1, diagonal, where=self.live, out=np.zeros_like(diagonal))
        self.takes = _prolongation(weights, diagonal, self.live)


def _finest(free: np.ndarray, across: np.ndarray, down: np.ndarray) -> _Grid:
    ties = {(0, 1): across, (1, 0): down, (0, -1): across, (-1, 0): down}
    whole, diagonal = {}, np.zeros(free.shape, np.float32)
    for (dy, dx), weights in ties.items():
        weights = np.pad(weights, ((int(dy < 0), int(dy > 0)), (int(dx < 0), int(dx > 0))))
        diagonal += weights
        whole[dy, dx] = weights * free * _near(free, dy, dx)
    return _Grid(whole, diagonal * free)


def _prolongation(ties: Ties, diagonal: np.ndarray, live: np.ndarray) -> Ties:
    """Between two coarse cells of a row or a column a cell takes of each as much as all that lies on its side pulls;
    between four, what its own equation makes of those around it."""
    nothing = np.zeros_like(diagonal)

    def tie(dy: int, dx: int) -> np.ndarray:
        return ties.get((dy, dx), nothing)

    def divided(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.divide(a, b, where=b > 0, out=np.zeros_like(diagonal))

    pull = sum(ties.values(), start=nothing)
    grounded = diagonal - pull > GROUNDED * diagonal
    sides = []
    for turned in (False, True):
        before, middle, after = (
            sum((tie(*((k, j) if turned else (j, k))) for j in (-1, 0, 1)), start=nothing) for k in (-1, 0, 1)
        )
        total = np.where(grounded, diagonal - middle, before + after)
        sides.append((divided(before, total), divided(after, total)))
    (west, east), (north, south) = sides
    height, width = live.shape
    odd_row, odd_column = np.arange(height)[:, None] % 2 == 1, np.arange(width) % 2 == 1
    between = {
        (0, 0): tie(-1, -1) + tie(0, -1) * _near(north, 0, -1) + tie(-1, 0) * _near(west, -1, 0),
        (0, 1): tie(-1, 1) + tie(0, 1) * _near(north, 0, 1) + tie(-1, 0) * _near(east, -1, 0),
        (1, 0): tie(1, -1) + tie(0, -1) * _near(south, 0, -1) + tie(1, 0) * _near(west, 1, 0),
        (1, 1): tie(1, 1) + tie(0, 1) * _near(south, 0, 1) + tie(1, 0) * _near(east, 1, 0),
    }
    total = np.where(grounded, diagonal, pull)
    takes = {}
    for (b, a), middle in between.items():
        stopping.check()
        alone = live if (b, a) == (0, 0) else nothing
        in_row = (west, east)[a] if b == 0 else nothing
        in_column = (north, south)[b] if a == 0 else nothing
        odd, even = np.where(odd_column, divided(middle, total), in_column), np.where(odd_column, in_row, alone)
        takes[b, a] = (live * np.where(odd_row, odd, even)).astype(np.float32)
    return takes


def _coarser(fine: _Grid) -> _Grid:
    """The next grid, of the Galerkin operator PᵀAP. Coarse cells three apart do not meet in a row of it, so nine
    vectors tell all rows."""
    height, width = ((n + 1) // 2 for n in fine.shape)
    rows, columns = np.arange(height), np.arange(width)
    probes = [np.outer(rows % 3 == y, columns % 3 == x) for y in range(3) for x in range(3)]
    answers = _restricted(fine, _missing(fine, _prolonged(fine, np.stack(probes).astype(np.float32)), 0.0))
    entries: Ties = {}
    for y, x in ((y, x) for y in (-1, 0, 1) for x in (-1, 0, 1)):
        down, right = rows + y, columns + x
        near = down[:, None] % 3 * 3 + right % 3
        # Grids of one or two cells: beyond the edge there is nothing.
        there = ((down >= 0) & (down < height))[:, None] & (right >= 0) & (right < width)
        entries[y, x] = np.take_along_axis(answers, near[None], axis=0)[0] * there
    diagonal = np.maximum(-entries.pop((0, 0)), 0)
    return _Grid(entries, diagonal)


def _unbalanced(values: np.ndarray, across: np.ndarray, down: np.ndarray) -> np.ndarray:
    """What flows into each pixel (N, H, W). By differences: a diagonal that is rounded would leak like a ground."""
    flow = np.zeros_like(values)
    for passed, before, after in (
        (across * np.diff(values, axis=2), flow[:, :, :-1], flow[:, :, 1:]),
        (down * np.diff(values, axis=1), flow[:, :-1], flow[:, 1:]),
    ):
        before += passed
        after -= passed
    return flow


def _cycle(grids: list[_Grid], right: np.ndarray) -> np.ndarray:
    """An approximate solution (N, H, W), by a cycle over these grids."""
    grid, *below = grids
    values = np.zeros_like(right)
    _smooth(grid, values, right, COLOURS * SWEEPS)
    if below:
        values += _prolonged(grid, _cycle(below, _restricted(grid, _missing(grid, values, right))))
        _smooth(grid, values, right, COLOURS[::-1] * SWEEPS)
    return values


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return (one * other).sum(axis=(1, 2), keepdims=True)


def _ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0)


def _prolonged(grid: _Grid, coarse: np.ndarray) -> np.ndarray:
    height, width = grid.shape
    doubled = np.pad(coarse, ((0, 0), (0, 1), (0, 1)), mode="edge").repeat(2, axis=1).repeat(2, axis=2)
    total = np.zeros((len(coarse), height, width), np.float32)
    for (b, a), weights in grid.takes.items():
        stopping.check()
        total += weights * doubled[:, 2 * b : 2 * b + height, 2 * a : 2 * a + width]
    return total


def _restricted(grid: _Grid, values: np.ndarray) -> np.ndarray:
    """The transpose of _prolonged."""
    height, width = ((n + 1) // 2 for n in grid.shape)
    total = np.zeros((len(values), height + 1, width + 1), np.float32)
    for (b, a), weights in grid.takes.items():
        stopping.check()
        shares = np.pad(weights * values, ((0, 0), (0, grid.shape[0] % 2), (0, grid.shape[1] % 2)))
        rows = shares[:, ::2] + shares[:, 1::2]
        total[:, b : b + height, a : a + width] += rows[:, :, ::2] + rows[:, :, 1::2]
    return total[:, :height, :width]


def _smooth(grid: _Grid, values: np.ndarray, right: np.ndarray, colours: Iterable[tuple[int, int]]) -> None:
    """Gauss-Seidel sweeps over values (N, H, W), in place: those of one colour after another."""
    height, width = grid.shape
    padded = np.pad(values, ((0, 0), (1, 1), (1, 1)))
    for y, x in colours:
        stopping.check()
        cells = np.s_[y::2, x::2]
        total = right[:, *cells]
        for (dy, dx), weight in grid.weights.items():
            near = padded[:, y + 1 + dy : height + 1 + dy : 2, x + 1 + dx : width + 1 + dx : 2]
            total = total + near * weight[cells]
        np.copyto(padded[:, 1:-1, 1:-1][:, *cells], total * grid.inverse[cells], where=grid.live[cells])
    values[:] = padded[:, 1:-1, 1:-1]


def _missing(grid: _Grid, values: np.ndarray, right: np.ndarray | float) -> np.ndarray:
    """What the equations of the live cells still miss with values (N, H, W)."""
    stopping.check()
    total, padded = right - grid.diagonal * values, np.pad(values, ((0, 0), (1, 1), (1, 1)))
    for (dy, dx), weight in grid.weights.items():
        total += weight * _part(padded, dy, dx)
    return total * grid.live


def _near(values: np.ndarray, dy: int, dx: int) -> np.ndarray:
    """The neighbours (H, W) of all cells at an offset of 1 at most; beyond the edge they are 0."""
    return _part(np.pad(values, 1), dy, dx)


def _part(padded: np.ndarray, dy: int, dx: int) -> np.ndarray:
    return padded[..., 1 + dy : padded.shape[-2] - 1 + dy, 1 + dx : padded.shape[-1] - 1 + dx]
