"""How much of a GPU's memory textures may take."""

import ctypes
import os
import sys
from threading import Lock

MEGABYTE = 1 << 20
# The share of the memory that a GPU says it has: the rest is for Blender, for what else is on the screen, and for what
# a driver takes beside textures.
GPU_SHARE = 0.75
# The share of the machine's memory, at most: software renderers and many GPUs have no other.
MACHINE_SHARE = 0.5
# Bytes of a GPU that does not say what it has.
UNKNOWN = 6 << 30


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
