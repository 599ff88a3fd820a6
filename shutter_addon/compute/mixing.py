"""Shares of coefficients, added up on a device: where scribbles are not quite opaque (core.model.scribbles.layers)."""

from __future__ import annotations

from ..devices.device import Device, Texture
from ..devices.passes import Pass, read_pass


def mix_pass(begins: bool) -> Pass:
    """Adds a share to a sum, or begins one."""
    return read_pass("mix", BEGINS=int(begins))


class Mixing:
    """A sum of shares of coefficients."""

    def __init__(self, device: Device):
        self._device = device
        self._sum: Texture | None = None

    def add(self, mixed: Texture | None, added: Texture, share: float, size: tuple[int, int]) -> Texture:
        """The sum with one more share, a texture array rgba32f like a solver's, valid until the next sum is begun.

        mixed: what was returned last; None: this begins a sum
        added: coefficients, a texture of a solver or of GPUCompositor.constant; size: (h, w) of the sum"""
        height, width = size
        if self._sum is None or (mixed is None and self._sum.size != (width, height, added.size[2])):
            self.release()
            self._sum = self._device.texture(width, height, added.size[2], "rgba32f")
        self._device.run(
            mix_pass(mixed is None),
            self._sum.size,
            images={"added": added, "mixed": self._sum},
            size=(width, height),
            given=added.size[:2],
            share=share,
        )
        return self._sum

    def release(self) -> None:
        if self._sum is not None:
            self._sum.release()
            self._sum = None
