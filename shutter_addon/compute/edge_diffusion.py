"""Diffusion with conductances: coefficients that spread freely within what the picture shows as one, and hardly across
its edges.

The free pixels are the nodes of a graph, its links their conductances; what ties a node to fixed pixels is its ground.
A coarser graph has a node for all that hangs together by strong links within 2 × 2 cells of its grid, so that what an
edge separates stays apart however coarse the graph. (Coarse grids of which every cell is one unknown leak through
edges that run between their cells.) W-cycles over these graphs precondition conjugate gradients.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.conductances import conductances

# Iterations of conjugate gradients, each with one W-cycle. Largest error × 255 after 8, 12, 16, 20: 8, 1.4, 0.2, 0.01 in
# frames of films, and 10, 2.8, 0.8, 0.2 in pictures of stripes and checks.
ITERATIONS = 20
# A link joins two nodes if it is at least this share of the root of the product of their diagonals; half of that share
# on each coarser graph.
STRONG = 0.15
# A Jacobi step takes this share of the correction. With 1 it would leave errors that alternate from node to node.
DAMPING = 0.7
# Corrections that are constant over a node are too small by about this factor (Braess 1995).
OVERCORRECTION = 1.7
# A graph of so many nodes or fewer is the coarsest, and its matrix is inverted.
DENSE = 300


@dataclass
class Graph:
    """A graph, and how it becomes the next coarser one.

    Nodes lie in the order of their degrees, the highest first.

    diagonal: (n,) float32, of each node's equation: its links and its ground
    ground: (n,) float32, what ties it to fixed pixels
    links: for rank k, the k-th link of those first nodes that have as many: (neighbour int32, weight float32)
    parent: (n,) int32, the node of the next graph; its number of nodes where there is none, or None on the coarsest
    order: (n,) int32 nodes of this graph in the order of their parents; those without one are left out
    starts: (coarse n,) int32 where each parent's begin in it
    inverse: (n, n) float32 of the coarsest graph's matrix, else None
    """

    diagonal: np.ndarray
    ground: np.ndarray
    links: list[tuple[np.ndarray, np.ndarray]]
    parent: np.ndarray | None = None
    order: np.ndarray | None = None
    starts: np.ndarray | None = None
    inverse: np.ndarray | None = None


def diffuse_along_edges(labels: np.ndarray, count: int, guide: np.ndarray, strength: float) -> np.ndarray:
    """The solution (count, H, W) float32 before small shares are dropped; some pixel has to be fixed, and some free.

    guide, strength: as for core.conductances, (H, W, 3 or more)
    """
    fixed = labels == np.arange(1, count + 1)[:, None, None]
    solution = fixed.astype(np.float32)
    graphs, pixels, right = graphs_of(labels, guide, strength, solution)
    solution.reshape(count, -1)[:, pixels] = _conjugate_gradients(graphs, right).T
    return solution


def graphs_of(labels, guide, strength, values):
    """The graphs, the finest first; the pixels (n,) of its nodes; and its right side (n, N) float32.

    values: (N, H, W) float32 the fixed pixels' values
    """
    height, width = labels.shape
    cells = np.arange(labels.size, dtype=np.int32).reshape(height, width)
    right, down = conductances(guide, strength)
    one = np.concatenate([cells[:, :-1].ravel(), cells[:-1].ravel()])
    other = np.concatenate([cells[:, 1:].ravel(), cells[1:].ravel()])
    weight = np.concatenate([right.ravel(), down.ravel()])
    free = labels.ravel() == 0
    values = values.reshape(len(values), -1).T
    ground, given = np.zeros(labels.size), np.zeros((labels.size, values.shape[1]), np.float32)
    for a, b in ((one, other), (other, one)):
        held = free[a] & ~free[b]
        ground += np.bincount(a[held], weight[held], labels.size)
        np.add.at(given, a[held], weight[held, None].astype(np.float32) * values[b[held]])
    inner = free[one] & free[other]
    pixels = np.nonzero(free)[0]
    number = np.cumsum(free) - 1
    one, other = number[one[inner]], number[other[inner]]
    place = np.stack(np.divmod(pixels, width))
    graphs, order = _hierarchy(one, other, weight[inner], ground[pixels], place, max(height, width))
    return graphs, pixels[order], given[pixels[order]]


def _hierarchy(one, other, weight, ground, place, extent):
    """The graphs, and the order of the finest one's nodes among those given.

    one, other, weight: the links' ends and weights; ground: (n,); place: (2, n) cells; extent: cells along a side
    """
    graphs, strong, first = [], STRONG, None
    while True:
        degree = np.bincount(one, minlength=len(ground)) + np.bincount(other, minlength=len(ground))
        order = np.argsort(-degree, kind="stable")
        first = order if first is None else first
        if graphs:
            _hand_over(graphs[-1], order, degree)
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        one, other, ground, place = rank[one], rank[other], ground[order], place[:, order]
        if graphs:
            alone = degree[order] == 0
            kept = len(order) - np.count_nonzero(alone)
            ground, place = ground[:kept], place[:, :kept]
        diagonal = ground + sum(np.bincount(ends, weight, len(ground)) for ends in (one, other))
        links = _ranked(one, other, weight, len(ground))
        graphs.append(Graph(diagonal.astype(np.float32), ground.astype(np.float32), links))
        if len(ground) <= DENSE:
            graphs[-1].inverse = _inverse(one, other, weight, diagonal)
            return graphs, first
        extent = -(-extent // 2)
        place = place // 2
        parent = _joined(one, other, weight, diagonal, place, 0.0 if extent == 1 else strong)
        graphs[-1].parent = parent
        strong /= 2
        count = parent.max() + 1
        place = _first_of(parent, place, count)
        ground = np.bincount(parent, ground, count)
        one, other, weight = _merged(parent[one], parent[other], weight, count)


def _joined(one, other, weight, diagonal, place, strong) -> np.ndarray:
    """The node of the next graph for each node: those that strong links join within a cell have the same."""
    root = np.sqrt(diagonal)
    joins = (place[:, one] == place[:, other]).all(axis=0) & (weight >= strong * root[one] * root[other])
    one, other = one[joins], other[joins]
    label = np.arange(len(diagonal))
    while True:
        least = np.minimum(label[one], label[other])
        if (label[one] == least).all() and (label[other] == least).all():
            break
        np.minimum.at(label, one, least)
        np.minimum.at(label, other, least)
        label = label[label]
    return (np.cumsum(label == np.arange(len(label))) - 1)[label]


def _first_of(parent, place, count):
    result = np.empty((2, count), place.dtype)
    result[:, parent] = place
    return result


def _merged(one, other, weight, count):
    """Links between the nodes of a coarser graph: those of the same two nodes become one."""
    apart = one != other
    one, other, weight = one[apart], other[apart], weight[apart]
    key = np.minimum(one, other).astype(np.int64) * count + np.maximum(one, other)
    order = np.argsort(key, kind="stable")
    key = key[order]
    starts = np.nonzero(np.diff(key, prepend=-1))[0]
    total = np.add.reduceat(weight[order], starts) if len(key) else weight
    return *np.divmod(key[starts], count), total


def _hand_over(finer: Graph, order, degree) -> None:
    """Gives the finer graph its children by parent, in the coarser one's order; nodes without links are no parents."""
    count = np.count_nonzero(degree)
    rank = np.full(len(order), count)
    rank[order[:count]] = np.arange(count)
    finer.parent = rank[finer.parent].astype(np.int32)
    by_parent = np.argsort(finer.parent, kind="stable")
    kept = np.searchsorted(finer.parent[by_parent], count)
    finer.order = by_parent[:kept].astype(np.int32)
    finer.starts = np.searchsorted(finer.parent[finer.order], np.arange(count)).astype(np.int32)


