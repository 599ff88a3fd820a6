"""Settings of renders: those of a command, else the user's preferences."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from ...devices.device import MEGABYTE, Budget, allowed
from ..data import preferences
from ..data.property_copy import for_a_while
from ..devices import available


@dataclass
class _RenderSettings:
    """What a command sets for its render.

    Attributes:
        device: One of available.CHOICES.
        weights: Folder for the coefficients of every picture, as EXR files.
        gpu_memory: Megabytes of the GPU that textures may take; 0: as device.allowed.
        budget: With the megabytes that it was made for.
    """

    device: str | None = None
    weights: Path | None = None
    gpu_memory: int | None = None
    budget: tuple[int, Budget] | None = None


settings = _RenderSettings()  # of the running command; empty in the window


def using(
    device: str | None = None, weights: Path | None = None, gpu_memory: int | None = None
) -> AbstractContextManager[None]:
    """Give renders these settings inside a `with` block, in a command."""
    changes = {"device": device, "weights": weights, "gpu_memory": gpu_memory}
    return for_a_while((settings, name, value) for name, value in changes.items())


def wanted() -> str:
    """Return the device that the command or the user wants, one of available.CHOICES."""
    return settings.device or preferences.device()


def _wanted_memory() -> int:
    """Return the megabytes that the command or the user sets; 0: as many as allowed."""
    return preferences.gpu_memory() if settings.gpu_memory is None else settings.gpu_memory


def memory() -> Budget:
    """Return the budget of GPU memory that all sessions share.

    OpenGL knows the size best, where it may be asked.
    """
    if settings.budget is None:
        megabytes = _wanted_memory()
        known = available.opengl().memory if not megabytes and wanted() in ("auto", "gpu", "opengl") else None
        settings.budget = megabytes, Budget(megabytes * MEGABYTE or known or allowed(None))
    return settings.budget[1]


def forget_memory_if_changed() -> bool:
    """Forget the budget if another limit is wanted now. Return whether it was."""
    if settings.budget is None or settings.budget[0] == _wanted_memory():
        return False
    settings.budget = None
    return True
