"""Layers laid over what lies behind them, on a device (core.pixels.layering)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..devices.device import Device, Texture
from ..devices.named_textures import NamedTextures
from ..devices.passes import Pass, read_pass
from .request import Handle

# Pixels along a side of the blocks whose least share is looked at.
BLOCK = 16
LEAST = read_pass("layer", "LEAST")


class Exposure(NamedTuple):
    """What a layer's frames, or those behind all layers, were composed to: a picture, and one whose alpha is the share
    of the exposure that fell on them. Of opaque frames it is the same picture."""

    color: Handle
    share: Handle


class Behind(NamedTuple):
    """What lies behind layers.

    exposed: by its weights
    plain: the picture without layers; None: where there are none, `exposed` has the same bits
    plate: what lies there where too little of it is exposed; None: nowhere"""

    exposed: Exposure
    plain: Handle | None = None
    plate: Handle | None = None


def laying_pass(begins: bool, ends: bool, opaque: bool, plain: bool, plate: bool, levels: bool) -> Pass:
    """Lays a layer over a picture, or over what lies behind all; see shaders/layer.glsl."""
    return read_pass(
        "layer",
        BEGINS=int(begins),
        ENDS=int(ends),
        OPAQUE=int(opaque),
        PLAIN=int(plain and begins),
        PLATE=int(plate and begins),
        LEVELS=int(levels and ends),
    )


class Laying:
    """Lays layers over one another. What it gives is valid until its next."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._textures = NamedTextures(device)

    def least(self, exposed: Exposure) -> np.ndarray:
        """The least share (h, w) in blocks of BLOCK × BLOCK pixels, bottom row first."""
        width, height, _ = exposed.share.size
        least = self._textures.of("least", (-(-width // BLOCK), -(-height // BLOCK), 1), "r32f")
        images = {"clear": exposed.share, "least": least}
        self._device.run(LEAST, least.size[:2], images=images, size=(width, height))
        return self._device.read(least)[0, ..., 0]

    def shares(self, exposed: Exposure) -> np.ndarray:
        """The shares (H, W), top row first."""
        return self._device.read(exposed.share)[0, ::-1, :, 3]

    def around(self, exposed: Exposure) -> np.ndarray:
        """What was exposed (H, W, 4), not weighted any more, top row first."""
        color = self._device.read(exposed.color)[0, ::-1]
        return color / np.maximum(self.shares(exposed), 1e-6)[..., None]

    def plate(self, picture: np.ndarray) -> Texture:
        """A picture (H, W, 4) float32 for Behind.plate."""
        height, width, _ = picture.shape
        plate = self._textures.of("plate", (width, height, 1), "rgba32f")
        self._device.write(plate, np.ascontiguousarray(picture[::-1], np.float32))
        return plate

    def lay(self, behind: Behind, layers: Sequence[Exposure], levels: bool) -> Texture:
        """The picture, as GPUCompositor.draw gives it."""
        under = behind.exposed.color
        width, height, _ = under.size
        for k, layer in enumerate(layers):
            ends = k == len(layers) - 1
            name = ("levels" if levels else "picture") if ends else f"part {k % 2}"
            picture = self._textures.of(name, (width, height, 1), "rgba8" if levels and ends else "rgba32f")
            program = laying_pass(
                begins=not k,
                ends=ends,
                opaque=layer.color is layer.share,
                plain=behind.plain is not None,
                plate=behind.plate is not None,
                levels=levels,
            )
            textures = {"share": layer.share, "clear": behind.exposed.share}
            textures |= {"plain": behind.plain, "plate": behind.plate}
            images, size = {"under": under, "exposed": layer.color, "picture": picture}, (width, height)
            self._device.run(program, size, textures=textures, images=images, size=size, height=height)
            under = picture
        return under

    def release(self) -> None:
        self._textures.release()
