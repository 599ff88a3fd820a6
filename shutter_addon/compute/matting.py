"""Mattes laid over coefficients on a device (core.model.mattes.blended)."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np

from ..core.model.mattes import Matte
from ..devices.device import Device, Texture
from ..devices.named_textures import NamedTextures
from ..devices.passes import Pass, read_pass

# Mattes that one pass lays, whose values are on the device at once.
MOST = 8


def blend_pass(count: int, adds: bool) -> Pass:
    """Lays so many mattes; adds: any by the blend "add"."""
    return read_pass("matte_blend", COUNT=count, ADDS=int(adds), MOST=MOST)


class Matting:
    """Lays mattes over coefficients. Values that it was given last stay on the device."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._textures = NamedTextures(device)
        self._values: Texture | None = None
        self._held: dict[int, Hashable] = {}  # by layer of that: the key of the values in it

    def lay(
        self, beneath: Texture, mattes: tuple[Matte, ...], layers: Sequence[tuple[Hashable, np.ndarray]]
    ) -> Texture:
        """Coefficients, a texture array rgba32f like a solver's, valid until the next call.

        beneath: coefficients, a texture of a solver or of GPUCompositor.constant
        layers: of each matte a key, and its values (h, w) float32 (core.model.mattes.MatteReader.values)"""
        height, width = layers[0][1].shape
        values = self._textures.of("values", (width, height, min(len(mattes), MOST)), "r32f")
        if values is not self._values:
            self._values, self._held = values, {}
        ends = ["even", "odd"]
        laid = list(zip(mattes, layers, strict=True))
        for start in range(0, len(laid), MOST):
            some = laid[start : start + MOST]
            table = np.zeros((MOST, 4), np.float32)
            for layer, (matte, (key, array)) in enumerate(some):
                table[layer, :3] = matte.shutter, matte.blend == "add", matte.opacity
                if self._held.get(layer) != key:
                    self._device.write(values, np.ascontiguousarray(array[..., None]), layer)
                    self._held[layer] = key
            over = self._textures.of(ends[0], (width, height, beneath.size[2]), "rgba32f")
            self._device.run(
                blend_pass(len(some), any(matte.blend == "add" for matte, _ in some)),
                over.size,
                images={"under": beneath, "values": values, "over": over},
                blocks={"table": table},
                size=(width, height),
                beneath=beneath.size[:2],
            )
            beneath, ends = over, ends[::-1]
        return beneath

    def release(self) -> None:
        self._textures.release()
        self._values = None
