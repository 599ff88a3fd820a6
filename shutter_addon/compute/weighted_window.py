"""Windows on a device of frames that are weighted pixel by pixel, as layers are exposed (core.pixels.layering)."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..devices.device import Device, NoDeviceError, Texture
from .layer_frames import WeightedFrames
from .window import Frames, Sums, WholeFrames, Window, open_window


def open_any(device: Device, source: Any, capacity: int, moved: bool, shutters: int, summed: bool = True) -> Window:
    """As window.open_window, of weighted frames as well: running sums, if they can be made of them and the device has
    room, else the frames."""
    if not isinstance(source, WeightedFrames):
        return open_window(device, source, capacity, moved, shutters, summed)
    if not moved and summed and source.is_summable:
        try:
            return WeightedSums(device, source, capacity, shutters)
        except NoDeviceError:
            pass
    return (WholeFrames if moved else Frames)(device, source, capacity, shutters)  # type: ignore[arg-type]  # it has all of a source


class WeightedSums(Sums):
    """A window of running sums of opaque 8-bit frames that are weighted pixel by pixel, and of their weights, in
    textures rgba32ui: four fields of 32 bits. Where the weights are 1, its pictures have the bits of Sums."""

    def __init__(self, device: Device, source: WeightedFrames, capacity: int, shutters: int = 1):
        self.cover, self._weight = 2 if source.rest else 1, source.weight
        self._weights: Texture | None = None
        super().__init__(device, source.base, capacity, shutters)
        try:
            self._weights = device.texture(source.width, source.height, 1, "r32f")
        except NoDeviceError:
            self.release()
            raise

    def _send(self, index: int) -> tuple[str, dict[str, Any]]:
        if self._weights is None:
            raise ValueError("the window was released")
        weight = self._weight(index)
        self.device.write(self._weights, np.ascontiguousarray(weight[..., None]))
        sent, given = super()._send(index)
        given["textures"] = given.get("textures", {}) | {"weights": self._weights}
        return sent, given

    def release(self) -> None:
        super().release()
        if self._weights is not None:
            self._weights.release()
            self._weights = None
