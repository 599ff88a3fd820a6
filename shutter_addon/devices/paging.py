"""Textures within a budget, whatever library makes them: where it is full, what no pass uses just now makes room.

Textures of numbers that passes compute move to the host's memory and come back when a pass binds them, to the bit, so
a picture does not depend on the room there is. If that is not enough, windows that other pictures show are freed, to be
read again.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from .budget import MEGABYTE, Budget
from .device import Holder, NoDeviceError, Texture

TEXEL_BYTES = {
    "rgba8": 4,
    "rgba16": 8,
    "rgba16f": 8,
    "rgba16ui": 8,
    "rgba32ui": 16,
    "rgba32f": 16,
    "r32f": 4,
    "r32ui": 4,
    "rg32f": 8,
}
# Formats that can move to the host. Those of frames stay: a window that does not fit is kept on the host as a whole.
MOVABLE = ("rgba32f", "r32f", "r32ui")


class PagedTexture:
    """A texture array of a PagedDevice; see device.Texture.

    bytes: what it takes on the device
    own: what the device's library has for it; None while its content waits on the host, and after `release`
    waiting: its content (layers, height, width, components) meanwhile
    """

    def __init__(self, device: PagedDevice, size: tuple[int, int, int], kind: str):
        width, height, layers = size
        self.size, self.kind, self.bytes = size, kind, width * height * layers * TEXEL_BYTES[kind]
        self.own: Any = None
        self.waiting: np.ndarray | None = None
        self._device = device

    @property
    def gpu(self) -> Any:
        """`own`, on the device in any case."""
        self._device.bring((self,))
        return self.own

    def release(self) -> None:
        self._device.drop(self)
        self.waiting = None


class PagedDevice(ABC):
    """What devices share. Textures that a device is given are its own.

    budget: of the GPU, with others that reach it
    ask_others: called where the budget is full, has them free what they hold; None: there are none
    """

    name: str
    max_size: int
    max_layers: int
    takes_planes = False

    def __init__(self, budget: Budget, ask_others: Callable[[], None] | None = None):
        self.budget, self.ask_others = budget, ask_others
        self._held: dict[PagedTexture, None] = {}  # on the device, used longest ago first
        self._windows: dict[Holder, None] = {}  # likewise; the last one is in use

    def texture(self, width: int, height: int, layers: int, kind: str) -> PagedTexture:
        """See Device."""
        texture = PagedTexture(self, (width, height, layers), kind)
        texture.own = self._made(texture, ())
        self._held[texture] = None
        return texture

    def bring(self, textures: Iterable[Texture]) -> None:
        """Has textures on the device, all at the same time. NoDeviceError: it has no room for them."""
        paged = tuple(texture for texture in textures if isinstance(texture, PagedTexture))
        for texture in paged:
            if texture.own is None:
                if texture.waiting is None:
                    raise ValueError("the texture was released")
                texture.own = self._made(texture, paged)
                for layer, values in enumerate(texture.waiting):
                    self.write(texture, values, layer)
                texture.waiting = None
            self._held.pop(texture, None)
            self._held[texture] = None

    def drop(self, texture: PagedTexture) -> None:
        """Frees what a texture has on the device."""
        if texture.own is not None:
            own, texture.own = texture.own, None
            self._held.pop(texture, None)
            self._free(own)
            self.budget.give_back(texture.bytes)

    def send(self, texture: Any, frame: np.ndarray) -> Any:
        """See Device."""
        self.write(texture, frame, opaque=True)
        return texture

    def use(self, window: Holder) -> None:
        """Notes that a window is in use: others are freed (`window.release`) before it, where there is no room."""
        self._windows.pop(window, None)
        self._windows[window] = None

    def forget(self, window: Holder) -> None:
        """Notes that a window was freed."""
        self._windows.pop(window, None)

    def _made(self, texture: PagedTexture, beside: tuple[PagedTexture, ...]) -> Any:
        width, height, layers = texture.size
        possible = max(width, height) <= self.max_size and layers <= self.max_layers
        while possible and texture.bytes <= self.budget.limit:
            if self.budget.take(texture.bytes):
                try:
                    return self._make(width, height, layers, texture.kind)
                except NoDeviceError:  # the GPU has less than was thought
                    self.budget.give_back(texture.bytes)
            possible = self._make_room(beside)
        raise NoDeviceError(
            f"{self.name} has no room for {layers} layers of {width}×{height}"
            f" in the {self.budget.limit // MEGABYTE} MB that it may take"
        )

    def _make_room(self, beside: tuple[PagedTexture, ...]) -> bool:
        """Frees something that is not in use, nor among the textures `beside`. Whether there was anything."""
        used = self.budget.used
        if self.ask_others is not None and used > sum(texture.bytes for texture in self._held):
            self.ask_others()
            if self.budget.used < used:
                return True
        movable = (texture for texture in self._held if texture.kind in MOVABLE and texture not in beside)
        if (texture := next(movable, None)) is not None:
            texture.waiting = self.read(texture)
            self.drop(texture)
            return True
        for window in list(self._windows)[:-1]:
            window.release()
            return True
        return False

    @abstractmethod
    def _make(self, width: int, height: int, layers: int, kind: str) -> Any:
        """What the library has for a texture. NoDeviceError: it has no room for it."""

    @abstractmethod
    def _free(self, own: Any) -> None:
        """Frees what `_make` gave."""

    @abstractmethod
    def write(self, texture: Any, array: np.ndarray, layer: int = 0, *, opaque: bool = False) -> None:
        """See Device."""

    @abstractmethod
    def read(self, texture: Any) -> np.ndarray:
        """See Device."""
