"""Diffusion with conductances: coefficients that spread freely within what the picture shows as one, and hardly across
its edges.

The method is multigrid as in compute.diffusion, with a prolongation that follows the operator: what a cell takes of the
coarse cells around it goes by how it is tied to them (Dendy's black box multigrid, 1982). A grid knows little of what
lies between edges that are finer than its cells. So the grid whose cells are the guide's is solved by conjugate
gradients, each iteration a cycle over it and the coarser ones; where the guide's cells are pixels, the grid after the
pixels is. On the grids before it conductances are smooth, and V-cycles are enough.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..core import stopping
from ..core.pixels.conductances import cell_side, conductances
from .diffusion import COLOURS, finished

# Cycles where the guide's cells are pixels, at most, and the iterations of conjugate gradients in each: frames of films
# at 640 × 360 take four, specks of single pixels some forty. And cycles where the cells are larger, so that on pixels
# conductances are smooth.
CYCLES = (4,) * 48
SMOOTH_CYCLES = (5, 3, 2, 2)
# Cycles end where those to come would change no coefficient by as much. Largest error × 255 over 40 pictures of specks
# and noise, on a GPU, for 1/512, 1/1024: 2.1, 0.65; by eight cycles, whatever they change: 27.
ENOUGH = 1 / 1024
# Gauss-Seidel sweeps over a grid before its correction by coarser ones, and again after it.
SWEEPS = 2
# So many grids after that of the conjugate gradients are visited twice for each visit of the one before.
TWICE = 2
# A cell of which more than this share of the diagonal is no tie to free cells does not follow them fully.
GROUNDED = 1e-3
_OFFSETS = tuple((y, x) for y in (-1, 0, 1) for x in (-1, 0, 1))

Ties = dict[tuple[int, int], Any]  # arrays (H, W), or 0, by offset (dy, dx)


def diffuse_along_edges(labels: np.ndarray, count: int, guide: np.ndarray, strength: float) -> np.ndarray:
    """Coefficients (count, H, W) float32, ≥ 0 and of sum 1, from labels (H, W): 0 free, 1 + shutter fixed. Some pixel
    has to be fixed, and some free.

    guide: (h, w, 3 or more) as for core.pixels.conductances; its cells are pixels, or 2 × 2, 4 × 4, … of them
    strength: 0 … 1, how much conductances follow it
    """
    side = cell_side(guide.shape[:2], labels.shape)
    across, down = (ties.astype(np.float32) for ties in conductances(guide, strength, labels.shape))
    grids = [_finest(labels == 0, across, down)]
    while grids[-1].shape != (1, 1):
        grids.append(_coarser(grids[-1]))
    solved = min(first_solved(side), len(grids) - 1)
    solution, last = _padded(labels == np.arange(1, count + 1)[:, None, None]), 0.0
    for iterations in CYCLES if side == 1 else SMOOTH_CYCLES:
        flow = _unbalanced(solution, across, down) * grids[0].live
        change = _cycle(grids, flow, solved, iterations)
        _inner(solution)[:] += change
        before, last = last, np.abs(change).max()
        if is_enough(last, before):
            break
    return finished(_inner(solution))


def follows_edges(labels: np.ndarray, guide: np.ndarray | None, strength: float) -> bool:
    """Whether there is anything to diffuse with other conductances than 1."""
    return guide is not None and strength > 0 and 0 < int(np.count_nonzero(labels)) < labels.size


def is_enough(change: float, before: float) -> bool:
    """Whether cycles can end, by how much the last one and the one before it have changed coefficients at most; 0 where
    there was none. Changes are taken to go on shrinking as they did: there are pictures where they hardly do."""
    return change == 0 or (change < before and change**2 < ENOUGH * (before - change))


def first_solved(side: int) -> int:
    """The grid that conjugate gradients solve, where the guide's cells are so many pixels wide."""
    return max(1, side.bit_length() - 1)


class _Grid:
    """A grid's operator A between its free cells, and the prolongation P from the next grid.

    weights: {(dy, dx): (H, W)} what ties a cell to its neighbour, −A
    diagonal: (H, W) of A, 0 for cells that are not free
    takes: {(b, a): (H, W)} what cell (y, x) takes of the next grid's cell (y // 2 + b, x // 2 + a)
    """

    def __init__(self, weights: Ties, diagonal: np.ndarray):
        self.shape, self.weights, self.diagonal = diagonal.shape, weights, diagonal
        self.live = diagonal > 0
        self.inverse = np.divide(1, diagonal, where=self.live, out=np.zeros_like(diagonal))
        self.takes = _prolongation(weights, diagonal, self.live)