def _ranked(one, other, weight, count):
    """Graph.links of links whose nodes lie in the order of their degrees."""
    ends, to, weights = np.r_[one, other], np.r_[other, one], np.r_[weight, weight].astype(np.float32)
    order = np.argsort(ends, kind="stable")
    ends, to, weights = ends[order], to[order], weights[order]
    degree = np.bincount(ends, minlength=count)
    rank = np.arange(len(ends)) - np.repeat(np.cumsum(degree) - degree, degree)
    by_rank = np.argsort(rank, kind="stable")
    to, weights = to[by_rank].astype(np.int32), weights[by_rank]
    stops = np.cumsum(np.bincount(rank))
    return [(to[a:b], weights[a:b]) for a, b in zip(np.r_[0, stops[:-1]], stops, strict=True)] if len(stops) else []


def _inverse(one, other, weight, diagonal) -> np.ndarray:
    matrix = np.diag(diagonal)
    matrix[one, other] -= weight
    matrix[other, one] -= weight
    return np.linalg.inv(matrix).astype(np.float32)


def _conjugate_gradients(graphs, right) -> np.ndarray:
    solution, residual, direction = np.zeros_like(right), right.copy(), np.zeros_like(right)
    before = np.zeros(right.shape[1], np.float32)
    for _ in range(ITERATIONS):
        guess = _cycle(graphs, residual)
        power = (residual * guess).sum(axis=0)
        direction = guess + _ratio(power, before) * direction
        answer = _applied(graphs[0], direction)
        step = _ratio(power, (direction * answer).sum(axis=0))
        solution += step * direction
        residual -= step * answer
        before = power
    return solution


def _ratio(a, b):
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0)


def _cycle(graphs, right) -> np.ndarray:
    """An approximate solution, linear and symmetric in the right side: one W-cycle."""
    graph, *coarser = graphs
    if graph.inverse is not None:
        return graph.inverse @ right
    inverse = (DAMPING / graph.diagonal)[:, None]
    values = inverse * right
    coarse = _gathered(graph, right - _applied(graph, values))
    correction = _cycle(coarser, coarse)
    if coarser[0].inverse is None:
        correction += _cycle(coarser, coarse - _applied(coarser[0], correction))
    values += np.float32(OVERCORRECTION) * np.append(correction, np.zeros_like(correction[:1]), axis=0)[graph.parent]
    values += inverse * (right - _applied(graph, values))
    return values


def _applied(graph, values) -> np.ndarray:
    """The graph's matrix times values (n, N). By differences: a diagonal that is rounded would leak like a ground."""
    total = graph.ground[:, None] * values
    for to, weight in graph.links:
        total[: len(to)] += weight[:, None] * (values[: len(to)] - values[to])
    return total


def _gathered(graph, values) -> np.ndarray:
    """The sums of values (n, N) over the nodes of each parent."""
    return np.add.reduceat(values[graph.order], graph.starts, axis=0)
