"""Diffusion on a device: the harmonic function of compute.diffusion, with work at full size near scribbles alone.

Far from scribbles the solution is smooth. So a grid of the multigrid, coarse cells on the even cells of the finer one,
has cells of its own only in tiles within BAND tiles of a scribble's; elsewhere it is what the next grid makes of it,
linearly between the cells. What is solved is the Galerkin equation on all those cells together: with U the values of a
grid, f its right side, A its operator, P the prolongation, and W = U − P U' what it has of its own beside the next
grid's U' (nothing, outside its tiles), the right side of the next grid is Pᵀ(f − A W), and its operator PᵀAP (nine
points). P interpolates by the operator, as Dendy's black box multigrid does: fixed pixels are walls on all grids, and
no scene is slow.

Nothing of earlier calls is left in a solution that did not start from one: operators depend on the labels alone, and
are made anew where labels are near or were; W and f are nothing outside their tiles.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .passes import Image, Pass

# Largest error × 255 after 1, 2, 3, 4 cycles: over the scenes of the tests 3.9, 0.67, 0.66, 0.66 (median 2.1, 0.13,
# 0.07, 0.07), what is left then is what is linear far from scribbles; over their lattices of dots 11, 1.6, 0.25, 0.24.
CYCLES = 3
# From the solution before scribbles moved a little: 0.66 where they moved by 3 pixels of 1920. Two cycles take twice
# as long, and are as exact wherever scribbles come from.
WARM_CYCLES = 1
# Of every grid before and after the coarser ones: at full size two, for all that a moved scribble leaves is there.
SWEEPS = 1
FINEST_SWEEPS = 2
# A grid of so many cells along its longer side, or fewer, has cells everywhere; the first such one has two turns.
WHOLE = 128
# A grid of so many cells along its longer side, or fewer, is solved at once, by one invocation.
SOLVED = 8
# How far from a scribble's tile a larger grid has cells of its own, in tiles. Two leave 0.19 of the 0.66, in 1.7 times
# the time.
BAND = 1
# How much what holds a cell beside its line of coarse cells keeps it from following them.
HOLD = 0.3
# Coefficients below this are none: regions that one shutter encloses get exactly that one.
NOTHING = 1 / 4096
_COLOURS = ((0, 0), (1, 1), (0, 1), (1, 0))

_READ = Image("rgba32f", reads=True, writes=False)
_STORED = Image("rgba32f")
_CHANGED = Image("rgba32f", reads=True)
_TILES = {"tiles": Image("r32f", reads=True, writes=False)}
_LABELS = {"labels": Image("r16ui", reads=True, writes=False)}
_GRID = {"first": "int", "last": "int", "size": "ivec2"}
_GRIDS = {**_GRID, "coarse": "ivec2"}


def _pass(name: str, reads: tuple[str, ...], images: dict[str, Image], constants: dict[str, str]) -> Pass:
    """A pass over tiles. All textures are images: a software renderer's texelFetch takes far longer."""
    return Pass(f"diffuse_{name}", images={**_TILES, **dict.fromkeys(reads, _READ), **images}, constants=constants)


_START = _pass("start", (), {**_LABELS, "solution": _STORED, "own": _STORED}, {**_GRID, "warm": "int"})
_CLEAR = _pass("clear", ("finer",), dict.fromkeys(("solution", "own", "right"), _STORED), {**_GRID, "warm": "int"})
_WEIGHTS_FINEST = _pass("weights_finest", (), {**_LABELS, "weights": _STORED}, {**_GRID, "hold": "float"})
_WEIGHTS = _pass("weights", ("stencil",), {"weights": _STORED}, {**_GRID, "hold": "float"})
_COARSEN_FINEST = _pass("coarsen_finest", ("weights",), {"next": _STORED}, _GRIDS)
_COARSEN = _pass("coarsen", ("stencil", "weights"), {"next": _STORED}, _GRIDS)
_SMOOTH_FINEST = _pass("smooth_finest", (), {**_LABELS, "solution": _CHANGED}, {**_GRID, "colour": "int"})
_SMOOTH = _pass("smooth", ("stencil", "right"), {"solution": _CHANGED}, {**_GRID, "colour": "ivec2"})
_PROLONG = _pass("prolong", ("from", "coarser", "weights"), {"to": _STORED}, {**_GRIDS, "amount": "float"})
_RESTRICT_FINEST = _pass("restrict_finest", ("own", "weights"), {"next": _STORED}, _GRIDS)
_RESTRICT = _pass("restrict", ("stencil", "own", "weights", "right"), {"next": _STORED}, _GRIDS)
_SOLVE = Pass(
    "diffuse_solve",
    images={"stencil": _READ, "right": _READ, "solution": _STORED},
    constants={"size": "ivec2"},
    defines={"SOLVED": SOLVED},
    local_size=(1, 1, 1),
)
_FINISH = _pass("finish", (), {"solution": _CHANGED}, {**_GRID, "layers": "int", "nothing": "float"})
_EXPAND = _pass("expand", ("coarser",), {"solution": _STORED}, _GRIDS)
_EXPAND_RIM = _pass("expand_rim", ("coarser",), {"solution": _STORED}, {**_GRIDS, "layers": "int", "beyond": "vec2"})


