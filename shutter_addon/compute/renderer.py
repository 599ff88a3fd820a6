"""From a source and an instant to a picture: rasterise, diffuse, load the window, compose."""

from __future__ import annotations

import numpy as np

from ..core import compositor, scribbles, shutters
from ..core.recipe import Instant
from .cpu import CPUCompositor
from .errors import NoDeviceError

DEVICES = ("auto", "gpu", "cpu")


def open_compositor(device: str = "auto"):
    """The compositor for a device of DEVICES, and a sentence for the user where "auto" had to do without GL."""
    if device == "cpu":
        return CPUCompositor(), None
    try:
        from .gl import GLDevice
        from .gpu import GPUCompositor

        return GPUCompositor(GLDevice()), None
    except (ImportError, NoDeviceError) as error:
        if device == "gpu":
            raise NoDeviceError(str(error)) from None
        return CPUCompositor(), f"{error}; composing with NumPy, which is slow"


class Renderer:
    """Pictures of one source; keeps the window's frames and the last coefficients."""

    def __init__(self, compositor, source):
        self.compositor, self.source = compositor, source
        self._solver = compositor.solver()
        self._window = None
        self._solved = None

    def picture(self, index: int, instant: Instant, direction: int = 1) -> np.ndarray:
        """The picture (H, W, 4) float32 at source frame `index`: scene-linear, premultiplied, top row first.

        direction: −1 where the source plays in reverse, and the window's next frames are those before `index`.
        """
        with self.compositor.current():
            handle, instant, block = self._coefficients(instant)
            window = self._window_for(instant.options.window)
            window.load(self._needed(index, direction, instant))
            return self.compositor.compose(window, index, direction, instant, handle, block)

    def coefficients(self, instant: Instant) -> np.ndarray:
        """Coefficients (N, h, w) float32 at an instant, one per pixel or per block that shares a shutter."""
        count, (width, height) = len(instant.bars), self._grid(instant)
        with self.compositor.current():
            labels = self._labels(instant)
            if (values := _uniform(labels, count)) is not None:
                return np.broadcast_to(values.astype(np.float32)[:, None, None], (count, height, width))
            return self.compositor.coefficients(self._diffused(labels, count), count)

    def _grid(self, instant: Instant) -> tuple[int, int]:
        block = instant.options.aggregate
        return -(-self.source.width // block), -(-self.source.height // block)

    def _labels(self, instant: Instant) -> np.ndarray:
        return scribbles.rasterise(instant.shapes, *self._grid(instant), border=instant.options.border)

    def _coefficients(self, instant: Instant):
        """The coefficients on the device, the instant to compose with them, and the block that shares one.

        Where one mix of shutters holds for the whole picture, that mix is the only shutter.
        """
        labels = self._labels(instant)
        values = _uniform(labels, len(instant.bars))
        if values is None:
            return self._diffused(labels, len(instant.bars)), instant, instant.options.aggregate
        chosen = int(values.argmax())
        everywhere = max(self.source.width, self.source.height)
        return self.compositor.constant(np.ones(1)), instant.alone(chosen), everywhere

    def _diffused(self, labels: np.ndarray, count: int):
        """Solves anew only when a scribble moved."""
        if self._solved is None or self._solved[0] != count or not np.array_equal(self._solved[1], labels):
            self._solved = count, labels, self._solver.solve(labels, count)
        return self._solved[2]

    def _needed(self, index: int, direction: int, instant: Instant) -> set[int]:
        """The source frames that some shutter exposes; all of the window, where a shutter may lose all of its own."""
        indices = compositor.window_indices(instant.options, index, self.source.count, direction)
        low, high = shutters.open_span(instant.bars)
        needed = indices[low:high] if (indices[low:high] >= 0).all() else indices[indices >= 0]
        return set(needed.tolist())

    def _window_for(self, length: int):
        if self._window is None or self._window.capacity != length:
            self.release_window()
            self._window = self.compositor.window(self.source, length)
        return self._window

    def release_window(self) -> None:
        """Frees the frames; the next picture reads them again."""
        if self._window is not None:
            self._window.release()
            self._window = None

    def close(self) -> None:
        """Frees everything on the device and closes the source."""
        with self.compositor.current():
            self.release_window()
            self._solver.release()
        self.source.close()


def _uniform(labels: np.ndarray, count: int) -> np.ndarray | None:
    """Coefficients (N,) where they are the same everywhere: no scribble, or those of one shutter alone."""
    present = np.unique(labels)
    present = present[present != scribbles.FREE]
    if len(present) > 1:
        return None
    return np.eye(count)[int(present[0]) - 1 if len(present) else 0]
