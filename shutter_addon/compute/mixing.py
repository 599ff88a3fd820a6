"""Shares of coefficients, added up on a device: where scribbles are not quite opaque (core.model.scribbles.layers)."""

from __future__ import annotations

from ..devices.device import Device, Texture
from ..devices.named_textures import NamedTextures
from ..devices.passes import Pass, read_pass


def mix_pass(begins: bool) -> Pass:
    """Adds a share to a sum, or begins one."""
    return read_pass("mix", BEGINS=int(begins))


class Mixing:
    """A sum of shares of coefficients."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._textures = NamedTextures(device)

    def add(self, mixed: Texture | None, added: Texture, share: float, size: tuple[int, int]) -> Texture:
        """The sum with one more share, a texture array rgba32f like a solver's, valid until the next sum is begun.

        mixed: what was returned last; None: this begins a sum
        added: coefficients, a texture of a solver or of GPUCompositor.constant; size: (h, w) of the sum"""
        height, width = size
        size_of_sum = (width, height, added.size[2]) if mixed is None else mixed.size
        mixed_now = self._textures.of("sum", size_of_sum, "rgba32f")
        self._device.run(
            mix_pass(mixed is None),
            size_of_sum,
            images={"added": added, "mixed": mixed_now},
            size=(width, height),
            given=added.size[:2],
            share=share,
        )
        return mixed_now

    def release(self) -> None:
        self._textures.release()
