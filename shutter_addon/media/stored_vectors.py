"""What optical flow finds of pairs of frames, kept as files where films and farms read them again.

The name of a file is made of the content of both frames, so that whatever else changes, it is found."""

from __future__ import annotations

import hashlib
from contextlib import closing
from pathlib import Path

import numpy as np
from OpenImageIO import ImageSpec

from ..core import atomic_write
from ..core.frames.moments import STEP
from . import derived, flow
from .errors import MediaError
from .image_writing import write_halves

FOLDER = "virtual_shutter_vectors"
_CHANNELS = tuple(f"value{k}" for k in range(6))


class StoredVectors:
    """The vectors of pairs of frames: those of a folder, and others found as they are asked for."""

    def __init__(self, folder: Path, writes: bool) -> None:
        """writes: whether what is found is kept, as far as the folder can be written to"""
        self._folder, self._writes = folder, writes
        self._is_new = True  # nothing was written yet

    def found(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """What flow.found gives of two pictures."""
        digest = hashlib.blake2b(f"{flow.VERSION} {first.shape}".encode(), digest_size=16)
        for picture in (first, second):
            digest.update(picture)
        path = self._folder / f"{digest.hexdigest()}.exr"
        values = self._kept(path, first.shape)
        if values is None:
            values = flow.found(first, second)
            self._keep(path, values)
        return values

    def _kept(self, path: Path, shape: tuple[int, ...]) -> np.ndarray | None:
        """What is in a file; None: there is none of ours, or it is damaged."""
        height, width = (-(-n // STEP) for n in shape)
        spec = ImageSpec(width, height, len(_CHANNELS), "half")
        spec.channelnames = _CHANNELS
        if self._folder.is_symlink() or (image := derived.opened(path, spec)) is None:
            return None
        with closing(image):
            values = image.read_image(0, 0, 0, len(_CHANNELS), "half")
            if values is None or image.has_error:
                image.geterror()
                return None
        return values if np.isfinite(values).all() else None

    def _keep(self, path: Path, values: np.ndarray) -> None:
        if not self._writes:
            return
        try:
            derived.own_folder(self._folder)
            if self._is_new:
                atomic_write.clear_up(self._folder)
                self._is_new = False
            write_halves(path, values, _CHANNELS)
        except (OSError, MediaError):  # it is found again the next time
            self._writes = False