def _finest(free: np.ndarray, across: np.ndarray, down: np.ndarray) -> _Grid:
    height, width = free.shape
    ties = {(0, 1): across, (1, 0): down, (0, -1): across, (-1, 0): down}
    whole, diagonal = {}, np.zeros((height, width), np.float32)
    for (dy, dx), weights in ties.items():
        weights = np.pad(weights, ((int(dy < 0), int(dy > 0)), (int(dx < 0), int(dx > 0))))
        diagonal += weights
        whole[dy, dx] = weights * free * _part(_padded(free[None]), (dy, dx))[0]
    return _Grid(whole, diagonal * free)


def _prolongation(ties: Ties, diagonal: np.ndarray, live: np.ndarray) -> Ties:
    """Between two coarse cells of a row or a column a cell takes of each as much as all that lies on its side pulls;
    between four, what its own equation makes of those around it."""

    def tie(dy: int, dx: int) -> np.ndarray:
        return ties.get((dy, dx), np.float32(0))

    def divided(a: Any, b: Any) -> np.ndarray:
        return np.divide(a, b, where=b > 0, out=np.zeros_like(diagonal))

    grounded = diagonal - sum(ties.values()) > GROUNDED * diagonal
    sides = []
    for turned in (False, True):
        before, middle, after = (sum(tie(*((k, j) if turned else (j, k))) for j in (-1, 0, 1)) for k in (-1, 0, 1))
        total = np.where(grounded, diagonal - middle, before + after)
        sides.append((divided(before, total), divided(after, total)))
    (west, east), (north, south) = sides
    height, width = live.shape
    odd_row, odd_column = np.arange(height)[:, None] % 2 == 1, np.arange(width) % 2 == 1

    def near(values: np.ndarray, dy: int, dx: int) -> np.ndarray:
        return _part(_padded(values[None]), (dy, dx))[0]

    between = {
        (0, 0): tie(-1, -1) + tie(0, -1) * near(north, 0, -1) + tie(-1, 0) * near(west, -1, 0),
        (0, 1): tie(-1, 1) + tie(0, 1) * near(north, 0, 1) + tie(-1, 0) * near(east, -1, 0),
        (1, 0): tie(1, -1) + tie(0, -1) * near(south, 0, -1) + tie(1, 0) * near(west, 1, 0),
        (1, 1): tie(1, 1) + tie(0, 1) * near(south, 0, 1) + tie(1, 0) * near(east, 1, 0),
    }
    total = np.where(grounded, diagonal, sum(ties.values()))
    takes = {}
    for (b, a), middle in between.items():
        stopping.check()
        alone = live if (b, a) == (0, 0) else 0
        in_row = (west, east)[a] if b == 0 else 0
        in_column = (north, south)[b] if a == 0 else 0
        even = np.where(odd_column, in_row, alone)
        takes[b, a] = (live * np.where(odd_row, np.where(odd_column, divided(middle, total), in_column), even)).astype(
            np.float32
        )
    return takes


def _coarser(fine: _Grid) -> _Grid:
    def answer(values: np.ndarray) -> np.ndarray:
        return -_restricted(fine, _missing(fine, _padded(_prolonged(fine, values)), 0.0))

    weights, diagonal = _galerkin(fine.shape, answer)
    return _Grid(weights, np.maximum(diagonal, 0))


def _unbalanced(solution: np.ndarray, across: np.ndarray, down: np.ndarray) -> np.ndarray:
    """What flows into each pixel (N, H, W). By differences: a diagonal that is rounded would leak like a ground."""
    values = _inner(solution)
    flow = np.zeros_like(values)
    for axis, weights in ((2, across), (1, down)):
        passed = weights * np.diff(values, axis=axis)
        flow, passed = np.moveaxis(flow, axis, 0), np.moveaxis(passed, axis, 0)
        flow[:-1] += passed
        flow[1:] -= passed
        flow = np.moveaxis(flow, 0, axis)
    return flow


