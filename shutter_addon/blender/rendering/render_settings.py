"""What a render is made with: what its command sets, else the user's preferences."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from ...devices.device import MEGABYTE, Budget
from ..data import preferences
from ..data.property_copy import for_a_while
from ..devices import available


@dataclass
class _RenderSettings:
    """What a command sets for its render.

    device: one of available.CHOICES, in place of the user's preference
    weights: folder for the coefficients of every picture, as EXR files
    gpu_memory: megabytes of the GPU that textures may take, in place of the user's preference; 0: as device.allowed
    budget: with the megabytes that it was made for"""

    device: str | None = None
    weights: Path | None = None
    gpu_memory: int | None = None
    budget: tuple[int, Budget] | None = None


_settings = _RenderSettings()  # of the command that runs; of the window none are set


def using(
    device: str | None = None, weights: Path | None = None, gpu_memory: int | None = None
) -> AbstractContextManager[None]:
    """Inside, renders have these settings: in a command, beside which nothing else renders."""
    changes = {"device": device, "weights": weights, "gpu_memory": gpu_memory}
    return for_a_while((_settings, name, value) for name, value in changes.items())


def weights() -> Path | None:
    """The folder for the coefficients of every picture; None: they are not wanted."""
    return _settings.weights


def wanted() -> str:
    """The device that the command asks for, else the user's preference: one of available.CHOICES."""
    return _settings.device or preferences.device()


def _wanted_memory() -> int:
    """The megabytes that the command sets, else the user's preference; 0: as many as are allowed."""
    return preferences.gpu_memory() if _settings.gpu_memory is None else _settings.gpu_memory


def memory() -> Budget:
    """What the textures of both sessions may take together: it is one GPU, which OpenGL knows best, where it may be
    asked; else the first device tells."""
    if _settings.budget is None:
        megabytes = _wanted_memory()
        asks = not megabytes and wanted() in ("auto", "gpu", "opengl")
        _settings.budget = megabytes, Budget(megabytes * MEGABYTE or (available.opengl().memory if asks else None))
    return _settings.budget[1]


def forget_memory_if_changed() -> bool:
    """Whether another limit is wanted than the one that `memory` gave; the next call gives that."""
    if _settings.budget is None or _settings.budget[0] == _wanted_memory():
        return False
    _settings.budget = None
    return True
