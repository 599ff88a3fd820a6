"""compute.diffusion along edges on a device, at full size near scribbles alone until the last cycle.

A grid knows little of what lies between edges that are finer than its cells. So one grid is solved by conjugate
gradients, each iteration a cycle over it and the coarser ones: that whose cells are the guide's, or the grid after the
pixels where these are pixels. On the grids before it conductances are smooth.
"""

from itertools import pairwise

import numpy as np

from ..core.pixels.conductances import cell_side, resistances
from ..devices.device import Device, Given, Texture
from ..devices.passes import read_pass
from .diffusion import NOTHING
from .diffusion_gpu import FINISH, Diffusion, _Grid, operators

# Cycles at most, and the iterations of conjugate gradients in each: frames of films at 640 × 360 take four cycles,
# specks of single pixels some forty.
CYCLES = (4,) * 48
# Cycles end where those to come would change no coefficient by as much. Largest error × 255 over 40 pictures of specks
# and noise, for 1/512, 1/1024: 2.1, 0.65; by eight cycles, whatever they change: 27.
ENOUGH = 1 / 1024
# So many grids after that of the conjugate gradients are visited twice for each visit of the one before.
TWICE = 2
# Where the guide's cells are larger than pixels: the iterations of conjugate gradients in each cycle, first of cycles
# near scribbles alone, then of those everywhere. Largest error × 255 in frames of three films at 1920 × 1080: 0.6.
NEAR_CYCLES = (4, 2)
LAST_CYCLES = (1,)
# Sweeps over a grid, before and after its correction; and in cycles over smooth conductances.
SWEEPS, SMOOTH_SWEEPS = 2, 1
NEAR_SWEEPS = 2  # over the pixels near scribbles
# Parts that a sum over all cells is made of.
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
    """compute.diffusion.diffuse along edges on a device; grids and passes are those of Diffusion, but for the
    pixels' own, and conjugate gradients on one of them."""

    finest = operators("LINKS")

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self._more: dict[str, Texture] = {}  # those of the last solve
        self._solved, self._sweeps = 0, 0

    def solve(self, labels: np.ndarray, count: int, guide: np.ndarray, strength: float) -> Texture:  # type: ignore[override]  # it has a guide
        """As Diffusion.solve; guide and strength as for compute.diffusion.diffuse. Some pixel has to be fixed, and some
        free. Where the guide's cells are pixels, a number is read back after each cycle: whether it was enough.

        The result does not depend on what was solved before."""
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
            self._cycles_near()
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
        """Makes the textures that plain diffusion has not. Those of conjugate gradients are zero: sums go over all of
        them, and passes leave out tiles where nothing is free."""
        grid, finest = self._grids[self._solved], self._grids[0]
        vectors = dict.fromkeys(("residual", "guess", "direction", "answer"), (*grid.size, grid.layers))
        sizes = vectors | {"sums": (4, 1, grid.layers), "parts": (PARTS, 1, grid.layers)}
        self._more = {name: self._textures.of(name, size, "rgba32f") for name, size in sizes.items()}
        self._more["resistances"] = self._textures.of("resistances", (cells[1], cells[0], 1), "r32f")
        for name in vectors:
            self._clear(grid, self._more[name])
        if "links" not in finest.textures:
            finest.textures["links"] = self._device.texture(*finest.size, 1, "rgba32f")

    def _cycles_near(self) -> None:
        """Cycles near scribbles alone; then the pixels far from them get their values from the grid that was solved."""
        for iterations in NEAR_CYCLES:
            self._near_cycle(0, iterations)
        for fine, coarse in reversed(list(pairwise(self._grids[: self._solved + 1]))):
            self._take_up(fine, coarse, "far")

    def _near_cycle(self, index: int, iterations: int) -> None:
        """A V-cycle near scribbles, over the grids from this one to that of the conjugate gradients."""
        grid = self._grids[index]
        if index == self._solved:
            self._conjugate_gradients(grid, iterations)
            return
        sweeps = NEAR_SWEEPS if grid.finest else SMOOTH_SWEEPS
        coarse = self._grids[index + 1]
        self._smooth(grid, sweeps)
        self._hand_down(grid, coarse)
        self._near_cycle(index + 1, iterations)
        self._take_up(grid, coarse, "reached")
        self._smooth(grid, sweeps, back=True)

    def _conjugate_gradients(self, grid: _Grid, iterations: int) -> None:
        """They go on from the grid's solution."""
        own, more = grid.textures, self._more
        solution, right = own["solution"], own["right"]
        self._run(_MISSING, grid, "near", 64, grid.layers, values=solution, result=more["residual"], amount=1.0)
        own["solution"], own["right"] = more["guess"], more["residual"]  # for the cycles
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
        """A cycle over the grids from this one on: it improves the grid's solution.

        iterations: of conjugate gradients, if one of the coarser grids is that which they solve
        twice: how many of the next grids are visited twice
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
        self._device.run(_ZERO, (*grid.size, grid.layers), images={"values": values}, size=grid.size)

    def _change(self) -> float:
        """By how much the coefficients have changed at most, since the last call or the start."""
        grid = self._grids[0]
        parts = min(PARTS, grid.size[0] * grid.size[1])
        own = {"values": grid.textures["solution"], "noted": grid.textures["own"]}
        images = {**own, "result": self._more["parts"]}
        self._device.run(_CHANGE, (parts, 1, grid.layers), images=images, size=(parts, 1), grid=grid.size)
        return self._device.read(self._more["parts"])[:, :, :parts].max()

    def _dot(self, grid: _Grid, one: Texture, other: Texture, place: int) -> None:
        parts = min(PARTS, grid.size[0] * grid.size[1])
        images = {"values": one, "right": other, "result": self._more["parts"]}
        self._device.run(_DOT, (parts, 1, grid.layers), images=images, size=(parts, 1), grid=grid.size)
        images = {"result": self._more["parts"], "sums": self._more["sums"]}
        self._device.run(_SUM, (1, 1, grid.layers), images=images, parts=parts, place=place)


def _is_enough(change: float, before: float) -> bool:
    """Whether cycles can end, by how much the last one and the one before it have changed coefficients at most; 0 where
    there was none. Changes are taken to go on shrinking as they did: there are pictures where they hardly do."""
    return change == 0 or (change < before and change**2 < ENOUGH * (before - change))
