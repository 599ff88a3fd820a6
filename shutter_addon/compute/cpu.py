"""Compositing with NumPy: the last resort, where there is no GL."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np

from ..core import compositor, light, shutters
from ..core.instant import Instant, Options
from .diffusion import diffuse

# Pixels that are composed together: what they need at a time stays within the processor's cache.
_BLOCK_PIXELS = 1 << 14


class Window:
    """The frames of a source that a window needs, on the host; as gpu.Window."""

    def __init__(self, source, capacity: int):
        self.source, self.capacity = source, capacity
        self.frames: dict[int, np.ndarray] = {}

    @property
    def held(self):
        return self.frames.keys()

    def load(self, positions: np.ndarray, options: Options) -> None:
        wanted = set(compositor.source_frames(options, positions, self.source.count).tolist())
        for index in self.frames.keys() - wanted:
            del self.frames[index]
        for index in sorted(wanted - self.frames.keys()):
            self.frames[index] = self.source.read(index)

    def release(self) -> None:
        self.frames = {}


class Solver:
    """compute.diffusion as compute.diffusion_gpu's class Diffusion; it never starts from the last solution."""

    def solve(self, labels: np.ndarray, count: int, *, warm: bool = False) -> np.ndarray:
        return diffuse(labels, count)

    def release(self) -> None:
        pass


class CPUCompositor:
    """Composes with NumPy; the same methods as GPUCompositor."""

    name = "NumPy"

    def current(self):
        return nullcontext(self)

    def window(self, source, capacity: int) -> Window:
        return Window(source, capacity)

    def solver(self) -> Solver:
        return Solver()

    def constant(self, values: np.ndarray) -> np.ndarray:
        return np.asarray(values, dtype=np.float32)[:, None, None]

    def coefficients(self, handle: np.ndarray, count: int) -> np.ndarray:
        return handle[:count]

    def read(self, drawn: np.ndarray) -> np.ndarray:
        return drawn

    def draw(self, window: Window, index: int, direction: int, instant: Instant, handle, block: int) -> np.ndarray:
        """The picture (H, W, 4) float32, top row first; arguments as for GPUCompositor.draw."""
        source = window.source
        indices = compositor.window_indices(instant.options, index, source.count, direction)
        summed = "srgb" if instant.options.light == "encoded" else "linear"
        values_of = _values(source, summed)
        picture = np.empty((source.height, source.width, 4), dtype=np.float32)
        rows = max(1, _BLOCK_PIXELS // source.width)
        gains = instant.gains
        weigh = _displaced if instant.options.interpolation == "displacement" else _mixed
        for top in range(0, source.height, rows):
            band = slice(top, min(top + rows, source.height))
            c = _block_rows(handle, band, block, source.width)
            picture[band] = _expose(weigh(instant.bars, c), indices, window.frames, band, values_of)
            if summed == "srgb":
                picture[band] = light.premultiplied(light.straight(picture[band]), light.to_linear)
            picture[band, :, :3] *= np.tensordot(gains, c, axes=1)[..., None]
        return picture

    def release(self) -> None:
        pass


def _block_rows(handle: np.ndarray, band: slice, block: int, width: int) -> np.ndarray:
    """Coefficients (N, rows, width) of a band, or (N, 1, 1) where they are the same everywhere."""
    if handle.shape[1:] == (1, 1):
        return handle.astype(np.float64)
    rows = np.arange(band.start, band.stop) // block
    c = handle[:, rows][:, :, np.arange(width) // block].astype(np.float64)
    return c / c.sum(axis=0)


def _displaced(bars: np.ndarray, c: np.ndarray):
    """Yields (frame, weight) of the interpolated shutter for coefficients (N, …), frames without weight left out."""
    knots = shutters.knots(bars)
    start, end = np.tensordot(knots.start, c, axes=1), np.tensordot(knots.end, c, axes=1)
    density = np.diff(knots.z)[:, None, None] / (end - start)
    low, high = start.min(axis=(1, 2)), end.max(axis=(1, 2))
    for frame in range(bars.shape[1]):
        pieces = np.flatnonzero((low < frame + 1) & (high > frame))
        if len(pieces):
            open_time = np.minimum(end[pieces], frame + 1) - np.maximum(start[pieces], frame)
            yield frame, (np.maximum(open_time, 0) * density[pieces]).sum(axis=0)


def _mixed(bars: np.ndarray, c: np.ndarray):
    """As _displaced, by value interpolation."""
    weights = np.tensordot((bars / bars.sum(axis=1, keepdims=True)).T, c, axes=1)
    yield from ((frame, weights[frame]) for frame in np.flatnonzero(bars.any(axis=0)))


def _expose(weighted, indices, frames, band: slice, values_of) -> np.ndarray:
    """Σ weight · frame over a band, the weight of frames left out (index −1) given to the others."""
    total, share, centre = 0.0, 0.0, 0.0
    for frame, weight in weighted:
        centre = centre + weight * (frame + 0.5)
        if indices[frame] >= 0 and weight.max() > 1e-6:
            total = total + weight[..., None] * values_of(frames[indices[frame]][band])
            share = share + weight
    alone = np.broadcast_to(share <= 1e-6, np.shape(centre))
    picture = total / np.maximum(share, 1e-6)[..., None] if np.ndim(total) else None
    if not alone.any():
        return picture
    shape = frames[next(iter(frames))][band].shape
    picture = np.zeros(shape) if picture is None else picture
    present = np.flatnonzero(np.asarray(indices) >= 0)
    nearest = present[np.abs(centre[..., None] - (present + 0.5)).argmin(axis=-1)]
    for frame in np.unique(nearest[alone]):
        chosen = np.broadcast_to((alone & (nearest == frame)), shape[:2])
        picture[chosen] = values_of(frames[indices[frame]][band])[chosen]
    return picture


def _values(source, summed: str):
    """A function from stored samples (…, 4) to premultiplied float32 in the light that is summed."""
    convert = None
    if source.transfer != summed:
        convert = light.to_linear if summed == "linear" else light.to_encoded
    stored = np.dtype(source.dtype)
    most = np.iinfo(stored).max if stored.kind == "u" else 1
    curve = np.arange(most + 1, dtype=np.float32) / np.float32(most) if stored.kind == "u" else None
    if convert and curve is not None:
        curve = convert(curve)

    def values_of(samples: np.ndarray) -> np.ndarray:
        rgba = samples.astype(np.float32) / np.float32(most)
        if source.alpha == "premultiplied":
            return light.premultiplied(light.straight(rgba), convert) if convert else rgba
        if curve is not None:
            rgba[..., :3] = curve[samples[..., :3]]
        elif convert:
            rgba[..., :3] = convert(rgba[..., :3])
        if source.alpha == "straight":
            rgba[..., :3] *= rgba[..., 3:]
        return rgba

    return values_of
