"""compute.edge_diffusion on a device: its graphs are made on the host, all that is solved is solved on the device."""

from __future__ import annotations

import numpy as np

from . import edge_diffusion
from .passes import LOCAL_ROW, Image, Pass

# Texels along a row of a graph's textures; include/graph.glsl has the same.
ROW = 4096
# Parts that a sum over all nodes is made of.
PARTS = 1024

_READ = Image("rgba32f", reads=True, writes=False)
_STORED = Image("rgba32f")
_CHANGED = Image("rgba32f", reads=True)
_LINKED = dict.fromkeys(("values", "nodes", "links", "ranks"), _READ)


def _pass(name: str, reads=(), writes=(), changes=(), **constants: str) -> Pass:
    images = dict.fromkeys(reads, _READ) | dict.fromkeys(writes, _STORED) | dict.fromkeys(changes, _CHANGED)
    return Pass(f"graph_{name}", images=images, constants={"count": "int", **constants}, local_size=LOCAL_ROW)


_START = _pass("start", ("right", "nodes"), ("result",), damping="float")
_SMOOTH = _pass("smooth", ("right", *_LINKED), ("result",), rank_count="int", damping="float")
_RESIDUAL = _pass("residual", ("right", *_LINKED), ("result",), rank_count="int", amount="float")
_RESTRICT = _pass("restrict", ("right", *_LINKED, "families", "children"), ("result",), rank_count="int")
_PROLONG = _pass("prolong", ("nodes", "once", "again"), (), ("values",), parents="int", twice="int", amount="float")
_DENSE = _pass("dense", ("inverse", "right"), ("result",))
_DOT = _pass("dot", ("values", "right"), ("result",), parts="int")
_SUM = Pass(
    "graph_sum",
    images={"result": _READ, "sums": _CHANGED},
    constants={"parts": "int", "place": "int"},
    local_size=(1, 1, 1),
)
_TURN = _pass("turn", ("values", "sums"), (), ("result",), fresh="int")
_STEP = _pass("step", ("values", "right", "sums"), (), ("solution", "result"), fresh="int")
_FINISH = Pass(
    "graph_finish",
    images={"pixels": Image("r32f", reads=True, writes=False), "values": _READ, "result": _STORED},
    constants={"size": "ivec2", "layers": "int", "nothing": "float"},
)