def _cycle(grids: list[_Grid], right: np.ndarray, solved: int, iterations: int, twice: int = 0) -> np.ndarray:
    """An approximate solution (N, H, W), by a cycle over these grids.

    solved: which of them conjugate gradients solve in so many iterations; none if it is 0 or less
    twice: how many of the grids after the first are visited twice
    """
    grid, *below = grids
    values = _padded(np.zeros_like(right))
    for colours in (COLOURS,) * SWEEPS:
        _smooth(grid, values, right, colours)
    if not below:
        return _inner(values)
    coarse = _restricted(grid, _missing(grid, values, right))
    if solved == 1:
        correction = _conjugate_gradients(below, coarse, iterations)
    else:
        correction = _cycle(below, coarse, solved - 1, iterations, twice - 1)
        if twice > 0 and len(below) > 1:
            correction += _cycle(below, _missing(below[0], _padded(correction), coarse), 0, 0, twice - 1)
    _inner(values)[:] += _prolonged(grid, correction)
    for colours in (COLOURS[::-1],) * SWEEPS:
        _smooth(grid, values, right, colours)
    return _inner(values)


def _conjugate_gradients(grids: list[_Grid], right: np.ndarray, iterations: int) -> np.ndarray:
    solution, residual, direction = np.zeros_like(right), right, np.zeros_like(right)
    before = np.zeros((len(right), 1, 1), np.float32)
    for _ in range(iterations):
        guess = _cycle(grids, residual, 0, 0, TWICE)
        power = _dot(residual, guess)
        direction = guess + _ratio(power, before) * direction
        answer = -_missing(grids[0], _padded(direction), 0.0)
        step = _ratio(power, _dot(direction, answer))
        solution = solution + step * direction
        residual = residual - step * answer
        before = power
    return solution


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return (one * other).sum(axis=(1, 2), keepdims=True)


def _ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0)


def _prolonged(grid: _Grid, coarse: np.ndarray) -> np.ndarray:
    total = np.zeros((len(coarse), *grid.shape), np.float32)
    for (b, a), weights in grid.takes.items():
        stopping.check()
        rows, columns = (
            np.minimum(np.arange(n) // 2 + k, count - 1)
            for n, k, count in zip(grid.shape, (b, a), coarse.shape[1:], strict=True)
        )
        total += weights * coarse[:, rows][:, :, columns]
    return total


def _restricted(grid: _Grid, values: np.ndarray) -> np.ndarray:
    """The transpose of _prolonged."""
    height, width = ((n + 1) // 2 for n in grid.shape)
    total = np.zeros((len(values), height + 1, width + 1), np.float32)
    for (b, a), weights in grid.takes.items():
        stopping.check()
        shares = np.pad(weights * values, ((0, 0), (0, grid.shape[0] % 2), (0, grid.shape[1] % 2)))
        total[:, b : b + height, a : a + width] += shares.reshape(len(values), height, 2, width, 2).sum(axis=(2, 4))
    return total[:, :height, :width]


def _galerkin(shape: tuple[int, ...], answer: Callable[[np.ndarray], np.ndarray]) -> Any:
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


def _smooth(level: _Grid, solution: np.ndarray, right: np.ndarray, colours: Iterable[Any]) -> None:
    """A Gauss-Seidel sweep over the padded solution, in four colours."""
    height, width = level.shape
    for y, x in colours:
        stopping.check()
        cells = np.s_[y::2, x::2]
        total = right[:, *cells]
        for (dy, dx), weight in level.weights.items():
            near = solution[:, y + 1 + dy : height + 1 + dy : 2, x + 1 + dx : width + 1 + dx : 2]
            total = total + near * weight[cells]
        own = _inner(solution)[:, *cells]
        np.copyto(own, total * level.inverse[cells], where=level.live[cells])


def _missing(level: _Grid, solution: np.ndarray, right: Any) -> np.ndarray:
    """What the equations of the live cells of a padded solution still miss, (N, H, W)."""
    stopping.check()
    total = right - level.diagonal * _inner(solution)
    for offset, weight in level.weights.items():
        total += weight * _part(solution, offset)
    return total * level.live


def _padded(array: np.ndarray) -> np.ndarray:
    """(N, H, W) with a frame of zeros around, float32."""
    return np.pad(array.astype(np.float32), ((0, 0), (1, 1), (1, 1)))


def _inner(padded: np.ndarray) -> np.ndarray:
    return padded[:, 1:-1, 1:-1]


def _part(padded: np.ndarray, offset: tuple[int, int]) -> np.ndarray:
    """The neighbours at an offset (dy, dx) of all cells."""
    dy, dx = offset
    return padded[:, 1 + dy : padded.shape[1] - 1 + dy, 1 + dx : padded.shape[2] - 1 + dx]
