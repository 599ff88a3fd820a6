"""Diffusion on a GPU that stops at edges of the picture (compute.diffusion with a guide).

A grid cannot resolve edges that are finer than its cells. So one grid is solved by conjugate gradients, where each
iteration is a cycle over it and the coarser ones: the grid with the guide's cells, or the one after the pixels if those
are pixels. On finer grids conductances are smooth. Until the last cycle, full size is solved only near scribbles.
"""

from itertools import pairwise

import numpy as np

from ..core.pixels.conductances import cell_side, resistances
from .devices.device import Device, Given, Texture
from .devices.passes import read_pass
from .diffusion import NOTHING
from .diffusion_gpu import FINISH, Diffusion, _Grid, operators

# Iterations of conjugate gradients in each cycle, for at most as many cycles. Frames of films at 640 × 360 take four
# cycles, specks of single pixels about forty.
CYCLES = (4,) * 48
# Cycles end when all later ones would change every coefficient by less. Largest error × 255 over 40 pictures of specks
# and noise, for 1/512, 1/1024: 2.1, 0.65; after eight cycles: 27.
ENOUGH = 1 / 1024
# As many grids after that of the conjugate gradients are visited twice for each visit of the one before.
TWICE = 2
# If the guide's cells are larger than pixels: iterations of conjugate gradients in each cycle, first near scribbles,
# then everywhere. Largest error × 255 in frames of three films at 1920 × 1080: 0.6.
NEAR_CYCLES = (4, 2)
LAST_CYCLES = (1,)
# Sweeps over a grid before and after its correction; the same in cycles over smooth conductances.
SWEEPS, SMOOTH_SWEEPS = 2, 1
# Parts of a sum over all cells.
PARTS = 1024

_LINKS = read_pass("edge_diffusion", "LINKS")
_ADD = read_pass("diffusion", "PROLONG", IN_PLACE=1)
_MISSING = read_pass("multigrid", "MISSING", STENCIL=1)
_ZERO = read_pass("edge_diffusion", "ZERO")
_TURN = read_pass("edge_diffusion", "TURN")
_STEP = read_pass("edge_diffusion", "STEP")
_DOT = read_pass("edge_diffusion", "DOT")
_CHANGE = read_pass("edge_diffusion", "CHANGE")
_SUM = read_pass("edge_diffusion", "SUM")


