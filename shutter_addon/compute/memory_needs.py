"""What a window takes of memory, worked out without taking it."""

from __future__ import annotations

from typing import NamedTuple

from ..core.frames.frame_source import FrameSource
from ..devices.budget import Budget
from ..devices.device import Device, Holder, NoDeviceError
from ..devices.paging import TEXEL_BYTES
from . import cpu_window
from .window import beside, open_window


class Needs(NamedTuple):
    """gpu: bytes of the device's memory; host: of the machine's, for a window that is kept there; sends: whether every
    picture sends its frames anew, for which the device has no room."""

    gpu: int
    host: int
    sends: bool


class _CountedTexture:
    def __init__(self, budget: Budget, size: int):
        self._budget, self._size = budget, size

    def release(self) -> None:
        self._budget.give_back(self._size)


class _CountingDevice:
    """Counts the bytes of textures, within what a real device allows."""

    def __init__(self, device: Device):
        self.name, self.max_size, self.max_layers = device.name, device.max_size, device.max_layers
        self.budget = Budget(device.budget.limit)

    def texture(self, width: int, height: int, layers: int, kind: str) -> _CountedTexture:
        size = width * height * layers * TEXEL_BYTES[kind]
        possible = max(width, height) <= self.max_size and layers <= self.max_layers
        if not (possible and self.budget.take(size)):
            raise NoDeviceError("over the budget")
        return _CountedTexture(self.budget, size)

    def use(self, window: Holder) -> None:
        """It has no other windows."""

    forget = use


def of_window(device: Device, source: FrameSource, capacity: int, moved: bool, shutters: int) -> Needs:
    """What a window on a GPU needs, with all that is made beside it; arguments like those of open_window.

    NoDeviceError: not even a picture has room on the device."""
    counting = _CountingDevice(device)
    window = open_window(counting, source, capacity, moved, shutters)  # type: ignore[arg-type]  # it makes textures alone
    gpu = min(counting.budget.used + beside(source, shutters), counting.budget.limit)
    return Needs(gpu, capacity * frame_bytes(source) if window.sends else 0, window.sends)


def of_numpy_window(source: FrameSource, capacity: int, moved: bool) -> Needs:
    """What a window needs with NumPy."""
    if cpu_window.TiledSums.fit(source, capacity) and not moved:
        return Needs(0, 12 * source.width * source.height * (capacity + 1), False)
    return Needs(0, capacity * frame_bytes(source), False)


def frame_bytes(source: FrameSource) -> int:
    """Bytes of a decoded frame of a source."""
    return source.width * source.height * 4 * source.dtype.itemsize
