"""Settings of renders: the device and its memory, by a command's options or else the user's preferences."""

from __future__ import annotations

from contextlib import AbstractContextManager

from ...compute.devices.device import MEGABYTE, Budget, allowed
from ..data import preferences
from ..data.property_copy import for_a_while
from ..devices import available
from .render_job import job


def using(**settings: object) -> AbstractContextManager[None]:
    """Let a command's options (attributes of render_job.job, by name) apply to renders within a `with` block."""
    return for_a_while((job, name, value) for name, value in settings.items())


def wanted() -> str:
    """Return the device that a command or the user wants, one of available.CHOICES."""
    return job.device or preferences.device()


def _wanted_memory() -> int:
    """Return how many megabytes of GPU memory a command or the user allows textures; 0: an automatic limit."""
    return preferences.gpu_memory() if job.gpu_memory is None else job.gpu_memory


def memory() -> Budget:
    """Return the budget of GPU memory that all sessions share: the limit that is set, or else an automatic one."""
    if job.budget is None:
        megabytes = _wanted_memory()
        known = available.opengl().memory if not megabytes and wanted() in ("auto", "gpu", "opengl") else None
        job.budget = megabytes, Budget(megabytes * MEGABYTE or known or allowed(None))
    return job.budget[1]


def forget_memory_if_changed() -> bool:
    """Forget the budget of GPU memory if its limit was changed in the settings. Return whether it was."""
    if job.budget is None or job.budget[0] == _wanted_memory():
        return False
    job.budget = None
    return True
