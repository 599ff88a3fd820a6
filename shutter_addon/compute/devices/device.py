"""The interface of a GPU that runs compute shaders: texture arrays within a memory budget, and compute passes.

When the budget is full, textures that no pass uses make room. Computed textures move to the host and come back, bit for
bit, when a pass binds them, so a picture does not depend on the free memory. If that is not enough, the windows of
other pictures (their frames of footage) are freed and read again later.
"""

from __future__ import annotations

import ctypes
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from threading import Lock
from typing import Any, TypeAlias

import numpy as np

from ...core import stopping
from .passes import Pass

MEGABYTE = 1 << 20
# Bytes that textures may take on a GPU that does not tell its memory.
UNKNOWN = 6 << 30
# Formats that can move to the host. Frames do not move: a window that does not fit stays on the host as a whole.
MOVABLE = ("rgba32f", "r32f", "r32ui")

Bound: TypeAlias = Mapping[str, "Texture"]  # textures by their names in a pass
Given: TypeAlias = dict[str, Any]  # keyword arguments of Device.run
Own: TypeAlias = Any  # a texture of the device's library


def texel_bytes(kind: str) -> int:
    """Return the bytes of a texel in a GLSL image format: 16 for rgba32f."""
    components, bits = re.findall(r"[a-z]+|\d+", kind)[:2]
    return len(components) * int(bits) // 8


class NoDeviceError(RuntimeError):
    """The GPU cannot be used, or has no room. The message is a sentence for the user."""


class Budget:
    """The memory that textures may take on a GPU, shared by all devices on it. For any thread.

    Attributes:
        limit: The most bytes that textures may take.
        used: The bytes that they take.
    """

    def __init__(self, limit: int) -> None:
        self.limit, self.used = limit, 0
        self._lock = Lock()

    def take(self, size: int) -> bool:
        """Take `size` bytes if they are free, and return whether they were."""
        with self._lock:
            fits = self.used + size <= self.limit
            self.used += size if fits else 0
            return fits

    def give_back(self, size: int) -> None:
        """Make `size` bytes free that were taken."""
        with self._lock:
            self.used -= size


def allowed(memory: int | None) -> int:
    """Return how many bytes textures may take on a GPU, if the user sets no limit.

    It is 75 % of the GPU's memory (UNKNOWN if that is unknown), but at most half of the machine's main memory. It does
    not depend on what is free: pictures can depend on it in their last bits, and all parts of a film must match.

    Args:
        memory: The GPU's memory in bytes. None: unknown.
    """
    # Blender, the screen and the driver need the rest of the GPU's memory.
    limits = [UNKNOWN if memory is None else int(memory * 0.75)]
    if (machine := machine_memory()) is not None:  # software renderers and many GPUs use it
        limits.append(int(machine * 0.5))
    return min(limits)


def machine_memory() -> int | None:
    """Return the bytes of the machine's main memory, or None if they are unknown."""
    if sys.platform == "win32":
        kilobytes = ctypes.c_ulonglong()
        known = ctypes.windll.kernel32.GetPhysicallyInstalledSystemMemory(ctypes.byref(kilobytes))
        return kilobytes.value << 10 if known else None
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return None


class Texture:
    """A texture array on a device. If memory is short, its content can move to main memory and back.

    Attributes:
        device: The device that made it. None: a texture that belongs to no budget and never moves, as from Device.send.
        size: (width, height, layers) in texels.
        kind: The GLSL format, as for Device.texture.
        bytes: The bytes that it takes on the device.
        own: The texture object of the graphics library. None: the texture was released, or its content is in main
            memory.
        waiting: Its content (layers, height, width, components) while that is in main memory. None: it is on the
            device, or the texture was released.
    """

    def __init__(self, device: Device | None, size: tuple[int, int, int], kind: str, own: Own = None) -> None:
        width, height, layers = size
        self.size, self.kind, self.bytes = size, kind, width * height * layers * texel_bytes(kind)
        self.device, self.own = device, own
        self.waiting: np.ndarray | None = None

    @property
    def gpu(self) -> Own:
        """The texture object of the graphics library. Its content comes back to the device if it is on the host."""
        if self.device is not None:
            self.device.bring((self,))
        return self.own

    def release(self) -> None:
        """Free the texture's memory. Call it inside `Device.current` or `Device.freeing`."""
        if self.device is not None:
            self.device.drop(self)
        self.waiting = None


