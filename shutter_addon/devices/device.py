"""What compositing needs of a GPU, whatever it is reached by."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Any, Protocol

import numpy as np

from .budget import Budget
from .passes import Pass


class NoDeviceError(RuntimeError):
    """The device cannot be used, or has no room; the message is one sentence for the user."""


class Texture(Protocol):
    """A texture array on a device. size: (width, height, layers), in texels; kind: as for Device.texture."""

    size: tuple[int, int, int]
    kind: str

    def release(self) -> None:
        """Frees its memory; inside `Device.current` or `Device.freeing`."""


class Holder(Protocol):
    """What holds textures that can be made again: a window."""

    def release(self) -> None:
        """Frees them."""


class Device(Protocol):
    """Texture arrays and compute passes, on a GPU or on a software renderer. Call the other methods inside
    `with device.current():`, on any one thread.

    name: the renderer, as it calls itself
    max_size: texels along a texture's side, at most
    max_layers: layers of a texture array, at most
    budget: what all textures on this GPU may take
    takes_planes: whether frames that are planes (core.frames.planes) are quickest to send as such; it has to write
    r32ui then
    """

    name: str
    max_size: int
    max_layers: int
    budget: Budget
    takes_planes: bool

    def current(self) -> AbstractContextManager:
        """Makes the device usable on this thread until the `with` block ends. NoDeviceError: it cannot be, just now."""

    def freeing(self) -> AbstractContextManager:
        """Makes textures of the device releasable until the `with` block ends, on any one thread, at any time."""

    def texture(self, width: int, height: int, layers: int, kind: str) -> Texture:
        """A texture array of undefined content. NoDeviceError: the device has no room for it.

        kind: the format as in GLSL: rgba8, rgba16, rgba16f, rgba16ui, rgba32ui, rgba32f, r32f or r32ui. Passes read
        rgba8 and rgba16 as 0 … 1, all others as they are, and none with filtering."""

    def write(self, texture: Texture, array: np.ndarray, layer: int = 0, *, opaque: bool = False) -> None:
        """Fills a layer, or its first rows, with a C-contiguous array (rows, width[, components]) of the format's type.

        opaque: every alpha in the array is full; a device may then send the colours alone.
        TypeError: the device neither writes nor reads this format, only passes do (rgba16ui and rgba32ui on Blender's
        GPU)."""

    def send(self, texture: Texture, frame: np.ndarray) -> Texture:
        """Sends an opaque 8-bit frame (rows, width, 4) for the pass that is run next. It returns what that binds:
        `texture`, rgba8 of the frame's size, filled; or one of the format r32f, of numbers R + 256 G + 65536 B."""

    def read(self, texture: Texture) -> np.ndarray:
        """A copy of the texture (layers, height, width, components) in the format's type, after all passes that were
        run. TypeError: as for `write`."""

    def run(
        self,
        program: Pass,
        extent: tuple[int, ...],
        /,
        *,
        textures: Mapping[str, Texture] | None = None,
        images: Mapping[str, Texture] | None = None,
        blocks: Mapping[str, np.ndarray] | None = None,
        **constants: Any,
    ) -> None:
        """Runs a pass over `extent` invocations (x, y[, z]). Later passes read what it stored. StoppedError
        (core.stopping): the picture is not wanted any longer, and the pass is not run.

        textures, images: {name: Texture} for the samplers and the images that the pass declares
        blocks: {name: C-contiguous float32 array (length, 4)} for its blocks
        constants: {name: number or tuple of numbers} for its constants, by keyword
        """

    def use(self, window: Holder) -> None:
        """Notes that a window is in use. Where there is no room, others are freed by `window.release`."""

    def forget(self, window: Holder) -> None:
        """Notes that a window was freed."""

    def release(self) -> None:
        """Frees the device, at any time, but not its textures: each has its own `release`."""
