"""Compositing on a device with compute shaders: the window of frames in texture arrays, one pass per picture."""

from __future__ import annotations

import numpy as np

from ..core.recipe import Instant
from .diffusion import Diffusion
from .gl import NoGLError
from .passes import Image, Pass
from .tables import padded, table

# A layered texture over 2 GiB reads wrongly on Mesa's software renderer, without any error.
BAND_BYTES = 1 << 30
# A window above this stays on the host, and its bands take turns on the device.
RESIDENT_BYTES = 6 << 30

_STORED = {np.uint8: "rgba8", np.uint16: "rgba16", np.float16: "rgba16f", np.float32: "rgba32f"}

_COMPOSE = {
    interpolation: Pass(
        f"compose_{interpolation}",
        samplers={
            "frames": "sampler2DArray",
            "slots": "sampler2DArray",
            "coefficients": "sampler2DArray",
            "table": "sampler2DArray",
        },
        images={"picture": Image("rgba32f")},
        constants={
            "size": "ivec2",
            "top": "int",
            "height": "int",
            "aggregate": "int",
            "groups": "int",
            "rows": "int",
            "window": "int",
            "decode": "int",
            "premultiplied": "int",
            "encoded": "int",
        },
    )
    for interpolation in ("displacement", "value")
}


class Window:
    """The frames of a source that a window of `capacity` needs, each read once while it stays in the window.

    Bands of rows, each a texture array of its own below BAND_BYTES. Where the device has no room for all of them,
    the frames stay on the host and every picture sends them band by band.
    """

    def __init__(self, device, source, capacity: int):
        self._device, self.source, self.capacity = device, source, capacity
        self._layer_of: dict[int, int] = {}
        self._kind = _STORED[np.dtype(source.dtype).type]
        row_bytes = source.width * 4 * np.dtype(source.dtype).itemsize * capacity
        rows = max(1, min(source.height, BAND_BYTES // row_bytes))
        self._tops = range(0, source.height, rows)
        self._heights = [min(rows, source.height - top) for top in self._tops]
        self._textures: list = []
        self._host: dict[int, np.ndarray] | None = None
        try:
            if row_bytes * source.height > RESIDENT_BYTES:
                raise NoGLError("over the budget")
            for height in self._heights:
                self._textures.append(device.texture(source.width, height, capacity, self._kind))
        except NoGLError:
            self._free_textures()
            self._host = {}
            self._textures = [device.texture(source.width, rows, capacity, self._kind)]

    def load(self, wanted) -> None:
        """Reads what is missing of the source frames `wanted`, at most `capacity` different ones."""
        wanted = set(wanted)
        missing = sorted(wanted - self._layer_of.keys())
        if not missing:
            return
        for index in self._layer_of.keys() - wanted:
            del self._layer_of[index]
            if self._host is not None:
                del self._host[index]
        free = sorted(set(range(self.capacity)) - set(self._layer_of.values()))
        for index, layer in zip(missing, free, strict=False):
            frame = self.source.read(index)
            if self._host is not None:
                self._host[index] = frame
            else:
                self._write(frame, layer)
            self._layer_of[index] = layer

    def layers(self, indices) -> np.ndarray:
        """Layer of each source frame, −1 for −1."""
        return np.array([self._layer_of[i] if i >= 0 else -1 for i in indices], dtype=np.float32)

    def bands(self):
        """Each band as (top row, height, texture array)."""
        for band, (top, height) in enumerate(zip(self._tops, self._heights, strict=True)):
            if self._host is None:
                yield top, height, self._textures[band]
                continue
            for index, layer in self._layer_of.items():
                self._device.write(self._textures[0], self._host[index][top : top + height], layer)
            yield top, height, self._textures[0]

    def _write(self, frame: np.ndarray, layer: int) -> None:
        for texture, top, height in zip(self._textures, self._tops, self._heights, strict=True):
            self._device.write(texture, frame[top : top + height], layer)

    def _free_textures(self) -> None:
        for texture in self._textures:
            texture.release()
        self._textures = []

    def release(self) -> None:
        self._free_textures()
        self._layer_of, self._host = {}, None


class GPUCompositor:
    """Composes on a device; the same methods as CPUCompositor."""

    def __init__(self, device):
        self.name = device.name
        self._device = device
        self._textures: dict[str, object] = {}

    def current(self):
        """What calls belong inside of: the device's context, on whatever thread renders."""
        return self._device.current()

    def window(self, source, capacity: int) -> Window:
        return Window(self._device, source, capacity)

    def solver(self) -> Diffusion:
        """A diffusion whose solution stays valid until it solves again."""
        return Diffusion(self._device)

    def constant(self, values: np.ndarray):
        """The same coefficients (N,) everywhere, on the device."""
        return self._filled("constant", padded(values).astype(np.float32)[:, None, None, :], "rgba32f")

    def coefficients(self, handle, count: int) -> np.ndarray:
        """Coefficients (N, h, w) float32 of what a solver or `constant` gave."""
        values = self._device.read(handle)
        return np.moveaxis(values, -1, 1).reshape(-1, *values.shape[1:3])[:count]

    def compose(self, window: Window, indices, instant: Instant, handle, block: int) -> np.ndarray:
        """The picture (H, W, 4) float32, scene-linear and premultiplied, top row first.

        indices: L source frames, −1 left out, all loaded; block: pixels that share a coefficient.
        """
        source, options = window.source, instant.options
        values = table(instant)
        textures = {
            "slots": self._filled("slots", window.layers(indices)[None, None, :, None], "r32f"),
            "table": self._filled("table", values[None], "rgba32f"),
            "coefficients": handle,
        }
        picture = self._texture("picture", source.width, source.height, 1, "rgba32f")
        stored, summed = source.transfer, "srgb" if options.light == "encoded" else "linear"
        for top, height, frames in window.bands():
            self._device.run(
                _COMPOSE[options.interpolation],
                (source.width, height),
                textures=textures | {"frames": frames},
                images={"picture": picture},
                size=(source.width, height),
                top=top,
                height=source.height,
                aggregate=block,
                groups=-(-len(instant.bars) // 4),
                rows=len(values) - 1,
                window=options.window,
                decode=0 if stored == summed else 1 if summed == "linear" else 2,
                premultiplied=int(source.alpha == "premultiplied"),
                encoded=int(summed == "srgb"),
            )
        return self._device.read(picture)[0, ::-1]

    def _texture(self, name: str, width: int, height: int, layers: int, kind: str):
        texture = self._textures.get(name)
        if texture is None or texture.size != (width, height, layers):
            if texture is not None:
                texture.release()
            texture = self._textures[name] = self._device.texture(width, height, layers, kind)
        return texture

    def _filled(self, name: str, values: np.ndarray, kind: str):
        layers, height, width, _ = values.shape
        texture = self._texture(name, width, height, layers, kind)
        for layer in range(layers):
            self._device.write(texture, np.ascontiguousarray(values[layer]), layer)
        return texture

    def release(self) -> None:
        with self._device.current():
            for texture in self._textures.values():
                texture.release()
        self._device.release()
