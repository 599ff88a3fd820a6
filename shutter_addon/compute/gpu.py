"""Compositing on a device with compute shaders: the window of frames in texture arrays, one pass per picture."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..core import compositor, light, shutters
from ..core.instant import Instant, Options
from .diffusion_gpu import Diffusion
from .errors import NoDeviceError
from .passes import Image, Pass
from .tables import padded, table

# A layered texture over 2 GiB reads wrongly on Mesa's software renderer, without any error.
BAND_BYTES = 1 << 30
# A window above this stays on the host, and its bands take turns on the device.
RESIDENT_BYTES = 6 << 30

# Pixels above one another that one invocation composes.
BLOCK = 16

_STORED = {np.uint8: "rgba8", np.uint16: "rgba16", np.float16: "rgba16f", np.float32: "rgba32f"}

_EDGES = {"hold": 0, "mirror": 1, "shorten": 2}
_SAMPLERS = dict.fromkeys(("frames", "coefficients", "table"), "sampler2DArray")
_CONSTANTS = {"size": "ivec2"} | dict.fromkeys(
    (
        "top",
        "height",
        "aggregate",
        "origin",
        "direction",
        "count",
        "capacity",
        "lowest",
        "lowest_layer",
    ),
    "int",
)
# Blender knows only of constants that a source uses.
_OF_WAY = {"pieces": ("rows",), "frames": ("rows", "first", "last"), "value": ("first", "last")}


@cache
def _composition(options: Options, way: str, groups: int, stored: str, premultiplied: bool) -> Pass:
    """The pass that composes in a way of `_way`, shutters in groups of four, frames stored as "srgb" or "linear"."""
    summed = "srgb" if options.light == "encoded" else "linear"
    decode = 0 if stored == summed else 1 if summed == "linear" else 2
    return Pass(
        f"compose_{way}",
        samplers=_SAMPLERS,
        images={"picture": Image("rgba32f")},
        constants=_CONSTANTS | dict.fromkeys(_OF_WAY[way], "int"),
        defines={
            "GROUPS": groups,
            "EDGES": _EDGES[options.edges],
            "DECODE": decode,
            "PREMULTIPLIED": int(premultiplied),
            "ENCODED": int(summed == "srgb"),
        },
    )


def _way(options: Options, rows: int, frames: int) -> str:
    """The quickest pass for so many rows of the table and frames that any shutter exposes."""
    if options.interpolation == "value":
        return "value"
    # Measured for 1, 2 and 4 shutters over 16 and 64 frames, in times of the plain average: piece by piece about
    # 1.5 + 1.4 · rows / frames, frame by frame 2.1 to 2.8.
    return "pieces" if 3 * rows < 2 * frames else "frames"


class Window:
    """The frames of a source that a window of `capacity` needs, each read once while it stays in the window.

    Source frame i lies in layer i mod capacity. Bands of rows, each a texture array of its own below BAND_BYTES; where
    the device has no room for all of them, the frames stay on the host and every picture sends them band by band.
    `picture` is what is composed of them.
    """

    def __init__(self, device, source, capacity: int):
        self._device, self.source, self.capacity = device, source, capacity
        self._held: dict[int, int] = {}  # layer: source frame
        self._kind = _STORED[np.dtype(source.dtype).type]
        # Encoded floats may be above 1, beyond the shaders' curve.
        self._linearises = source.transfer == "srgb" and np.dtype(source.dtype).kind == "f"
        self.transfer = "linear" if self._linearises else source.transfer
        row_bytes = source.width * 4 * np.dtype(source.dtype).itemsize * capacity
        rows = max(1, min(source.height, BAND_BYTES // row_bytes))
        self._tops = range(0, source.height, rows)
        self._heights = [min(rows, source.height - top) for top in self._tops]
        self._textures: list = []
        self._host: dict[int, np.ndarray] | None = None
        try:
            if row_bytes * source.height > RESIDENT_BYTES:
                raise NoDeviceError("over the budget")
            for height in self._heights:
                self._textures.append(device.texture(source.width, height, capacity, self._kind))
        except NoDeviceError:
            self._free_textures()
            self._host = {}
            self._textures = [device.texture(source.width, rows, capacity, self._kind)]
        self.picture = device.texture(source.width, source.height, 1, "rgba32f")

    @property
    def held(self):
        """The source frames that are loaded."""
        return self._held.values()

    def load(self, wanted) -> None:
        """Reads what is missing of the source frames `wanted`, which lie within `capacity` of one another."""
        for index in sorted(wanted):
            layer = index % self.capacity
            if self._held.get(layer) == index:
                continue
            frame = self._read(index)
            if self._host is None:
                self._write(frame, layer)
            else:
                self._host[layer] = frame
            self._held[layer] = index

    def bands(self):
        """Each band as (top row, height, texture array)."""
        for band, (top, height) in enumerate(zip(self._tops, self._heights, strict=True)):
            if self._host is None:
                yield top, height, self._textures[band]
                continue
            for layer, frame in self._host.items():
                self._send(self._textures[0], frame[top : top + height], layer)
            yield top, height, self._textures[0]

    def _read(self, index: int) -> np.ndarray:
        frame = self.source.read(index)
        if self._linearises:
            rgb = light.straight(frame)[..., :3] if self.source.alpha == "premultiplied" else frame[..., :3]
            scale = frame[..., 3:] if self.source.alpha == "premultiplied" else 1
            frame = np.concatenate([light.to_linear(rgb) * scale, frame[..., 3:]], axis=-1)
        return frame

    def _write(self, frame: np.ndarray, layer: int) -> None:
        for texture, top, height in zip(self._textures, self._tops, self._heights, strict=True):
            self._send(texture, frame[top : top + height], layer)

    def _send(self, texture, rows: np.ndarray, layer: int) -> None:
        self._device.write(texture, rows, layer, opaque=self.source.alpha == "opaque")

    def _free_textures(self) -> None:
        for texture in self._textures:
            texture.release()
        self._textures = []

    def release(self) -> None:
        self._free_textures()
        self.picture.release()
        self._held, self._host = {}, None


class GPUCompositor:
    """Composes on a device; the same methods as CPUCompositor."""

    def __init__(self, device):
        self.name = device.name
        self.device = device
        self._textures: dict[str, object] = {}

    def current(self):
        """What calls belong inside of: the device's context, on whatever thread renders."""
        return self.device.current()

    def window(self, source, capacity: int) -> Window:
        return Window(self.device, source, capacity)

    def solver(self) -> Diffusion:
        """A diffusion whose solution stays valid until it solves again."""
        return Diffusion(self.device)

    def constant(self, values: np.ndarray):
        """The same coefficients (N,) everywhere, on the device."""
        return self._filled("constant", padded(values).astype(np.float32)[:, None, None, :], "rgba32f")

    def labels(self, values: np.ndarray):
        """Labels (H, W) uint16 on the device."""
        return self._filled("labels", values[None, ..., None], "r16ui")

    def coefficients(self, handle, count: int) -> np.ndarray:
        """Coefficients (N, h, w) float32 of what a solver or `constant` gave."""
        values = self.device.read(handle)
        return np.moveaxis(values, -1, 1).reshape(-1, *values.shape[1:3])[:count]

    def read(self, drawn) -> np.ndarray:
        """What `draw` gave, as an array (H, W, 4) float32, top row first."""
        return self.device.read(drawn)[0, ::-1]

    def draw(self, window: Window, index: int, direction: int, instant: Instant, handle, block: int):
        """The picture on the device, the window's until it is drawn into again: a texture array rgba32f of one layer,
        scene-linear and premultiplied, bottom row first.

        index, direction: as for core.compositor.window_indices; what is needed of the window is loaded.
        handle: coefficients, of which `block` × `block` pixels share one.
        """
        source, options = window.source, instant.options
        values = table(instant)
        textures = {"table": self._filled("table", values[None], "rgba32f"), "coefficients": handle}
        groups = -(-len(instant.bars) // 4)
        first, last = shutters.open_span(instant.bars)
        way = _way(options, len(values) - 1, last - first)
        program = _composition(options, way, groups, window.transfer, source.alpha == "premultiplied")
        indices = compositor.window_indices(options, index, source.count, direction)
        lowest = int(indices[indices >= 0].min())
        for top, height, frames in window.bands():
            self.device.run(
                program,
                (source.width, -(-height // BLOCK)),
                textures=textures | {"frames": frames},
                images={"picture": window.picture},
                size=(source.width, height),
                top=top,
                height=source.height,
                aggregate=block,
                rows=len(values) - 1,
                first=first,
                last=last,
                origin=index - direction * options.before,
                direction=direction,
                count=source.count,
                capacity=window.capacity,
                lowest=lowest,
                lowest_layer=lowest % window.capacity,
            )
        return window.picture

    def _texture(self, name: str, width: int, height: int, layers: int, kind: str):
        texture = self._textures.get(name)
        if texture is None or texture.size != (width, height, layers):
            if texture is not None:
                texture.release()
            texture = self._textures[name] = self.device.texture(width, height, layers, kind)
        return texture

    def _filled(self, name: str, values: np.ndarray, kind: str):
        layers, height, width, _ = values.shape
        texture = self._texture(name, width, height, layers, kind)
        for layer in range(layers):
            self.device.write(texture, np.ascontiguousarray(values[layer]), layer)
        return texture

    def release(self) -> None:
        with self.device.current():
            for texture in self._textures.values():
                texture.release()
        self.device.release()
