"""What a render is made with: what its command sets, else the user's preferences."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from ...devices.budget import MEGABYTE, Budget
from ..data import preferences
from ..devices import available


@dataclass(frozen=True)
class RenderSettings:
    """What a command sets for its render.

    device: one of available.CHOICES, in place of the user's preference
    weights: folder for the coefficients of every picture, as EXR files
    inbetween: folder of in-between frames, in place of the effects' own
    gpu_memory: megabytes of the GPU that textures may take, in place of the user's preference; 0: as budget.allowed"""

    device: str | None = None
    weights: Path | None = None
    inbetween: Path | None = None
    gpu_memory: int | None = None


_settings: ContextVar[RenderSettings] = ContextVar("settings", default=RenderSettings())  # noqa: B039
_budget: tuple[int, Budget] | None = None  # with the megabytes that it was made for


@contextmanager
def using(settings: RenderSettings) -> Iterator[None]:
    """Inside, on this thread, renders have these settings."""
    token = _settings.set(settings)
    try:
        yield
    finally:
        _settings.reset(token)


def settings() -> RenderSettings:
    """Those of the render that runs on this thread; of a job of the window none are set."""
    return _settings.get()


def wanted() -> str:
    """The device that the command asks for, else the user's preference: one of available.CHOICES."""
    return settings().device or preferences.device()


def _wanted_memory() -> int:
    """The megabytes that the command sets, else the user's preference; 0: as many as are allowed."""
    wanted_here = settings().gpu_memory
    return preferences.gpu_memory() if wanted_here is None else wanted_here


def memory() -> Budget:
    """What the textures of both sessions may take together: it is one GPU, which OpenGL knows best, where it may be
    asked; else the first device tells."""
    global _budget
    if _budget is None:
        megabytes = _wanted_memory()
        asks = not megabytes and wanted() in ("auto", "gpu", "opengl")
        _budget = megabytes, Budget(megabytes * MEGABYTE or (available.opengl().memory if asks else None))
    return _budget[1]


def forget_memory_if_changed() -> bool:
    """Whether another limit is wanted than the one that `memory` gave; the next call gives that."""
    global _budget
    if _budget is None or _budget[0] == _wanted_memory():
        return False
    _budget = None
    return True
