"""Diffusion on a GPU: the same coefficients as compute.diffusion, solved for at full size only near scribbles.

The method is multigrid. The cells of grid 0 are the pixels; those of a coarser grid lie on the even cells of the finer
one. Far from scribbles the solution is smooth, so a grid solves only tiles near scribbles (BAND). Elsewhere its values
are interpolated linearly from the next coarser grid.

For one grid, let U be its values, f its right-hand side, A its operator, P the prolongation from the next coarser grid
and U' the values of that grid. The grid's own part W = U − P U' is zero outside its tiles. The next grid has the
right-hand side Pᵀ(f − A W) and the Galerkin operator PᵀAP, a stencil of nine points. P follows the operator, as in
Dendy's black box multigrid: fixed pixels are walls on every grid, so the number of cycles needed does not depend on the
scene.

A solve that starts from nothing depends only on the labels, to the bit. For that, operators are made again where
scribbles are or were in the last solve, and W and f are cleared there and outside the tiles.
"""

from itertools import pairwise
from typing import Any

import numpy as np

from .devices.device import Device, Given, NamedTextures, Texture
from .devices.passes import Pass, read_pass
from .diffusion import NOTHING

# V-cycles of a solve that starts from nothing. Largest error × 255 after 1, 2, 3, 4 cycles: 3.9, 0.67, 0.66, 0.66 over
# the scenes of the tests (median 2.1, 0.13, 0.07, 0.07), and 11, 1.6, 0.25, 0.24 over their lattices of dots. The error
# that remains is that of linear interpolation far from scribbles.
CYCLES = 3
# V-cycles of a solve that starts from the last solution. One leaves an error × 255 of 0.66 if scribbles moved by 3 of
# 1920 pixels. Two leave that for any move, and take twice as long.
WARM_CYCLES = 1
# Smoothing sweeps over a grid before and after its correction by coarser grids. Full size has two, because all of the
# error of a moved scribble is there.
SWEEPS = 1
FINEST_SWEEPS = 2
# Cells (x, y) of 2 × 2 in the order of a sweep.
COLOURS = ((0, 0), (1, 1), (1, 0), (0, 1))
# A grid with at most this many cells along its longer side is solved everywhere. The finest such grid is visited twice
# in a cycle.
WHOLE = 128
# A grid with at most this many cells along its longer side is the coarsest, which one invocation solves.
SOLVED = 8
# A larger grid than WHOLE is solved in tiles with a scribble, and in this many tiles on each side of those. With two,
# the error × 255 falls from 0.66 to 0.19, and a solve takes 1.7 times as long.
BAND = 1
# How much fixed cells beside the line between two coarse cells keep a cell on that line from following the two, 0 … 1.
HOLD = 0.3


def operators(ties: str) -> dict[str, Pass]:
    """Return the passes of shaders/multigrid.glsl for one way in which cells are coupled.

    Args:
        ties: How neighboring cells are coupled: "STENCIL" by nine-point operators (coarser grids), "LABELS" free
            pixels equally to all their neighbors, "LINKS" by conductances between pixels that are small at edges.

    Returns:
        {name: pass}. "weights" computes the prolongation P, "coarsen" the operator PᵀAP of the next coarser grid,
        "smooth" does a part of a Gauss-Seidel sweep, and "restrict" makes the next coarser grid's right-hand side.
    """
    return {
        name: read_pass("multigrid", name.upper(), **{ties: 1}) for name in ("weights", "coarsen", "smooth", "restrict")
    }


_START = read_pass("diffusion", "START")
_CLEAR = read_pass("diffusion", "CLEAR")
_COARSER = operators("STENCIL")
_PROLONG = read_pass("diffusion", "PROLONG", IN_PLACE=0)
_SOLVE = read_pass("coarsest", SOLVED=SOLVED)
FINISH = read_pass("diffusion", "FINISH")
_EXPAND = read_pass("diffusion", "EXPAND")
_EXPAND_RIM = read_pass("diffusion", "EXPAND_RIM")


# The lists of tiles for passes, as ranges of the lists that _list_tiles makes.
_RANGES = {"near": (0, 1), "reached": (0, 2), "far": (1, 3), "rim": (3, 4)}
_RANGES |= {"anew": (4, 5), "feeding": (5, 6), "changed": (6, 7)}


