"""Textures that are kept from picture to picture, by name."""

from __future__ import annotations

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

    def release(self) -> None:
        """Frees them, inside Device.freeing."""
        for texture in self._kept.values():
            texture.release()
        self._kept.clear()
