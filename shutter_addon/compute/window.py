"""The window on a device: the source frames around the one that is shown, each read once while it stays there."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..core import compositor, light
from ..core.frame_state import Options
from .device import NoDeviceError
from .passes import Image, Pass
from .running_sums import RunningSums, summable

# A layered texture over 2 GiB reads wrongly on Mesa's software renderer, without any error.
BAND_BYTES = 1 << 30
# A window above this stays on the host, and its bands take turns on the device.
RESIDENT_BYTES = 6 << 30

# Pixels above one another that one invocation composes, going through the frames.
BLOCK = 16
# Of running sums, in pixels (across, down), as in shaders/include/sums.glsl.
TILE = 8, 4

_STORED = {np.uint8: "rgba8", np.uint16: "rgba16", np.float16: "rgba16f", np.float32: "rgba32f"}


def open_window(device, source, capacity: int) -> Window:
    """The window of `capacity` frames that composes fastest: running sums where 8 bits are summed and the device has
    room for them."""
    if summable(source):
        try:
            return Sums(device, source, capacity)
        except NoDeviceError:
            pass
    return Frames(device, source, capacity)


class Window:
    """What both windows share: texture arrays of `layers` layers in bands of rows, each array below BAND_BYTES, and
    `picture`, what is composed of them."""

    def __init__(self, device, source, capacity: int):
        self.device, self.source, self.capacity = device, source, capacity
        self.shot = range(source.count)
        self.textures: list = []
        self.picture = None

    def _allocate(self, kind: str, pixel_bytes: int) -> None:
        """NoDeviceError: no room, and nothing is kept."""
        source, row_bytes = self.source, self.source.width * pixel_bytes * self.layers
        self.rows = min(source.height, max(1, BAND_BYTES // row_bytes // BLOCK) * BLOCK)
        self.tops = range(0, source.height, self.rows)
        try:
            if row_bytes * source.height > RESIDENT_BYTES:
                raise NoDeviceError("over the budget")
            for top in self.tops:
                size = self._texels(source.width, self._height(top))
                self.textures.append(self.device.texture(*size, self.layers, kind))
            self.picture = self.device.texture(source.width, source.height, 1, "rgba32f")
        except NoDeviceError:
            self.release()
            raise

    def _texels(self, width: int, height: int) -> tuple[int, int]:
        """The texels (across, down) of a band's pixels."""
        return width, height

    def _height(self, top: int) -> int:
        return min(self.rows, self.source.height - top)

    def bands(self):
        """Each band as (top row, height, texture array)."""
        for top, texture in zip(self.tops, self.textures, strict=True):
            yield top, self._height(top), texture

    def release(self) -> None:
        for texture in (*self.textures, *filter(None, [self.picture])):
            texture.release()
        self.textures, self.picture = [], None


class Frames(Window):
    """The frames themselves: source frame i in layer i mod `layers`.

    Where the device has no room for all bands, the frames stay on the host and every picture sends them band by band.
    """

    def __init__(self, device, source, capacity: int):
        super().__init__(device, source, capacity)
        self.layers = capacity
        self._held: dict[int, int] = {}  # layer: source frame
        self._host: dict[int, np.ndarray] | None = None
        # Encoded floats may be above 1, beyond the shaders' curve.
        self._linearises = source.transfer == "srgb" and np.dtype(source.dtype).kind == "f"
        self.transfer = "linear" if self._linearises else source.transfer
        # And linear, what a half holds may be more than a half holds.
        stored = np.dtype(np.float32 if self._linearises else source.dtype)
        kind, pixel_bytes = _STORED[stored.type], 4 * stored.itemsize
        try:
            self._allocate(kind, pixel_bytes)
        except NoDeviceError:
            self._host = {}
            self.textures = [device.texture(source.width, self.rows, capacity, kind)]
            self.picture = device.texture(source.width, source.height, 1, "rgba32f")

    @property
    def held(self):
        """The source frames that are loaded."""
        return self._held.values()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """As RunningSums.load."""
        self.shot = shot
        for index in sorted(set(compositor.source_frames(options, positions, shot).tolist())):
            layer = index % self.capacity
            if self._held.get(layer) == index:
                continue
            frame = self._read(index)
            if self._host is None:
                for top, height, texture in super().bands():
                    self._send(texture, frame[top : top + height], layer)
            else:
                self._host[layer] = frame
            self._held[layer] = index

    def bands(self):
        if self._host is None:
            yield from super().bands()
            return
        for top in self.tops:
            height = self._height(top)
            for layer, frame in self._host.items():
                self._send(self.textures[0], frame[top : top + height], layer)
            yield top, height, self.textures[0]

    def _read(self, index: int) -> np.ndarray:
        frame = self.source.read(index)
        if self._linearises:
            frame = frame.astype(np.float32, copy=False)
            if self.source.alpha == "premultiplied":
                return light.linearised(frame)
            frame = np.concatenate([light.to_linear(frame[..., :3]), frame[..., 3:]], axis=-1)
        return frame

    def _send(self, texture, rows: np.ndarray, layer: int) -> None:
        self.device.write(texture, rows, layer, opaque=self.source.alpha == "opaque")

    def release(self) -> None:
        super().release()
        self._held, self._host = {}, None


