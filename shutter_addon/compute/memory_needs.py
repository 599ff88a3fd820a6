"""What a window takes of memory, worked out without taking it."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..core.frames.frame_source import FrameSource
from ..devices.budget import Budget
from ..devices.device import Device, Holder, NoDeviceError
from ..devices.paging import TEXEL_BYTES
from .layer_frames import WeightedFrames
from .weighted_window import open_any
from .window import beside


class Needs(NamedTuple):
    """gpu: bytes of the device's memory; host: of the machine's, for a window that is kept there; sends: whether every
    picture sends its frames anew, for which the device has no room."""

    gpu: int
    host: int
    sends: bool


class Kind(NamedTuple):
    """What a picture asks of its windows: how many frames they have, whether exposures follow something, the number of
    shutters, that of layers, of which each has a window, as has what lies behind them, and whether all of it is
    averages."""

    window: int
    moved: bool
    shutters: int
    layers: int = 0
    summed: bool = True


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


def of_window(device: Device, source: FrameSource, kind: Kind) -> Needs:
    """What windows on a GPU need, with all that is made beside them. NoDeviceError: not even a picture has room on the
    device."""
    counting: Any = _CountingDevice(device)
    asked = kind.window, kind.moved, kind.shutters, kind.summed
    windows = [open_any(counting, frames, *asked) for frames in _read(source, kind.layers)]
    gpu = min(counting.budget.used + beside(source, kind.shutters), counting.budget.limit)
    host = sum(kind.window * frame_bytes(window.source) for window in windows if window.sends)
    return Needs(gpu, host, any(window.sends for window in windows))


def _read(source: FrameSource, layers: int) -> list[FrameSource]:
    """What the windows of a picture read."""
    if not layers:
        return [source]
    weighted: list[Any] = [
        WeightedFrames(source, _no_weight, rest=i < 0, alone=alone)
        for i in range(-1, layers)
        for alone in ((False,) if source.alpha == "opaque" else (False, True))
    ]
    return weighted if weighted[0].is_summable else [source, *weighted]


def _no_weight(_frame: int) -> Any:
    raise NotImplementedError("nothing is read")


def of_numpy_window(source: FrameSource, kind: Kind) -> Needs:
    """What windows need with NumPy."""
    frames = {id(read): read for read in (source, *_read(source, kind.layers))}
    return Needs(0, sum(kind.window * frame_bytes(read) for read in frames.values()), False)


def frame_bytes(source: FrameSource) -> int:
    """Bytes of a decoded frame of a source."""
    return source.width * source.height * 4 * source.dtype.itemsize