class _Level:
    """A graph's textures, by the names that the passes have for them, and its own for values."""

    def __init__(self, device, graph, layers: int):
        self.count = len(graph.diagonal)
        self.dense = graph.inverse is not None
        self.rank_count = -(-len(graph.links) // 2)
        self.textures = {}
        if self.dense:
            inverse = np.pad(graph.inverse, ((0, 0), (0, -self.count % 4)))
            self.textures["inverse"] = _filled(device, inverse.reshape(1, self.count, -1, 4))
        nodes = np.zeros((self.count, 4), np.float32)
        nodes[:, 0], nodes[:, 1] = graph.diagonal, graph.ground
        nodes[:, 2] = 0 if self.dense else graph.parent
        self.textures["nodes"] = _listed(device, nodes)
        links, ranks = _paired(graph)
        self.textures["links"], self.textures["ranks"] = _listed(device, links), _listed(device, ranks)
        if not self.dense:
            families = np.zeros((len(graph.starts), 4), np.float32)
            families[:, 0] = graph.starts
            families[:, 1] = np.append(graph.starts[1:], len(graph.order))
            self.textures["families"] = _listed(device, families)
            children = np.zeros((len(graph.order), 4), np.float32)
            children[:, 0] = graph.order
            self.textures["children"] = _listed(device, children)
        for name in ("right", "values", "once", "rest", "again"):
            self.textures[name] = _texture(device, self.count, layers)

    def release(self) -> None:
        for texture in self.textures.values():
            texture.release()


def solve(device, labels, count: int, guide, strength: float, result, nothing: float) -> None:
    """Stores the coefficients in `result`, a texture array rgba32f of the labels' size, four shutters to a layer.

    labels, count, guide, strength: as for edge_diffusion.diffuse_along_edges
    nothing: coefficients below this are set to 0
    """
    fixed = (labels == np.arange(1, count + 1)[:, None, None]).astype(np.float32)
    graphs, pixels, right = edge_diffusion.graphs_of(labels, guide, strength, fixed)
    layers = result.size[2]
    levels = [_Level(device, graph, layers) for graph in graphs]
    used = []
    try:
        numbers = -labels.astype(np.float32).reshape(-1)
        numbers[pixels] = np.arange(len(pixels))
        used.append(device.texture(labels.shape[1], labels.shape[0], 1, "r32f"))
        device.write(used[0], numbers.reshape(*labels.shape, 1))
        padded = np.zeros((len(pixels), 4 * layers), np.float32)
        padded[:, :count] = right
        used.append(_listed(device, padded))
        used += [_texture(device, len(pixels), layers) for _ in range(4)]
        used += [device.texture(4, 1, layers, "rgba32f"), _texture(device, PARTS, layers)]
        _conjugate_gradients(device, levels, layers, *used[1:])
        size = labels.shape[::-1]
        images = {"pixels": used[0], "values": used[2], "result": result}
        device.run(_FINISH, size, images=images, size=size, layers=layers, nothing=nothing)
    finally:
        for each in (*levels, *used):
            each.release()


def _conjugate_gradients(device, levels, layers, residual, solution, guess, direction, answer, sums, parts) -> None:
    count = levels[0].count

    def dot(values, right, place):
        used = min(PARTS, count)
        _run(device, _DOT, levels[0], layers, extent=used, values=values, right=right, result=parts, parts=used)
        device.run(_SUM, (1, 1, layers), images={"result": parts, "sums": sums}, parts=used, place=place)

    for iteration in range(edge_diffusion.ITERATIONS):
        fresh = int(iteration == 0)
        _cycle(device, levels, layers, residual, guess)
        dot(residual, guess, 0)
        _run(device, _TURN, levels[0], layers, values=guess, sums=sums, result=direction, fresh=fresh)
        _run(device, _RESIDUAL, levels[0], layers, right=guess, values=direction, result=answer, amount=0.0)
        dot(direction, answer, 2)
        state = {"solution": solution, "result": residual, "sums": sums}
        _run(device, _STEP, levels[0], layers, values=direction, right=answer, fresh=fresh, **state)


def _cycle(device, levels, layers, right, result) -> None:
    """A W-cycle: an approximate solution for a right side."""
    level, *coarser = levels
    if level.dense:
        _run(device, _DENSE, level, layers, right=right, result=result)
        return
    below = coarser[0]
    values = level.textures["values"]
    _run(device, _START, level, layers, right=right, result=values, damping=edge_diffusion.DAMPING)
    own = below.textures
    _run(device, _RESTRICT, level, layers, extent=below.count, right=right, result=own["right"], count=below.count)
    _cycle(device, coarser, layers, own["right"], own["once"])
    if not below.dense:
        _run(device, _RESIDUAL, below, layers, right=own["right"], values=own["once"], result=own["rest"], amount=1.0)
        _cycle(device, coarser, layers, own["rest"], own["again"])
    given = {"once": own["once"], "again": own["again"], "parents": below.count, "twice": int(not below.dense)}
    _run(device, _PROLONG, level, layers, amount=edge_diffusion.OVERCORRECTION, **given)
    _run(device, _SMOOTH, level, layers, right=right, result=result, damping=edge_diffusion.DAMPING)


def _run(device, program: Pass, level: _Level, layers: int, *, extent: int | None = None, **extra) -> None:
    """Runs a pass over a graph's nodes, or over `extent` invocations. extra: textures and constants by name."""
    extent = level.count if extent is None else extent
    given = {"count": level.count, "rank_count": level.rank_count, **level.textures, **extra}
    device.run(
        program,
        (min(extent, ROW), -(-extent // ROW), layers),
        images={name: given[name] for name in program.images},
        **{name: given[name] for name in program.constants},
    )


def _paired(graph) -> tuple[np.ndarray, np.ndarray]:
    """Links (texels, 4), two to a texel, and ranks (ranks, 4): where each begins, and its number of nodes."""
    parts, ranks, begin = [], [], 0
    for k in range(0, len(graph.links), 2):
        to, weight = graph.links[k]
        part = np.zeros((len(to), 4), np.float32)
        part[:, 0], part[:, 1] = to, weight
        if k + 1 < len(graph.links):
            to, weight = graph.links[k + 1]
            part[: len(to), 2], part[: len(to), 3] = to, weight
        ranks.append((begin, len(part), 0, 0))
        parts.append(part)
        begin += len(part)
    if not parts:
        return np.zeros((1, 4), np.float32), np.zeros((1, 4), np.float32)
    return np.concatenate(parts), np.array(ranks, np.float32)


def _texture(device, count: int, layers: int):
    """A texture for values of nodes."""
    return device.texture(min(count, ROW), -(-count // ROW), layers, "rgba32f")


def _listed(device, values: np.ndarray):
    """A texture of the values (n, 4 · layers) float32 of nodes."""
    count, layers = len(values), values.shape[1] // 4
    rows = np.zeros((layers, -(-count // ROW) * min(count, ROW), 4), np.float32)
    rows[:, :count] = np.moveaxis(values.reshape(count, layers, 4), 1, 0)
    return _filled(device, rows.reshape(layers, -1, min(count, ROW), 4))


def _filled(device, values: np.ndarray):
    layers, height, width, _ = values.shape
    texture = device.texture(width, height, layers, "rgba32f")
    for layer in range(layers):
        device.write(texture, np.ascontiguousarray(values[layer]), layer)
    return texture