class _Grid:
    """One grid of the multigrid: its textures, and the tiles that passes go through. For U, W, f, A, P see the module.

    Attributes:
        size: (width, height) in cells.
        layers: Layers of four shutters.
        finest: Whether its cells are pixels.
        textures: {name: texture}, rgba32f but for the labels:
            solution, own, right: U, W and f, four shutters per layer; the finest grid has no f
            stencil: the operator A; instead, the finest grid has "labels" (r32ui), and in EdgeDiffusion "links"
            weights: P, how much each cell takes of the four coarse cells around it
        reached: Of the last solve, bool (rows, columns): tiles of 8 × 8 cells within BAND tiles of a scribble; all
            tiles of a grid that is solved everywhere.
        touched: Likewise, tiles of 4 × 4 cells with a scribble in or beside them.
        solid: Likewise, tiles of 4 × 4 cells without a free cell in them or near them.
        codes: For all tiles of 8 × 8 and of 4 × 4 cells, the numbers by which shaders know them (_codes).
        ranges: {list: (first, last)}: where each list of tiles lies in the texture that has the lists of all grids.
            Tiles have 8 × 8 cells, except those of the last two lists:
            near: tiles that this grid solves: of the tiles in the attribute `reached`, those with free cells, on
                coarser grids also those beside such
            reached: near tiles and those around them, where W still has an effect
            far: tiles like near ones, but not in the attribute `reached`; their values come from the next grid
            rim: tiles that are not near, at the ends of rows or columns that go beyond the next grid's last cells
            anew: tiles that _start has to set: those that this or the last solve reached, those around near ones, and
                at full size those without free cells
            feeding: near tiles and those around them, as tiles of 4 × 4 cells of the next grid
            changed: tiles of 4 × 4 cells whose operator may differ from that of the last solve
    """

    def __init__(self, device: Device, width: int, height: int, layers: int, finest: bool) -> None:
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
            self.textures["labels"] = device.texture(width, height, 1, "r32ui")
        else:
            self.textures["right"] = device.texture(width, height, layers, "rgba32f")
            self.textures["stencil"] = device.texture(width, height, 3, "rgba32f")