def decoding(stored: str, options: Options) -> int:
    """How the shaders turn frames stored as "srgb" or "linear" into the light that is summed: 0 not at all, 1 to
    linear, 2 to encoded."""
    summed = "srgb" if options.light == "encoded" else "linear"
    return 0 if stored == summed else 1 if summed == "linear" else 2


def stores_rows(device) -> bool:
    """Whether textures lie in memory row by row, as Mesa's software renderer has them; a GPU has tiles of its own."""
    return "llvmpipe" in device.name


def _in_tiles(width: int, height: int) -> tuple[int, int]:
    """The texels (across, down) for pixels in tiles, with all that the last block of pixels reaches. A tile's row more
    across, lest all rows begin in the same sets of a cache."""
    across, down = TILE
    return across * down * -(-width // across) + across, -(-height // BLOCK) * BLOCK // down


@cache
def accumulation(decode: int, again: bool, back: bool, tiled: bool) -> Pass:
    """The pass that adds a frame to the sums, or takes it away (back); again: one that they hold already."""
    return Pass(
        "accumulate",
        samplers={} if again else {"frame": "sampler2DArray"},
        images={"sums": Image("rg32ui", reads=True)},
        constants={"size": "ivec2", "known": "int", "next": "int"}
        | ({"before": "int", "after": "int"} if again else {"top": "int", "whole": "float"}),
        defines={"DECODE": decode, "AGAIN": int(again), "BACK": int(back), "TILED": int(tiled)},
        local_size=(64, TILE[1], 1),
    )


class Sums(RunningSums, Window):
    """Running sums of opaque 8-bit frames."""

    def __init__(self, device, source, capacity: int):
        Window.__init__(self, device, source, capacity)
        RunningSums.__init__(self, source, capacity)
        # Three fields of 21 bits: as many of them for white as leave room for the sum of a whole window.
        self.whole = (1 << min(16, 21 - (capacity - 1).bit_length())) - 1
        # Neighbours look up other layers; in tiles, what a workgroup reads of a layer lies in one run of memory.
        self.tiled = stores_rows(device) and _in_tiles(source.width, 1)[0] <= device.max_size
        self._sent = None
        self._allocate("rg32ui", 8)
        try:
            self._sent = device.texture(source.width, source.height, 1, "rgba8")
        except NoDeviceError:
            self.release()
            raise

    def _texels(self, width: int, height: int) -> tuple[int, int]:
        return _in_tiles(width, height) if self.tiled else (width, height)

    def _add(self, frame: int, same: int | None, known: int, next_: int) -> None:
        program = accumulation(
            decoding(self.source.transfer, self._options), same is not None, next_ < known, self.tiled
        )
        given = {"known": known % self.layers, "next": next_ % self.layers}
        if same is None:
            self.device.write(self._sent, self.source.read(frame), opaque=True)
            given |= {"textures": {"frame": self._sent}, "whole": float(self.whole)}
        else:
            given |= {"before": same % self.layers, "after": (same + 1) % self.layers}
        for top, height, sums in self.bands():
            size = self.source.width, height
            self.device.run(program, size, images={"sums": sums}, size=size, top=top, **given)

    def release(self) -> None:
        RunningSums.release(self)
        Window.release(self)
        if self._sent is not None:
            self._sent.release()