class Device:
    """A GPU or software renderer with texture arrays and compute passes.

    Call its methods, except `freeing` and `release`, inside `with device.current():`, on one thread at a time, and with
    textures that it made.

    Attributes:
        name: The renderer's name, as the driver tells it.
        max_size: The most texels along a texture's side.
        max_layers: The most layers of a texture array.
        budget: The memory of all textures on this GPU, shared with other devices on the same GPU.
        takes_planes: Whether frames are sent fastest as planes of luma and chroma (frame_source.Planes), in r32ui
            textures, rather than as RGBA.
        ask_others: Called when the budget is full, so that other devices on this GPU free memory. None: no other device
            shares the budget.
    """

    name: str
    max_size: int
    max_layers: int
    takes_planes = False

    def __init__(self, budget: Budget, ask_others: Callable[[], None] | None) -> None:
        self.budget, self.ask_others = budget, ask_others
        self._held: dict[Texture, None] = {}  # textures on the device, least recently used first
        self._windows: dict[Callable[[], None], None] = {}  # what frees each window, likewise; the last one is in use

    def current(self) -> AbstractContextManager[Device]:
        """Make the device usable on this thread until the `with` block ends.

        Raises:
            NoDeviceError: It cannot be used now.
        """
        raise NotImplementedError

    def freeing(self) -> AbstractContextManager[Device]:
        """Allow textures to be released until the `with` block ends, on any thread at any time."""
        raise NotImplementedError

    def texture(self, width: int, height: int, layers: int, kind: str) -> Texture:
        """Return a new texture array of undefined content. Free other memory if necessary.

        Args:
            width: In texels.
            height: In texels.
            layers: The number of layers.
            kind: A GLSL format: rgba8, rgba16, rgba16f, rgba16ui, rgba32ui, rgba32f, r32f or r32ui. Passes read rgba8
                and rgba16 as floats from 0 to 1. Texels are never filtered.

        Raises:
            NoDeviceError: The device has no room for it.
        """
        texture = Texture(self, (width, height, layers), kind)
        texture.own = self._made(texture, ())
        self._held[texture] = None
        return texture

    def write(self, texture: Texture, array: np.ndarray, layer: int = 0, *, opaque: bool = False) -> None:
        """Copy an array into the first rows of one layer of a texture. Other rows stay as they are.

        Args:
            array: (rows, width[, components]), C-contiguous, in the NumPy type of the texture's format. It may have
                fewer rows than the texture.
            layer: The index of the layer.
            opaque: Whether alpha is full in all pixels. A device may then send only the colors, which is faster.

        Raises:
            KeyError: The device cannot copy to or from this format, which only passes read and write (rgba16ui and
                rgba32ui on Blender's GPU).
        """
        raise NotImplementedError

    def send(self, texture: Texture, frame: np.ndarray) -> Texture:
        """Send an opaque 8-bit frame to the device in the fastest way, for use by the next pass only.

        Args:
            texture: An rgba8 texture of the frame's size, which the device may overwrite.
            frame: (rows, width, 4) uint8.

        Returns:
            The texture for the pass to read: either `texture`, or a new one of format r32f, where each pixel is the
            number R + 256 G + 65536 B.
        """
        self.write(texture, frame, opaque=True)
        return texture

    def read(self, texture: Texture) -> np.ndarray:
        """Return a copy (layers, height, width, components) of a texture in its format's type, after all passes so far.

        Raises:
            KeyError: As for `write`.
        """
        raise NotImplementedError

    def run(
        self,
        program: Pass,
        extent: tuple[int, ...],
        /,
        *,
        textures: Bound | None = None,
        images: Bound | None = None,
        blocks: Mapping[str, np.ndarray] | None = None,
        **constants: Any,
    ) -> None:
        """Run a compute pass. Later passes and `read` see what it has stored.

        Args:
            program: The pass.
            extent: The number of invocations (x, y[, z]), which is rounded up to whole workgroups.
            textures: {name: texture} for its samplers. May contain others, which are ignored.
            images: {name: texture} for its images. May contain others, which are ignored.
            blocks: {name: C-contiguous float32 array (length, 4)} for its uniform blocks.
            constants: {name: number or tuple of numbers} for its uniforms.

        Raises:
            core.stopping.StoppedError: The calling thread's work was cancelled; the pass did not run.
            NoDeviceError: The device has no room for all of its textures at once.
            ValueError: One of them was released.
        """
        stopping.check()
        sampled = {name: (textures or {})[name] for name in program.samplers}
        stored = {name: (images or {})[name] for name in program.images}
        self.bring([*sampled.values(), *stored.values()])
        own = ({name: texture.own for name, texture in bound.items()} for bound in (sampled, stored))
        self._dispatch(program, program.groups(extent), *own, blocks or {}, constants)

    def use(self, release: Callable[[], None]) -> None:
        """Mark a window (stored source frames of a picture) as the one in use, which the device does not free.

        If memory is short, the other windows are freed, the least recently used first. They load their frames again
        later.

        Args:
            release: The function that frees the window. The device knows the window by it.
        """
        self.forget(release)
        self._windows[release] = None

    def forget(self, release: Callable[[], None]) -> None:
        """Stop keeping track of a window. This does not free it. An unknown window is ignored.

        Args:
            release: The function that was given to `use` for this window. It is not called.
        """
        self._windows.pop(release, None)

    def release(self) -> None:
        """Free the device, at any time. This does not release its textures: release each of them, too."""
        raise NotImplementedError

    def bring(self, textures: Iterable[Texture]) -> None:
        """Move textures whose content is in main memory back to the device, so that all of these are there at once.

        Args:
            textures: The textures. Those of no device, or of another one, are ignored.

        Raises:
            NoDeviceError: The device has no room for all of them at once.
            ValueError: A texture was released.
        """
        wanted = tuple(texture for texture in textures if texture.device is self)
        for texture in wanted:
            if texture.own is None:
                if texture.waiting is None:
                    raise ValueError("the texture was released")  # LayeredRenderer tries again
                texture.own = self._made(texture, wanted)
                for layer, values in enumerate(texture.waiting):
                    self.write(texture, values, layer)
                texture.waiting = None
            self._held.pop(texture, None)
            self._held[texture] = None

    def drop(self, texture: Texture) -> None:
        """Free a texture's memory on the device, and the content there. Content on the host stays."""
        if texture.own is not None:
            own, texture.own = texture.own, None
            self._held.pop(texture, None)
            self._free(own)
            self.budget.give_back(texture.bytes)

    def _made(self, texture: Texture, beside: tuple[Texture, ...]) -> Own:
        """Allocate a texture with the graphics library, within the budget. Free other memory if necessary.

        Args:
            texture: A texture without memory on the device, for its size and format.
            beside: Textures that must not be moved to main memory for it.

        Returns:
            The texture object of the graphics library, which the caller stores in Texture.own.

        Raises:
            NoDeviceError: It is larger than the device or the budget allows, or nothing more can be freed.
        """
        width, height, layers = texture.size
        possible = max(width, height) <= self.max_size and layers <= self.max_layers
        while possible and texture.bytes <= self.budget.limit:
            if self.budget.take(texture.bytes):
                try:
                    return self._make(width, height, layers, texture.kind)
                except NoDeviceError:  # the GPU has less memory than it told
                    self.budget.give_back(texture.bytes)
            possible = self._make_room(beside)
        raise NoDeviceError(
            f"{self.name} has no room for {layers} layers of {width}×{height}"
            f" in the {self.budget.limit // MEGABYTE} MB that it may take"
        )

    def _make_room(self, beside: tuple[Texture, ...]) -> bool:
        """Free some memory on the GPU, by the first of these steps that frees any.

        Other devices on the GPU are asked (ask_others). Else the least recently used texture of a format in MOVABLE
        moves to main memory. Else the least recently used window that is not in use is freed.

        Args:
            beside: Textures that must stay on the device.

        Returns:
            True if something was freed, False if nothing was left to free.
        """
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
        for release in list(self._windows)[:-1]:
            release()
            return True
        return False

    def _make(self, width: int, height: int, layers: int, kind: str) -> Own:
        """Return a new texture object of the graphics library.

        Args:
            width, height, layers, kind: As for `texture`.

        Raises:
            NoDeviceError: There is no room for it.
        """
        raise NotImplementedError

    def _free(self, own: Own) -> None:
        """Free a texture object of the graphics library."""
        raise NotImplementedError

    def _dispatch(self, program: Pass, groups: tuple[int, ...], textures: dict, images: dict, *given: Mapping) -> None:
        """Bind the textures and arguments of a pass, and run it with the graphics library.

        Args:
            program: The pass.
            groups: The number of workgroups (x, y, z).
            textures: {name: texture object} for its samplers.
            images: {name: texture object} for its images.
            given: Two mappings: `blocks` and `constants`, as for `run`.
        """
        raise NotImplementedError