class _Grid:
    """A grid's textures: layers of four shutters each, the operator, which the finest reads from its labels, and P.

    The last solve's tiles (rows, columns): `reached` by scribbles, of 8 × 8 cells; `touched` by them more closely, and
    `solid`, all fixed, of 4 × 4. `ranges`: where lists of them lie in the texture of all.
    """

    def __init__(self, device, width: int, height: int, layers: int, finest: bool):
        self.size = width, height
        self.layers = layers
        self.finest = finest
        self.ranges: dict[str, tuple[int, int]] = {}
        self.reached = np.ones((-(-height // 8), -(-width // 8)), bool)
        self.touched = np.ones((-(-height // 4), -(-width // 4)), bool)
        self.solid = np.zeros_like(self.touched)
        self.codes = _codes(*self.reached.shape, 2), _codes(*self.touched.shape, 1)
        self.textures = {name: device.texture(width, height, layers, "rgba32f") for name in ("solution", "own")}
        self.textures["weights"] = device.texture(width, height, 1, "rgba32f")
        if self.finest:
            self.textures["labels"] = device.texture(width, height, 1, "r16ui")
        else:
            self.textures["right"] = device.texture(width, height, layers, "rgba32f")
            self.textures["stencil"] = device.texture(width, height, 3, "rgba32f")


class Diffusion:
    """diffuse() on a device. Textures stay until the size or the number of shutters changes."""

    def __init__(self, device):
        self._device = device
        self._grids = []
        self._made_for = None
        self._tiles = None

    def solve(self, labels: np.ndarray, count: int, *, warm: bool = False):
        """A texture array rgba32f, shutter i in layer i // 4 and channel i % 4, from labels (H, W) uint16.

        The next call overwrites it. Nothing is read back. warm: start from the last solution, if there is one for this
        size and count: quicker where scribbles moved a little, but what comes out depends on what was solved before.
        """
        warm = self._prepare(labels.shape, count) and warm
        finest = self._grids[0]
        self._device.write(finest.textures["labels"], np.ascontiguousarray(labels, dtype=np.uint16))
        self._list_tiles(labels)
        self._start(int(warm))
        self._coarsen()
        for _ in range(WARM_CYCLES if warm else CYCLES):
            self._cycle(0)
        self._finish()
        return finest.textures["solution"]

    def release(self) -> None:
        for grid in self._grids:
            for texture in grid.textures.values():
                texture.release()
        if self._tiles is not None:
            self._tiles.release()
        self._grids, self._made_for, self._tiles = [], None, None

    def _prepare(self, shape, count) -> bool:
        """Makes the grids; whether they have been solved for this size and count."""
        height, width = shape
        if self._made_for == (width, height, count):
            return True
        self.release()
        self._made_for = width, height, count
        layers = -(-count // 4)
        self._grids.append(_Grid(self._device, width, height, layers, True))
        while len(self._grids) == 1 or max(self._grids[-1].size) > SOLVED:
            width, height = (width + 1) // 2, (height + 1) // 2
            self._grids.append(_Grid(self._device, width, height, layers, False))
        tiles = sum(4 * grid.reached.size + grid.touched.size for grid in self._grids)
        self._tiles = self._device.texture(256, -(-tiles // 256), 1, "r32f")
        return False

    def _list_tiles(self, labels: np.ndarray) -> None:
        """For every grid: what tiles have cells of their own, and whose operator and values are to be made anew."""
        held, free = _in_fours(labels != 0)
        listed, end = [], 0
        for grid in self._grids:
            touched = _grown(held)
            solid = ~_grown(free, 1 if grid.finest else 2)
            changed = (touched | grid.touched) & ~(solid & grid.solid)
            held, free = _halved(held), _halved(free)
            # Cells of a coarser grid that lie in a scribble may still follow free ones beside it.
            live = free if grid.finest else _grown(free)
            reached = _grown(held, BAND) if max(grid.size) > WHOLE else np.ones_like(held)
            near = reached & live
            feeding = _grown(near)
            around = feeding & live
            stale = (reached | grid.reached) & _grown(live)
            # What lies around is read as having nothing of its own; what is all fixed has labels, at full size alone.
            anew = stale | around | ~live if grid.finest else stale | around
            rim = ~near & live & _last_ones(grid)
            eights, fours = grid.codes
            lists = [eights[tiles] for tiles in (near, around & ~near, live & ~around, rim, anew)]
            lists += [eights[feeding] / 2, fours[changed]]  # a tile is four cells wide on the next grid
            ends = (end + np.cumsum([len(tiles) for tiles in lists])).tolist()
            grid.ranges = {
                "near": (end, ends[0]),
                "reached": (end, ends[1]),
                "far": (ends[0], ends[2]),
                "rim": (ends[2], ends[3]),
                "anew": (ends[3], ends[4]),
                "feeding": (ends[4], ends[5]),
                "changed": (ends[5], ends[6]),
            }
            listed += lists
            end = ends[-1]
            grid.touched, grid.solid, grid.reached = touched, solid, reached
        rows = np.zeros((-(-end // 256), 256, 1), np.float32)
        rows.reshape(-1)[:end] = np.concatenate(listed)
        self._device.write(self._tiles, rows)

    def _start(self, warm: int) -> None:
        """Values to start from, and nothing of what was there for other scribbles."""
        finest = self._grids[0]
        self._run(_START, finest, "anew", 64, finest.layers, warm=warm)
        for fine, grid in pairwise(self._grids):
            self._run(_CLEAR, grid, "anew", 64, grid.layers, finer=fine.textures["solution"], warm=warm)

    def _coarsen(self) -> None:
        """The operators, and what cells take of the next grid's."""
        for fine, coarse in pairwise(self._grids):
            self._run(_WEIGHTS_FINEST if fine.finest else _WEIGHTS, fine, "changed", 8, hold=HOLD)
            coarsen = _COARSEN_FINEST if fine.finest else _COARSEN
            to = {"size": fine.size, "coarse": coarse.size, "next": coarse.textures["stencil"]}
            self._run(coarsen, coarse, "changed", 16, **fine.textures, **to)

    def _cycle(self, index: int) -> None:
        """A V-cycle from a grid on down."""
        grid, *coarser = self._grids[index : index + 2]
        if not coarser:
            self._run(_SOLVE, grid, "near", 1, grid.layers)  # its one tile
            return
        sweeps = FINEST_SWEEPS if grid.finest else SWEEPS
        self._smooth(grid, sweeps)
        self._correct(index, grid, *coarser)
        self._smooth(grid, sweeps)

    def _correct(self, index: int, grid: _Grid, coarse: _Grid) -> None:
        """What the grid has of its own stays; the rest comes from the coarser grids anew."""
        values, own = grid.textures["solution"], grid.textures["own"]
        prolong = {"coarse": coarse.size, "coarser": coarse.textures["solution"]}
        self._run(_PROLONG, grid, "near", 16, grid.layers, **prolong, **{"from": values}, to=own, amount=-1.0)
        restrict = _RESTRICT_FINEST if grid.finest else _RESTRICT
        self._run(restrict, grid, "feeding", 16, grid.layers, coarse=coarse.size, next=coarse.textures["right"])
        first_whole = max(coarse.size) <= WHOLE and (grid.finest or max(grid.size) > WHOLE)
        for _ in range(2 if first_whole else 1):
            self._cycle(index + 1)
        self._run(_PROLONG, grid, "reached", 16, grid.layers, **prolong, **{"from": own}, to=values, amount=1.0)

    def _smooth(self, grid: _Grid, sweeps: int) -> None:
        for _ in range(sweeps):
            if grid.finest:
                for colour in (0, 1):
                    self._run(_SMOOTH_FINEST, grid, "near", 32, grid.layers, colour=colour)
            else:
                for y, x in _COLOURS:
                    if x < grid.size[0] and y < grid.size[1]:
                        self._run(_SMOOTH, grid, "near", 16, grid.layers, colour=(x, y))

    def _finish(self) -> None:
        """Coefficients everywhere, from the coarsest grid on."""
        for index, grid in reversed(list(enumerate(self._grids))):
            self._run(_FINISH, grid, "near", 64, nothing=NOTHING)
            if index + 1 < len(self._grids):
                coarse = self._grids[index + 1]
                below = {"coarse": coarse.size, "coarser": coarse.textures["solution"]}
                self._run(_EXPAND, grid, "far", 16, grid.layers, **below)
                beyond = tuple(-(2 * m + 1) / (4 * m + 8) for m in self._margin(index))
                self._run(_EXPAND_RIM, grid, "rim", 16, **below, beyond=beyond)

    def _margin(self, index: int) -> list[float]:
        """From the centres of the last cells of a grid to the frame's edge, in cells (x, y)."""
        sizes = zip(self._grids[0].size, self._grids[index].size, strict=True)
        return [(pixels - 0.5) / 2**index - (cells - 1) for pixels, cells in sizes]

    def _run(self, program: Pass, grid: _Grid, tiles: str, cells: int, layers: int = 1, **extra) -> None:
        """Runs a pass over so many cells of each of a grid's tiles; `extra` names textures and constants besides the
        grid's own."""
        first, last = grid.ranges[tiles]
        if first == last:
            return
        own = {"size": grid.size, "layers": grid.layers, "first": first, "last": last, "tiles": self._tiles}
        given = {**own, **grid.textures, **extra}
        # Tiles of four invocations go two to a row.
        rows = -(-(last - first) // 2) if program in (_WEIGHTS, _WEIGHTS_FINEST) else last - first
        self._device.run(
            program,
            (cells, rows, layers),
            images={name: given[name] for name in program.images},
            **{name: given[name] for name in program.constants},
        )


def _in_fours(fixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which tiles (rows, columns) of 4 × 4 have any fixed cells of (H, W) bool, and which have any free ones."""
    height, width = fixed.shape
    if height % 4 or width % 4:
        fixed = np.pad(fixed, ((0, -height % 4), (0, -width % 4)), mode="edge")
    fours = np.ascontiguousarray(fixed).view(np.uint32)  # a row of a tile at once
    any_of = fours[0::4] | fours[1::4] | fours[2::4] | fours[3::4]
    all_of = fours[0::4] & fours[1::4] & fours[2::4] & fours[3::4]
    return any_of != 0, all_of != 0x01010101


def _codes(rows: int, columns: int, fours: int) -> np.ndarray:
    """Tiles (rows, columns), each so many times four cells wide, as shaders have them."""
    return (fours * (np.arange(columns) + 4096 * np.arange(rows)[:, None])).astype(np.float32)


def _last_ones(grid: _Grid) -> np.ndarray:
    """The tiles (rows, columns) with cells beyond the last ones of the next grid."""
    width, height = grid.size
    last = np.zeros_like(grid.reached)
    last[:, -1] = width % 2 == 0
    last[-1] |= height % 2 == 0
    return last


def _grown(tiles: np.ndarray, times: int = 1) -> np.ndarray:
    """Tiles (rows, columns) bool and those around them."""
    for _ in range(times):
        rows = tiles.copy()
        rows[1:] |= tiles[:-1]
        rows[:-1] |= tiles[1:]
        tiles = rows.copy()
        tiles[:, 1:] |= rows[:, :-1]
        tiles[:, :-1] |= rows[:, 1:]
    return tiles


def _halved(tiles: np.ndarray) -> np.ndarray:
    """The tiles of the coarser grid that any of these lie in."""
    height, width = tiles.shape
    if height % 2 or width % 2:
        whole = np.zeros((height + height % 2, width + width % 2), bool)  # np.pad takes far longer
        whole[:height, :width] = tiles
        tiles = whole
    return (tiles[::2] | tiles[1::2]).view(np.uint16) != 0  # pairs of columns at once
