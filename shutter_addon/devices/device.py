"""What compositing needs of a GPU, whatever it is reached by: texture arrays within a budget, and compute passes.

Where the budget is full, what no pass uses just now makes room. Textures of numbers that passes compute move to the
host's memory and come back when a pass binds them, to the bit, so a picture does not depend on the room there is. If
that is not enough, windows that other pictures show are freed, to be read again.
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

from ..core import stopping
from .passes import Pass

MEGABYTE = 1 << 20
# The share of the memory that a GPU says it has: the rest is for Blender, for what else is on the screen, and for what
# a driver takes beside textures.
GPU_SHARE = 0.75
# The share of the machine's memory, at most: software renderers and many GPUs have no other.
MACHINE_SHARE = 0.5
# Bytes of a GPU that does not say what it has.
UNKNOWN = 6 << 30
# Formats that can move to the host. Those of frames stay: a window that does not fit is kept on the host as a whole.
MOVABLE = ("rgba32f", "r32f", "r32ui")

Bound: TypeAlias = Mapping[str, "Texture"]  # textures by the names that a pass has for them
Given: TypeAlias = dict[str, Any]  # arguments of Device.run, by name
Own: TypeAlias = Any  # what the library of a device has for a texture


def texel_bytes(kind: str) -> int:
    """The bytes of a texel of a format, as GLSL calls it: its components and the bits of each."""
    components, bits = re.findall(r"[a-z]+|\d+", kind)[:2]
    return len(components) * int(bits) // 8


class NoDeviceError(RuntimeError):
    """The device cannot be used, or has no room; the message is one sentence for the user."""


class Budget:
    """Bytes that textures may take on a GPU, for all devices that reach it, on any thread.

    used: those that are taken
    """

    def __init__(self, limit: int | None = None) -> None:
        self._limit, self.used = limit, 0
        self._lock = Lock()

    @property
    def limit(self) -> int:
        """The most; until a device tells, what a GPU gets that does not say what it has."""
        return allowed(None) if self._limit is None else self._limit

    def tell(self, memory: int | None) -> None:
        """Sets the limit, if there is none, by the bytes of the GPU's memory; None: it does not say."""
        if self._limit is None:
            self._limit = allowed(memory)

    def take(self, size: int) -> bool:
        """Takes so many bytes, if they are left. Whether they were."""
        with self._lock:
            fits = self.used + size <= self.limit
            self.used += size if fits else 0
            return fits

    def give_back(self, size: int) -> None:
        with self._lock:
            self.used -= size


def allowed(memory: int | None) -> int:
    """The bytes that textures may take on a GPU of so many bytes; None: it does not say. It is to be the
    same at each start: then a film's parts have the same bits whenever they are rendered."""
    limits = [UNKNOWN if memory is None else int(memory * GPU_SHARE)]
    if (machine := machine_memory()) is not None:
        limits.append(int(machine * MACHINE_SHARE))
    return min(limits)


def machine_memory() -> int | None:
    """Bytes of the machine's memory; None: it cannot be asked."""
    if sys.platform == "win32":
        kilobytes = ctypes.c_ulonglong()
        known = ctypes.windll.kernel32.GetPhysicallyInstalledSystemMemory(ctypes.byref(kilobytes))
        return kilobytes.value << 10 if known else None
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return None


class Texture:
    """A texture array on a device.

    device: whose it is; None: it is a small one that lies beside the device's own, and outside its budget
    size: (width, height, layers), in texels; kind: as for Device.texture; bytes: what it takes on the device
    own: what the device's library has for it; None while its content waits on the host, and after `release`
    waiting: its content (layers, height, width, components) meanwhile
    """

    def __init__(self, device: Device | None, size: tuple[int, int, int], kind: str, own: Own = None) -> None:
        width, height, layers = size
        self.size, self.kind, self.bytes = size, kind, width * height * layers * texel_bytes(kind)
        self.device, self.own = device, own
        self.waiting: np.ndarray | None = None

    @property
    def gpu(self) -> Own:
        """`own`, on the device in any case."""
        if self.device is not None:
            self.device.bring((self,))
        return self.own

    def release(self) -> None:
        """Frees its memory; inside `Device.current` or `Device.freeing`."""
        if self.device is not None:
            self.device.drop(self)
        self.waiting = None