class EdgeDiffusion(Diffusion):
    """Computes how much of each shutter a pixel gets, as shutters spread from strokes up to edges of the picture.

    It runs on a device. It differs from Diffusion by other passes for pixels, and by conjugate gradients on one grid.
    """

    finest = operators("LINKS")
    returns = True

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self._more: dict[str, Texture] = {}  # further textures of the last solve
        self._solved, self._sweeps, self._iterations = 0, 0, 0

    def solve(self, labels: np.ndarray, count: int, guide: np.ndarray, strength: float) -> Texture:  # type: ignore[override]  # it has a guide
        """Return how much of each shutter a pixel gets, as compute.diffusion.diffuse does with a guide, on the device.

        The result does not depend on earlier calls. If the guide has one cell per pixel, this reads back the largest
        change after each cycle, to end when it is small enough. If cells are larger, the number of cycles is fixed.

        Args:
            labels: (H, W), as for Diffusion.solve. At least one pixel must be drawn on, and one must be free.
            count: The number of shutters.
            guide, strength: As for compute.diffusion.diffuse.

        Returns:
            As for Diffusion.solve.
        """
        side = cell_side(guide.shape[:2], labels.shape)
        self._prepare(labels.shape, count)
        self._solved = min(max(1, side.bit_length() - 1), len(self._grids) - 1)
        self._sweeps = SWEEPS if side == 1 else SMOOTH_SWEEPS
        self._provide(guide.shape[:2])
        self._device.write(self._grids[0].textures["labels"], np.ascontiguousarray(labels, dtype=np.uint32))
        self._device.write(self._more["resistances"], resistances(guide, strength)[..., None])
        self._list_tiles(labels, 0 if side == 1 else self._solved, anew=True)
        placed: Given = {"guided": guide.shape[1::-1], "side": side, "resistances": self._more["resistances"]}
        self._run(_LINKS, self._grids[0], "anew", 64, **placed)
        self._start(0)
        self._coarsen()
        if side > 1:
            for self._iterations in NEAR_CYCLES:
                self._cycle(0)
            # The pixels far from scribbles get their values from the grid that was solved.
            for fine, coarse in reversed(list(pairwise(self._grids[: self._solved + 1]))):
                self._take_up(fine, coarse, "far")
            self._list_tiles(labels, 0)
        last = 0.0
        for iterations in CYCLES if side == 1 else LAST_CYCLES:
            self._visit(0, iterations)
            if side == 1:
                before, last = last, self._change()
                if _is_enough(last, before):
                    break
        self._run(FINISH, self._grids[0], "near", 64, nothing=NOTHING)
        return self._grids[0].textures["solution"]

    def _provide(self, cells: tuple[int, int]) -> None:
        """Make or reuse the textures that Diffusion does not have.

        They are the links of pixels, the resistances of the guide's cells, and the vectors and sums of the conjugate
        gradients. The vectors are cleared: passes skip tiles without free cells, but sums over all cells include them.

        Args:
            cells: The guide's (rows, columns).
        """
        grid, finest = self._grids[self._solved], self._grids[0]
        vectors = dict.fromkeys(("residual", "guess", "direction", "answer"), (*grid.size, grid.layers))
        sizes = vectors | {"sums": (4, 1, grid.layers), "parts": (PARTS, 1, grid.layers)}
        self._more = {name: self._textures.of(name, size, "rgba32f") for name, size in sizes.items()}
        self._more["resistances"] = self._textures.of("resistances", (cells[1], cells[0], 1), "r32f")
        for name in vectors:
            self._clear(grid, self._more[name])
        if "links" not in finest.textures:
            finest.textures["links"] = self._device.texture(*finest.size, 1, "rgba32f")

    def _correct(self, index: int) -> None:
        """Improve the solution of grid number `index`, with which the caller then corrects the next finer grid.

        One grid is improved by conjugate gradients (see the module), any finer one by a V-cycle.
        """
        if index == self._solved:
            self._conjugate_gradients(self._grids[index], self._iterations)
        else:
            self._cycle(index)

    def _conjugate_gradients(self, grid: _Grid, iterations: int) -> None:
        """Improve a grid's solution in place by conjugate gradients. Each iteration is preconditioned by `_visit`.

        Args:
            grid: The grid whose index is `_solved`.
            iterations: The number of iterations.
        """
        own, more = grid.textures, self._more
        solution, right = own["solution"], own["right"]
        self._run(_MISSING, grid, "near", 64, grid.layers, values=solution, result=more["residual"], amount=1.0)
        own["solution"], own["right"] = more["guess"], more["residual"]  # what the cycles solve
        try:
            for iteration in range(iterations):
                self._clear(grid, more["guess"])
                self._visit(self._solved, twice=TWICE)
                self._dot(grid, more["guess"], more["residual"], 0)
                turned = {"values": more["guess"], "sums": more["sums"], "result": more["direction"]}
                self._run(_TURN, grid, "near", 64, grid.layers, **turned, fresh=int(iteration == 0))
                asked = {"values": more["direction"], "result": more["answer"]}
                self._run(_MISSING, grid, "near", 64, grid.layers, **asked, amount=0.0)
                self._dot(grid, more["direction"], more["answer"], 2)
                stepped = {"solution": solution, "result": more["residual"], "sums": more["sums"]}
                self._run(
                    _STEP, grid, "near", 64, grid.layers, values=more["direction"], right=more["answer"], **stepped
                )
        finally:
            own["solution"], own["right"] = solution, right

    def _visit(self, index: int, iterations: int = 0, twice: int = 0) -> None:
        """Improve a grid's solution by a multigrid cycle over it and all coarser grids, in all tiles with free cells.

        Unlike Diffusion._cycle, it solves coarser grids for the correction of the whole solution, starting from 0.

        Args:
            index: The grid's number.
            iterations: How many iterations of conjugate gradients to do on the grid for which they are used, if that is
                coarser than this one.
            twice: How many of the next coarser grids are visited twice for each visit of the grid before.
        """
        grid, *coarser = self._grids[index : index + 2]
        if not coarser:
            self._solve_coarsest(grid)
            return
        self._smooth(grid, self._sweeps)
        self._restrict(grid, coarser[0], grid.textures["solution"])
        self._clear(coarser[0], coarser[0].textures["solution"])
        if index + 1 == self._solved:
            self._conjugate_gradients(coarser[0], iterations)
        else:
            for _ in range(2 if twice > 0 else 1):
                self._visit(index + 1, iterations, twice - 1)
        below = {"coarse": coarser[0].size, "coarser": coarser[0].textures["solution"]}
        self._run(_ADD, grid, "near", 16, grid.layers, **below, to=grid.textures["solution"], amount=1.0)
        self._smooth(grid, self._sweeps, back=True)

    def _clear(self, grid: _Grid, values: Texture) -> None:
        """Set all values of a texture of a grid's size to 0."""
        self._device.run(_ZERO, (*grid.size, grid.layers), images={"values": values}, size=grid.size)

    def _change(self) -> float:
        """Return the largest change of a coefficient since the last call or the start."""
        grid = self._grids[0]
        parts = min(PARTS, grid.size[0] * grid.size[1])
        own = {"values": grid.textures["solution"], "noted": grid.textures["own"]}
        images = {**own, "result": self._more["parts"]}
        self._device.run(_CHANGE, (parts, 1, grid.layers), images=images, size=(parts, 1), grid=grid.size)
        return self._device.read(self._more["parts"])[:, :, :parts].max()

    def _dot(self, grid: _Grid, one: Texture, other: Texture, place: int) -> None:
        """Compute the scalar product of two fields of a grid for each shutter, into the texture of sums at a place."""
        parts = min(PARTS, grid.size[0] * grid.size[1])
        images = {"values": one, "right": other, "result": self._more["parts"]}
        self._device.run(_DOT, (parts, 1, grid.layers), images=images, size=(parts, 1), grid=grid.size)
        images = {"result": self._more["parts"], "sums": self._more["sums"]}
        self._device.run(_SUM, (1, 1, grid.layers), images=images, parts=parts, place=place)


def _is_enough(change: float, before: float) -> bool:
    """Return whether cycles can end, since all later ones together would change no coefficient by ENOUGH or more.

    This assumes that changes go on shrinking at the same rate.

    Args:
        change: The largest change of a coefficient in the last cycle.
        before: The same for the cycle before; 0 if there was none.
    """
    return change == 0 or (change < before and change**2 < ENOUGH * (before - change))
