"""The stages of a picture on a device besides its composition: make coefficients, and lay layers over one another.

Coefficients are diffused from strokes, added up, and covered by mattes.
"""

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from ..core.model.mattes import Matte
from .composition_passes import padded
from .devices.device import Device, Given, NamedTextures, Texture
from .devices.passes import read_pass
from .diffusion_gpu import Diffusion
from .edge_diffusion_gpu import EdgeDiffusion
from .request import Behind, Exposure

# The most mattes of one pass.
MOST_MATTES = 8
# The side of a block of shaders/layer.glsl (LEAST), in pixels.
BLOCK = 16
LEAST = read_pass("layer", "LEAST")


class GPUStages:
    """Makes coefficients, and lays layers over one another, on a device (request.Stages)."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._textures = NamedTextures(device)
        self._plain, self._edged = Diffusion(device), EdgeDiffusion(device)
        self._mattes: Texture | None = None
        self._held: dict[int, Hashable] = {}  # {layer of _mattes: key of the values in it}

    def solve(self, labels: np.ndarray, count: int, *guided: Any, warm: bool = False) -> Texture:
        """Spread shutters from labels to all pixels (request.Stages.solve), with one of two solvers.

        EdgeDiffusion stops at edges of a guide, Diffusion has no guide. The solver that is not used now frees its
        memory.

        Args:
            labels: (h, w) uint16: 0 where nothing is drawn, 1 + index of the shutter that is drawn.
            count: The number of shutters.
            guided: The guide and the strength, as in request.Stages.solve, or nothing. They are ignored if nothing is
                drawn, or all pixels are drawn on: then nothing spreads.
            warm: Whether to start from the last result (Diffusion.solve). It has no effect with a guide.

        Returns:
            How much of each shutter a pixel gets: a texture array, as from Diffusion.solve.
        """
        if guided and 0 < np.count_nonzero(labels) < labels.size:  # else nothing is diffused
            self._plain.release()
            return self._edged.solve(labels, count, *guided)
        self._edged.release()
        return self._plain.solve(labels, count, warm=warm)

    def upload(self, values: np.ndarray) -> Texture:
        """Send coefficients (N, h, w), or (N, 1, 1) for the whole picture, to the device: return them as a texture."""
        name = "constant" if values.shape[1:] == (1, 1) else "uploaded"
        fours = np.moveaxis(padded(np.moveaxis(values, 0, -1)), 2, 0)  # layers (⌈N/4⌉, h, w, 4)
        return self._textures.filled(name, fours.astype(np.float32))

    def add(self, mixed: Texture | None, added: Texture, share: float, size: tuple[int, int]) -> Texture:
        """Add a share of some coefficients to the sum so far, and return the new sum (request.Stages.add)."""
        height, width = size
        result = self._textures.of("sum", (width, height, added.size[2]), "rgba32f")
        whole = self._textures.filled("share", [np.full((1, 1, 1), share, np.float32)], "r32f")
        images = {"part": added, "share": whole, "mixed": result}
        given: Given = {"size": (width, height), "given": added.size[:2], "block_bits": max(size).bit_length()}
        program = read_pass("ways", BEGINS=int(mixed is None), LEVELS=0)
        self._device.run(program, result.size, images=images, **given)
        return result

    def blend(
        self, beneath: Texture, mattes: tuple[Matte, ...], layers: Sequence[tuple[Hashable, np.ndarray]]
    ) -> Texture:
        """Lay mattes over coefficients, and return the new coefficients as a texture array. See request.Stages.blend.

        The device keeps the values of up to MOST_MATTES mattes. Those that it still has, by their keys, are not sent
        again. With more mattes, later ones replace the values of earlier ones.
        """
        height, width = layers[0][1].shape
        values = self._textures.of("mattes", (width, height, min(len(mattes), MOST_MATTES)), "r32f")
        if values is not self._mattes:
            self._mattes, self._held = values, {}
        ends = ["even", "odd"]
        laid = list(zip(mattes, layers, strict=True))
        for start in range(0, len(laid), MOST_MATTES):
            some = laid[start : start + MOST_MATTES]
            table = np.zeros((MOST_MATTES, 4), np.float32)
            for layer, (matte, (key, array)) in enumerate(some):
                table[layer, :3] = matte.shutter, matte.blend == "add", matte.opacity
                if self._held.get(layer) != key:
                    self._device.write(values, np.ascontiguousarray(array[..., None]), layer)
                    self._held[layer] = key
            over = self._textures.of(ends[0], (width, height, beneath.size[2]), "rgba32f")
            self._device.run(
                read_pass("matte_blend", COUNT=len(some), MOST=MOST_MATTES),
                over.size,
                images={"under": beneath, "values": values, "over": over},
                blocks={"table": table},
                size=(width, height),
                beneath=beneath.size[:2],
            )
            beneath, ends = over, ends[::-1]
        return beneath

    def least_share(self, exposed: Exposure) -> float:
        """Return the lowest alpha of exposed.share (request.Stages.least_share). The device finds it for each block."""
        width, height, _ = exposed.share.size
        least = self._textures.of("least", (-(-width // BLOCK), -(-height // BLOCK), 1), "r32f")
        images = {"clear": exposed.share, "least": least}
        self._device.run(LEAST, least.size[:2], images=images, size=least.size[:2], whole=(width, height))
        return self._device.read(least).min()

    def lay(self, behind: Behind, layers: Sequence[Exposure], levels: bool) -> Texture:
        """Return the picture of layers laid over the background (request.Stages.lay), a pass for each layer."""
        under, plate = behind.exposed.color, None
        size = width, height = under.size[:2]
        if behind.plate is not None:
            plate = self._textures.filled("plate", [behind.plate[::-1].astype(np.float32, copy=False)])
        for k, layer in enumerate(layers):
            ends = k == len(layers) - 1
            name = ("levels" if levels else "picture") if ends else f"part {k % 2}"
            picture = self._textures.of(name, (width, height, 1), "rgba8" if levels and ends else "rgba32f")
            program = read_pass(
                "layer",
                BEGINS=int(not k),
                ENDS=int(ends),
                OPAQUE=int(layer.color is layer.share),
                PLAIN=int(not k and behind.plain is not None),
                PLATE=int(not k and plate is not None),
                LEVELS=int(levels and ends),
            )
            textures = {"share": layer.share, "clear": behind.exposed.share, "plain": behind.plain, "plate": plate}
            images = {"under": under, "exposed": layer.color, "picture": picture}
            self._device.run(program, size, textures=textures, images=images, size=size, height=height)
            under = picture
        return under

    def release(self) -> None:
        """Free all memory on the device. Call it inside `Device.current` or `Device.freeing`."""
        self._plain.release()
        self._edged.release()
        self._textures.release()
        self._mattes = None