class NamedTextures:
    """Textures that are reused from picture to picture, each known by a name."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._kept: dict[str, Texture] = {}

    def of(self, name: str, size: tuple[int, int, int], kind: str = "rgba32f") -> Texture:
        """Return the texture that has a name, with its content from earlier uses.

        If there is none, a new one with undefined content is made. One of another size is freed and replaced likewise.

        Args:
            name: The name, which the caller chooses.
            size: (width, height, layers) in texels.
            kind: The GLSL format, always the same for a name.
        """
        texture = self._kept.get(name)
        if texture is None or texture.size != size:
            if texture is not None:
                self._kept.pop(name).release()  # before there may be no room for the new one
            texture = self._kept[name] = self.device.texture(*size, kind)
        return texture

    def filled(self, name: str, layers: Sequence[np.ndarray] | np.ndarray, kind: str = "rgba32f") -> Texture:
        """Return the texture that has a name, as `of` does, after copying arrays into its layers.

        Args:
            name: The name, which the caller chooses.
            layers: An array (height, width[, components]) for each layer, of the format's NumPy type. All have the same
                size.
            kind: The GLSL format, always the same for a name.
        """
        height, width = layers[0].shape[:2]
        texture = self.of(name, (width, height, len(layers)), kind)
        for number, layer in enumerate(layers):
            self.device.write(texture, np.ascontiguousarray(layer), number)
        return texture

    def release(self) -> None:
        """Free all textures. Call it inside `Device.current` or `Device.freeing`."""
        for texture in self._kept.values():
            texture.release()
        self._kept.clear()