class Device:
    """Texture arrays and compute passes, on a GPU or on a software renderer; what they are reached by are its
    subclasses. Call its methods inside `with device.current():`, on any one thread. Textures that it is given are its
    own.

    name: the renderer, as it calls itself
    max_size: texels along a texture's side, at most
    max_layers: layers of a texture array, at most
    budget: what all textures on this GPU may take, those of other devices that reach it as well
    takes_planes: whether frames that are planes (core.frames.planes) are quickest to send as such; it has to write
    r32ui then
    ask_others: called where the budget is full, has them free what they hold; None: there are none
    """

    name: str
    max_size: int
    max_layers: int
    takes_planes = False

    def __init__(self, budget: Budget | None = None, ask_others: Callable[[], None] | None = None) -> None:
        self.budget, self.ask_others = budget or Budget(), ask_others
        self._held: dict[Texture, None] = {}  # on the device, used longest ago first
        self._windows: dict[Callable[[], None], None] = {}  # what frees each, likewise; the last one is in use

    def current(self) -> AbstractContextManager[Device]:
        """Makes the device usable on this thread until the `with` block ends. NoDeviceError: it cannot be, just now."""
        raise NotImplementedError

    def freeing(self) -> AbstractContextManager[Device]:
        """Makes textures of the device releasable until the `with` block ends, on any one thread, at any time."""
        raise NotImplementedError

    def texture(self, width: int, height: int, layers: int, kind: str) -> Texture:
        """A texture array of undefined content. NoDeviceError: the device has no room for it.

        kind: the format as in GLSL: rgba8, rgba16, rgba16f, rgba16ui, rgba32ui, rgba32f, r32f or r32ui. Passes read
        rgba8 and rgba16 as 0 … 1, all others as they are, and none with filtering."""
        texture = Texture(self, (width, height, layers), kind)
        texture.own = self._made(texture, ())
        self._held[texture] = None
        return texture

    def write(self, texture: Texture, array: np.ndarray, layer: int = 0, *, opaque: bool = False) -> None:
        """Fills a layer, or its first rows, with a C-contiguous array (rows, width[, components]) of the format's type.

        opaque: every alpha in the array is full; a device may then send the colours alone.
        TypeError: the device neither writes nor reads this format, only passes do (rgba16ui and rgba32ui on Blender's
        GPU)."""
        raise NotImplementedError

    def send(self, texture: Texture, frame: np.ndarray) -> Texture:
        """Sends an opaque 8-bit frame (rows, width, 4) for the pass that is run next. It returns what that binds:
        `texture`, rgba8 of the frame's size, filled; or one of the format r32f, of numbers R + 256 G + 65536 B."""
        self.write(texture, frame, opaque=True)
        return texture

    def read(self, texture: Texture) -> np.ndarray:
        """A copy of the texture (layers, height, width, components) in the format's type, after all passes that were
        run. TypeError: as for `write`."""
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
        """Runs a pass over `extent` invocations (x, y[, z]). Later passes read what it stored. StoppedError
        (core.stopping): the picture is not wanted any longer, and the pass is not run.

        textures, images: {name: Texture} for the samplers and the images that the pass declares
        blocks: {name: C-contiguous float32 array (length, 4)} for its blocks
        constants: {name: number or tuple of numbers} for its constants, by keyword
        """
        stopping.check()
        sampled = {name: (textures or {})[name] for name in program.samplers}
        stored = {name: (images or {})[name] for name in program.images}
        self.bring([*sampled.values(), *stored.values()])
        own = ({name: texture.own for name, texture in bound.items()} for bound in (sampled, stored))
        self._dispatch(program, program.groups(extent), *own, blocks or {}, constants)

    def use(self, release: Callable[[], None]) -> None:
        """Notes that what `release` frees, a window, is in use: others are freed before it, where there is no room."""
        self.forget(release)
        self._windows[release] = None

    def forget(self, release: Callable[[], None]) -> None:
        """Notes that a window was freed."""
        self._windows.pop(release, None)

    def release(self) -> None:
        """Frees the device, at any time, but not its textures: each has its own `release`."""
        raise NotImplementedError

    def bring(self, textures: Iterable[Texture]) -> None:
        """Has textures on the device, all at the same time. NoDeviceError: it has no room for them."""
        wanted = tuple(texture for texture in textures if texture.device is self)
        for texture in wanted:
            if texture.own is None:
                if texture.waiting is None:
                    raise ValueError("the texture was released")
                texture.own = self._made(texture, wanted)
                for layer, values in enumerate(texture.waiting):
                    self.write(texture, values, layer)
                texture.waiting = None
            self._held.pop(texture, None)
            self._held[texture] = None

    def drop(self, texture: Texture) -> None:
        """Frees what a texture has on the device."""
        if texture.own is not None:
            own, texture.own = texture.own, None
            self._held.pop(texture, None)
            self._free(own)
            self.budget.give_back(texture.bytes)

    def _made(self, texture: Texture, beside: tuple[Texture, ...]) -> Own:
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

    def _make_room(self, beside: tuple[Texture, ...]) -> bool:
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
        for release in list(self._windows)[:-1]:
            release()
            return True
        return False

    def _make(self, width: int, height: int, layers: int, kind: str) -> Own:
        """What the library has for a texture. NoDeviceError: it has no room for it."""
        raise NotImplementedError

    def _free(self, own: Own) -> None:
        """Frees what `_make` gave."""
        raise NotImplementedError

    def _dispatch(self, program: Pass, groups: tuple[int, ...], textures: dict, images: dict, *given: Mapping) -> None:
        """Runs a pass in so many workgroups; textures, images: what `_make` gave, by name; given: blocks, constants."""
        raise NotImplementedError


class NamedTextures:
    """Textures of a device that are kept from picture to picture, by name, each made anew where another size is asked
    for."""

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
