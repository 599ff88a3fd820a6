"""What a window takes of memory, worked out without taking it."""

from typing import NamedTuple

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..devices.budget import Budget
from ..devices.device import Device, Texture
from .layer_frames import RecentFrames, WeightedFrames, with_layers
from .running_sums import open_window
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


class _CountingDevice(Device):
    """Counts the bytes of textures, within what a real device allows, which has the same ones make room for others.

    most: of bytes that were taken at the same time"""

    def __init__(self, device: Device) -> None:
        super().__init__(Budget(device.budget.limit))
        self.name, self.max_size, self.max_layers = device.name, device.max_size, device.max_layers
        self.most = 0

    def _make(self, *_texture: object) -> object:
        self.most = max(self.most, self.budget.used)
        return self

    def _free(self, own: object) -> None:
        pass

    def read(self, texture: Texture) -> np.ndarray:
        return np.empty(0)


def of_windows(device: Device, source: FrameSource, kind: Kind) -> Needs:
    """What windows on a GPU need, with all that is made beside them. NoDeviceError: not even a picture has room on the
    device."""
    counting = _CountingDevice(device)
    asked = kind.window, kind.moved, kind.shutters, kind.summed
    windows = [open_window(counting, frames, *asked) for frames in _read(source, kind)]
    gpu = min(counting.most + beside(source, kind.shutters), counting.budget.limit)
    sizes = [kind.window * frame_bytes(window.source) for window in windows if window.sends]
    return Needs(gpu, sum(sizes), bool(sizes))


def _read(source: FrameSource, kind: Kind) -> list[FrameSource]:
    """What the windows of a picture read."""
    if not kind.layers:
        return [source]
    recent = RecentFrames(source)
    weighted: list[FrameSource] = [
        WeightedFrames(recent, _no_weight, rest=i < 0, alone=alone)
        for i in range(-1, kind.layers)
        for alone in ((False,) if source.alpha == "opaque" else (False, True))
    ]
    recent.windows = with_layers(recent, len(weighted), kind.moved)
    return weighted if recent.windows == len(weighted) else [recent, *weighted]


def _no_weight(_frame: int) -> np.ndarray:
    raise NotImplementedError("nothing is read")


def with_numpy(source: FrameSource, kind: Kind) -> Needs:
    """What windows need with NumPy."""
    frames = [source, *(read for read in _read(source, kind) if isinstance(read, WeightedFrames))]
    return Needs(0, sum(kind.window * frame_bytes(read) for read in frames), False)


def frame_bytes(source: FrameSource) -> int:
    """Bytes of a decoded frame of a source."""
    return source.width * source.height * 4 * source.dtype.itemsize
