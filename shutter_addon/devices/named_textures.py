"""Textures that are kept from picture to picture, by name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .device import Device, Texture


class NamedTextures:
    """Textures of a device, each made anew where another size is asked for."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._kept: dict[str, Texture] = {}

    def of(self, name: str, size: tuple[int, int, int], kind: str) -> Texture:
        """The texture of a name, whose kind is always the same; size: width, height, layers."""
        texture = self._kept.get(name)
        if texture is None or texture.size != size:
            if texture is not None:
                self._kept.pop(name).release()  # before there may be no room for the new one
            texture = self._kept[name] = self.device.texture(*size, kind)
        return texture

    def filled(self, name: str, layers: Sequence[np.ndarray] | np.ndarray, kind: str = "rgba32f") -> Texture:
        """The texture of a name, with these layers (height, width[, components]) in the format's type."""
        height, width = layers[0].shape[:2]
        texture = self.of(name, (width, height, len(layers)), kind)
        for number, layer in enumerate(layers):
            self.device.write(texture, np.ascontiguousarray(layer), number)
        return texture

    def release(self) -> None:
        """Frees them, inside Device.freeing."""
        for texture in self._kept.values():
            texture.release()
        self._kept.clear()