class Diffusion:
    """Computes on a device how much of each shutter a pixel gets, as shutters spread from drawn strokes.

    Its textures are reused until the size or the number of shutters changes.

    Attributes:
        finest: The passes for the finest grid, whose cells are pixels (`operators`).
        returns: Whether smoothing after a coarse correction visits the colors in reverse order.
    """

    finest = operators("LABELS")  # the passes over pixels
    returns = False  # whether sweeps after a correction go backward
    _tiles: Texture  # the lists of tiles of all grids

    def __init__(self, device: Device) -> None:
        self._device = device
        self._grids: list[_Grid] = []
        self._made_for: tuple[int, int, int] | None = None
        self._textures = NamedTextures(device)

    def solve(self, labels: np.ndarray, count: int, *, warm: bool = False) -> Texture:
        """Return how much of each shutter a pixel gets, like compute.diffusion.diffuse without a guide, on the device.

        Args:
            labels: (H, W) uint16: 0 where a pixel is free, 1 + shutter where that shutter is drawn.
            count: The number of shutters.
            warm: Start from the solution of the last call, if it was finished and had this size and count. This is
                faster, for scribbles that have moved a little. The result then depends on the last solution, within the
                error.

        Returns:
            A texture array rgba32f, top row first: shutter i in layer i // 4 and channel i % 4. The next call
            overwrites it.
        """
        warm = self._prepare(labels.shape, count) and warm
        finest, made_for = self._grids[0], self._made_for
        self._made_for = None  # if this solve is interrupted, the next one must start again
        self._device.write(finest.textures["labels"], np.ascontiguousarray(labels, dtype=np.uint32))
        self._list_tiles(labels, next(k for k, grid in enumerate(self._grids) if max(grid.size) <= WHOLE))
        self._start(int(warm))
        self._coarsen()
        for _ in range(WARM_CYCLES if warm else CYCLES):
            self._cycle(0)
        self._finish()
        self._made_for = made_for
        return finest.textures["solution"]

    def release(self) -> None:
        """Free all textures. Call it inside `Device.current` or `Device.freeing`."""
        for grid in self._grids:
            for texture in grid.textures.values():
                texture.release()
        self._textures.release()
        self._grids, self._made_for = [], None

    def _prepare(self, shape: tuple[int, ...], count: int) -> bool:
        """Make new grids for a size and a number of shutters, unless the present ones were made for the same.

        Args:
            shape: The picture's (H, W).
            count: The number of shutters.

        Returns:
            True if the grids are kept, with the last solution; False if they are new (also after an interrupted
            Diffusion.solve).
        """
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
        self._tiles = self._textures.of("tiles", (256, -(-tiles // 256), 1), "r32f")
        return False

    def _list_tiles(self, labels: np.ndarray, whole: int, *, anew: bool = False) -> None:
        """List the tiles that each pass has to go through, and send the lists to the device.

        This sets `ranges`, `reached`, `touched` and `solid` of all grids (_Grid).

        Args:
            labels: (H, W), as for `solve`.
            whole: The index of the finest grid that is solved in all tiles, as are all coarser ones. Finer grids are
                solved near scribbles.
            anew: Whether all tiles have to be set and all operators made again, regardless of the last solve.
        """
        held, free = _in_fours(labels != 0)
        listed, end = [], 0
        for index, grid in enumerate(self._grids):
            touched = _grown(held)
            solid = ~_grown(free, 1 if grid.finest else 2)
            changed = np.ones_like(touched) if anew else (touched | grid.touched) & ~(solid & grid.solid)
            held, free = _halved(held), _halved(free)
            # A coarse cell inside a scribble may have a value, for the free cells beside the scribble.
            live = free if grid.finest else _grown(free)
            reached = _grown(held, BAND) if index < whole else np.ones_like(held)
            near = reached & live
            feeding = _grown(near)
            around = feeding & live
            stale = np.ones_like(live) if anew else (reached | grid.reached) & _grown(live)
            # Passes read W in the tiles around near ones, so it must be 0 there. At full size, fixed tiles must have
            # the values of their labels.
            unsolved = stale | around | ~live if grid.finest else stale | around
            rim = ~near & live & _last_ones(grid)
            eights, fours = grid.codes
            lists = [eights[tiles] for tiles in (near, around & ~near, live & ~around, rim, unsolved)]
            lists += [eights[feeding] / 2, fours[changed]]  # a tile is four cells wide on the next grid
            ends = (end + np.cumsum([0, *map(len, lists)])).tolist()
            grid.ranges = {name: (ends[first], ends[last]) for name, (first, last) in _RANGES.items()}
            listed += lists
            end = ends[-1]
            grid.touched, grid.solid, grid.reached = touched, solid, reached
        rows = np.zeros((-(-end // 256), 256, 1), np.float32)
        rows.reshape(-1)[:end] = np.concatenate(listed)
        self._device.write(self._tiles, rows)

    def _start(self, warm: int) -> None:
        """Set the values from which the solve starts in all grids, and clear W and f where the last solve left any.

        Fixed pixels get the coefficients of their labels in any case.

        Args:
            warm: 1: free pixels keep the last solution, and coarser grids take it over. 0: both start from 0.
        """
        finest = self._grids[0]
        self._run(_START, finest, "anew", 64, finest.layers, warm=warm)
        for fine, grid in pairwise(self._grids):
            self._run(_CLEAR, grid, "anew", 64, grid.layers, finer=fine.textures["solution"], warm=warm)

    def _coarsen(self) -> None:
        """Make each grid's prolongation P, and from it the operator of the next coarser grid."""
        for fine, coarse in pairwise(self._grids):
            weights, coarsen = (self._pass(fine, name) for name in ("weights", "coarsen"))
            self._run(weights, fine, "changed", 8, hold=HOLD)
            to: Given = {"size": fine.size, "coarse": coarse.size, "next": coarse.textures["stencil"]}
            to |= fine.textures
            self._run(coarsen, coarse, "changed", 16, **to)

    def _cycle(self, index: int) -> None:
        """Improve the solution of grid number `index` by a multigrid V-cycle over this grid and all coarser ones."""
        grid, *coarser = self._grids[index : index + 2]
        if not coarser:
            self._solve_coarsest(grid)
            return
        sweeps = FINEST_SWEEPS if grid.finest else SWEEPS
        self._smooth(grid, sweeps)
        images = {"from": grid.textures["solution"], "to": grid.textures["own"]}
        self._prolong(grid, coarser[0], "near", images, -1.0)  # W from U
        self._restrict(grid, coarser[0], grid.textures["own"])
        self._correct(index + 1)
        self._take_up(grid, coarser[0], "reached")
        self._smooth(grid, sweeps, back=self.returns)

    def _correct(self, index: int) -> None:
        """Improve the solution of grid number `index`, which corrects the next finer grid, by one or two V-cycles."""
        finer, grid = self._grids[index - 1 : index + 1]
        first_whole = max(grid.size) <= WHOLE and (finer.finest or max(finer.size) > WHOLE)
        for _ in range(1 + first_whole):
            self._cycle(index)

    def _solve_coarsest(self, grid: _Grid) -> None:
        """Solve the equations of the coarsest grid exactly."""
        self._run(_SOLVE, grid, "near", 1, grid.layers)  # it has one tile

    def _take_up(self, grid: _Grid, coarse: _Grid, tiles: str) -> None:
        """Set a grid's values U to W + P U', where U' are those of the next coarser grid. `tiles`: as for `_run`."""
        self._prolong(grid, coarse, tiles, {"from": grid.textures["own"], "to": grid.textures["solution"]}, 1.0)

    def _prolong(self, grid: _Grid, coarse: _Grid, tiles: str, images: dict[str, Texture], amount: float) -> None:
        """Compute to = from + amount · P U', where U' is the solution of the next coarser grid and P the interpolation.

        Args:
            grid: The grid with the two images.
            coarse: The next coarser grid.
            tiles: The tiles of `grid` to compute, as for `_run`.
            images: {"from": texture, "to": texture}.
            amount: The factor of the interpolated solution.
        """
        coarser = {"coarse": coarse.size, "coarser": coarse.textures["solution"]}
        self._run(_PROLONG, grid, tiles, 16, grid.layers, **coarser, **images, amount=amount)

    def _restrict(self, grid: _Grid, coarse: _Grid, own: Texture) -> None:
        """Set the right-hand side of the next coarser grid to Pᵀ(f − A · own), from the residual of a grid's values.

        Args:
            grid: The grid, with f, A and P.
            coarse: The next coarser grid.
            own: The texture with the values: W, or all of U.
        """
        to = {"coarse": coarse.size, "next": coarse.textures["right"]}
        self._run(self._pass(grid, "restrict"), grid, "feeding", 16, grid.layers, own=own, **to)

    def _smooth(self, grid: _Grid, sweeps: int, *, back: bool = False) -> None:
        """Run Gauss-Seidel sweeps over a grid's near tiles, which reduce the fine-scale error of its solution.

        Cells are updated one color after another: in two colors like a chessboard at full size, where a cell has four
        neighbors, else in four colors, for eight neighbors.

        Args:
            sweeps: The number of sweeps.
            back: Whether the colors come in reverse order.
        """
        cells: int = 32
        colours: list[int | tuple[int, int]] = [0, 1]
        if not grid.finest:
            cells, colours = 16, [(x, y) for x, y in COLOURS if x < grid.size[0] and y < grid.size[1]]
        values = grid.textures["solution"]
        for colour in (colours[::-1] if back else colours) * sweeps:
            self._run(self._pass(grid, "smooth"), grid, "near", cells, grid.layers, values=values, colour=colour)

    def _pass(self, grid: _Grid, name: str) -> Pass:
        """Return a pass from `operators` in the variant for a grid: `finest` for pixels, "STENCIL" for coarser grids.

        Args:
            name: A key of what `operators` returns, such as "smooth".
        """
        return self.finest[name] if grid.finest else _COARSER[name]

    def _finish(self) -> None:
        """Turn the solution into coefficients ≥ 0 with a sum of 1 in all cells, the coarsest grid first."""
        for index, grid in reversed(list(enumerate(self._grids))):
            self._run(FINISH, grid, "near", 64, nothing=NOTHING)
            if index + 1 < len(self._grids):
                coarse = self._grids[index + 1]
                below: Given = {"coarse": coarse.size, "coarser": coarse.textures["solution"]}
                self._run(_EXPAND, grid, "far", 16, grid.layers, **below)
                sizes = zip(self._grids[0].size, grid.size, strict=True)
                # How far the picture's edge lies beyond the centers of the grid's last cells, in cells.
                margins = [(pixels - 0.5) / 2**index - (cells - 1) for pixels, cells in sizes]
                beyond = tuple(-(2 * margin + 1) / (4 * margin + 8) for margin in margins)
                self._run(_EXPAND_RIM, grid, "rim", 16, **below, beyond=beyond)

    def _run(self, program: Pass, grid: _Grid, tiles: str, cells: int, layers: int = 1, **extra: Any) -> None:
        """Run a pass over a list of a grid's tiles. Do nothing if the list is empty.

        Args:
            program: The pass. It gets the grid's textures and sizes by name, as far as it has them.
            tiles: The name of the list, a key of _Grid.ranges.
            cells: Invocations for each tile; for the pass "weights", for two tiles.
            layers: The number of layers (of four shutters) to run it on.
            extra: Further textures and constants of the pass, by name. They replace those of the grid.
        """
        first, last = grid.ranges[tiles]
        if first == last:
            return
        own = {"size": grid.size, "layers": grid.layers, "first": first, "last": last, "tiles": self._tiles}
        given = {**own, **grid.textures, **extra}
        # These passes have four invocations for each tile, so two tiles fill a row of eight.
        rows = -(-(last - first) // 2) if program.step == "WEIGHTS" else last - first
        self._device.run(
            program,
            (cells, rows, layers),
            textures={name: given[name] for name in program.samplers},
            images={name: given[name] for name in program.images},
            **{name: given[name] for name in program.constants},
        )


def _in_fours(fixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which tiles of 4 × 4 cells contain a fixed cell, and which a free one: two arrays bool (⌈H/4⌉, ⌈W/4⌉).

    Args:
        fixed: (H, W) bool: which cells are fixed. Incomplete tiles at the edges are filled with the last row and
            column.
    """
    height, width = fixed.shape
    if height % 4 or width % 4:
        fixed = np.pad(fixed, ((0, -height % 4), (0, -width % 4)), mode="edge")
    fours = np.ascontiguousarray(fixed).view(np.uint32)  # four bools, a row of a tile, as one number
    any_of = fours[0::4] | fours[1::4] | fours[2::4] | fours[3::4]
    all_of = fours[0::4] & fours[1::4] & fours[2::4] & fours[3::4]
    return any_of != 0, all_of != 0x01010101


def _codes(rows: int, columns: int, fours: int) -> np.ndarray:
    """Return the numbers by which shaders know tiles: x + 4096 · y for the first cell (x, y), in units of four cells.

    Args:
        rows, columns: The number of tiles down and across.
        fours: A tile's side in units of four cells: 2 or 1.

    Returns:
        (rows, columns) float32.
    """
    return (fours * (np.arange(columns) + 4096 * np.arange(rows)[:, None])).astype(np.float32)


def _last_ones(grid: _Grid) -> np.ndarray:
    """Return which tiles contain cells that lie beyond the last cells of the next coarser grid, bool (rows, columns).

    Coarse cells lie on the even cells. So these are the last column of tiles if the grid's width in cells is even, and
    the last row if its height is even.
    """
    width, height = grid.size
    last = np.zeros_like(grid.reached)
    last[:, -1] = width % 2 == 0
    last[-1] |= height % 2 == 0
    return last


def _grown(tiles: np.ndarray, times: int = 1) -> np.ndarray:
    """Return which tiles (rows, columns) are set in `tiles`, or within `times` tiles of a set one, also diagonally."""
    for _ in range(times):
        rows = tiles.copy()
        rows[1:] |= tiles[:-1]
        rows[:-1] |= tiles[1:]
        tiles = rows.copy()
        tiles[:, 1:] |= rows[:, :-1]
        tiles[:, :-1] |= rows[:, 1:]
    return tiles


def _halved(tiles: np.ndarray) -> np.ndarray:
    """Return tiles (rows, columns) bool at half the size: True if any of 2 × 2 tiles is."""
    height, width = tiles.shape
    if height % 2 or width % 2:
        whole = np.zeros((height + height % 2, width + width % 2), bool)  # np.pad is far slower
        whole[:height, :width] = tiles
        tiles = whole
    return (tiles[::2] | tiles[1::2]).view(np.uint16) != 0  # two bools, a pair of columns, as one number
