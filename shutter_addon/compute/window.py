"""The window on a device: the source frames around the shown one. Each is read once while the window contains it."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from ..core import stopping
from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.model import windows
from ..core.model.frame_state import Light, Options
from ..devices import llvmpipe
from ..devices.device import Device, NoDeviceError, Texture
from ..devices.named_textures import NamedTextures
from ..devices.passes import Pass, read_pass

# Bytes of a texture array, at most.
BAND_BYTES = llvmpipe.MOST_BYTES
# What is sent at a time of frames that stay on the host: a share of what the device allows; bytes of a band, at most.
SENT_SHARE, SENT_BYTES = 1 / 8, 64 << 20

# Rows of pixels that one invocation of the passes through frames composes. Bands are a multiple of it high.
BLOCK = 16
# Pixels by which packed frames are larger, as in shaders/include/packed.glsl.
RIM = 5

_STORED = {np.uint8: "rgba8", np.uint16: "rgba16", np.float16: "rgba16f", np.float32: "rgba32f"}


def summable(source: FrameSource) -> bool:
    """Whether running sums can be made of a source: its frames are opaque, of 8 bits."""
    return np.dtype(source.dtype) == np.uint8 and source.alpha == "opaque"


def beside(source: FrameSource, shutters: int) -> int:
    """Bytes that have to be left beside a window: what any pass binds besides, and a frame that is sent. Diffusion
    along edges binds most: four times the coefficients."""
    return source.width * source.height * (16 * (4 * -(-shutters // 4) + 2) + 4)


class Window:
    """What both windows share: texture arrays of `layers` layers, one for each band of rows, so that none is over
    BAND_BYTES; and `picture`, the texture that the compositor draws into.

    Whether it fits depends on sizes and on the device's budget, and not on what is in use just now: so a picture has
    the same bits whatever was rendered before. Where another window needs its room, it is released.

    capacity: the most frames in a window
    shutters: as for running_sums.open_window
    is_open: whether it has its textures; once released, it can show nothing any more
    sends: whether every picture sends the frames anew, for which the device has no room
    anew: whether it makes them anew as well (WeightedFrames): those of all its windows would take more of the host than
    the device may hold
    shot: the source frames that the loaded window may show
    rows, tops: rows of pixels in a band (the last band may have fewer), and the top row of each band
    """

    layers: int
    sends = anew = False

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int) -> None:
        self.device, self.source, self.capacity, self.shutters = device, source, capacity, shutters
        self.shot = range(source.count)
        self.textures: list[Texture] = []
        self.picture: Texture | None = None
        self._extra = NamedTextures(device)  # when they are first asked for
        device.use(self)
        try:
            self._allocate()
        except NoDeviceError:
            self.release()
            raise

    @property
    def is_open(self) -> bool:
        return self.picture is not None

    def _allocate(self) -> None:
        """Makes the texture arrays, and the picture. NoDeviceError: there is no room for all of them; none is kept."""
        raise NotImplementedError

    def _allocate_bands(self, kind: str, pixel_bytes: int) -> None:
        """Makes a texture array of the format `kind` for each band of rows, and the picture."""
        source, row_bytes = self.source, self.source.width * pixel_bytes * self.layers
        self._cut(row_bytes, BAND_BYTES)
        self._check(row_bytes * source.height)
        for top in self.tops:
            self.textures.append(self.device.texture(*self._size(self._height(top)), kind))
        self.picture = self.device.texture(source.width, source.height, 1, "rgba32f")

    def _cut(self, row_bytes: int, most: int) -> None:
        """Cuts the picture into bands of so many bytes at most, but for those of a few rows."""
        self.rows = min(self.source.height, max(1, most // row_bytes // BLOCK) * BLOCK)
        self.tops = range(0, self.source.height, self.rows)

    def _check(self, size: int) -> None:
        """NoDeviceError: a window of so many bytes, with as large ones of the same picture, leaves too little of the
        device's memory."""
        size *= self.source.windows
        if size + beside(self.source, self.shutters) > self.device.budget.limit:
            raise NoDeviceError("over the budget")

    def _size(self, height: int) -> tuple[int, int, int]:
        """The size (width, height, layers) of the texture for a band of so many rows."""
        return self.source.width, height, self.layers

    def _height(self, top: int) -> int:
        return min(self.rows, self.source.height - top)

    def bands(self) -> Iterator[tuple[int, int, Texture]]:
        """Yields (top row, height in pixels, texture array) of each band; the texture is valid until the next one."""
        for top, texture in zip(self.tops, self.textures, strict=True):
            yield top, self._height(top), texture

    def levels(self) -> Texture:
        """The texture that the compositor draws levels into."""
        return self._extra.of("levels", (self.source.width, self.source.height, 1), "rgba8")

    def mixed(self) -> Texture:
        """The texture that pictures of several ways to combine are added up in."""
        return self._extra.of("mixed", (self.source.width, self.source.height, 1), "rgba32f")

    def release(self) -> None:
        for texture in (*self.textures, *filter(None, [self.picture])):
            texture.release()
        self._extra.release()
        self.textures, self.picture = [], None
        self.device.forget(self)


class Frames(Window):
    """A window of the frames as they are: source frame i in layer i mod `layers`.

    Where the device has no room for all bands, the frames stay on the host, and every picture sends them band by band.
    Its bits are the same.
    """

    _kind: str | None = None  # of its textures, if it is not that of the frames

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int = 1) -> None:
        self.layers = capacity
        self._held: dict[int, int] = {}  # layer: source frame
        self._host: dict[int, np.ndarray] | None = None
        # Encoded floats can exceed 1, for which the shaders' curve is not made: they are made linear on the host.
        self._linearises = source.transfer == "srgb" and np.dtype(source.dtype).kind == "f"
        self.transfer = "linear" if self._linearises else source.transfer
        # The linear value of an encoded half can exceed the range of a half.
        stored = np.dtype(np.float32 if self._linearises else source.dtype)
        self.kind, self.pixel_bytes = self._kind or _STORED[stored.type], 8 if self._kind else 4 * stored.itemsize
        super().__init__(device, source, capacity, shutters)

    def _allocate(self) -> None:
        try:
            self._allocate_all()
            return
        except NoDeviceError:
            Window.release(self)
        device, source = self.device, self.source
        device.use(self)
        self._host, self.sends = {}, True
        size = source.width * source.height * self.pixel_bytes * self.capacity * source.windows
        self.anew = source.is_made and size > device.budget.limit
        if self.anew:
            source.keep(self.capacity)
        self._divide(int(device.budget.limit * SENT_SHARE))
        self.picture = device.texture(source.width, source.height, 1, "rgba32f")

    def _allocate_all(self) -> None:
        """Makes what holds all frames, and the picture. NoDeviceError: there is no room."""
        self._allocate_bands(self.kind, self.pixel_bytes)

    def _divide(self, most: int) -> None:
        """Divides what is sent at a time, in parts of so many bytes at most if they can be."""
        self._cut(self.source.width * self.pixel_bytes * self.layers, min(most, SENT_BYTES, BAND_BYTES))

    @property
    def held(self) -> Collection[int]:
        """The source frames that are loaded, a collection of their indices."""
        return self._held.values()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """See running_sums.Sums.load."""
        self.shot = shot
        self.device.use(self)
        for index in sorted(set(windows.source_frames(options, positions, shot).tolist())):
            layer = index % self.capacity
            if self._held.get(layer) == index:
                continue
            self._held.pop(layer, None)  # should it be broken off meanwhile
            if self._host is None:
                self._place(self._read(index), layer)
            elif not self.anew:
                self._host[layer] = self._read(index)
            self._held[layer] = index

    def _place(self, frame: np.ndarray, layer: int) -> None:
        """Sends a frame to its place on the device."""
        for top, height, texture in super().bands():
            self._send(texture, frame[top : top + height], layer)

    def bands(self) -> Iterator[tuple[int, int, Texture]]:
        if self._host is None:
            yield from super().bands()
            return
        frames, texture = self._on_host(), self.device.texture(*self._size(self.rows), self.kind)
        try:
            for top in self.tops:
                height = self._height(top)
                for layer, frame in frames.items():
                    self._send(texture, frame[top : top + height], layer)
                yield top, height, texture
        finally:
            texture.release()

    def _on_host(self) -> dict[int, np.ndarray]:
        """By layer, the frames that a picture is sent."""
        if not self.anew:
            return self._host or {}
        made = {}
        for layer, index in self._held.items():
            stopping.check()
            made[layer] = self._read(index)
        return made

    def _read(self, index: int) -> np.ndarray:
        """The source's frame (height, width, 4) in the samples that are stored."""
        frame = self.source.read(index)
        if self._linearises:
            frame = frame.astype(np.float32, copy=False)
            if self.source.alpha == "premultiplied":
                return light.linearised(frame)
            frame = np.concatenate([light.to_linear(frame[..., :3]), frame[..., 3:]], axis=-1)
        return frame

    def _send(self, texture: Texture, rows: np.ndarray, layer: int) -> None:
        self.device.write(texture, rows, layer, opaque=self.source.alpha == "opaque")

    def release(self) -> None:
        super().release()
        self._held, self._host = {}, None


class WholeFrames(Frames):
    """A window of the frames as they are, each whole: source frame i in slot i mod `capacity`, and as many slots in a
    texture array as BAND_BYTES allow.

    Where the device has no room for all, the frames stay on the host, and every picture sends them.
    layers: slots in a texture array
    """

    def _allocate_all(self) -> None:
        source = self.source
        size = self._texels(source.width, source.height)
        self.rows, self.tops = source.height, range(0, source.height, source.height)
        self._divide(BAND_BYTES)
        self._check(size[0] * size[1] * self.pixel_bytes * self.capacity)
        for _ in range(0, self.capacity, self.layers):
            self.textures.append(self.device.texture(*size, self.layers, self.kind))
        self.picture = self.device.texture(source.width, source.height, 1, "rgba32f")

    def _texels(self, width: int, height: int) -> tuple[int, int]:
        """The size (across, down) of the texture for a frame of so many pixels."""
        return width, height

    def _divide(self, most: int) -> None:
        across, down = self._texels(self.source.width, self.source.height)
        slots = min(most, BAND_BYTES) // (across * down * self.pixel_bytes)
        self.layers = min(self.capacity, max(1, slots), self.device.max_layers)

    def _place(self, frame: np.ndarray, layer: int) -> None:
        self._send(self.textures[layer // self.layers], frame, layer % self.layers)

    def stacks(self) -> Iterator[tuple[range, Texture]]:
        """Yields (slots, texture array) of each array; the texture is valid until the next one."""
        stacks = [range(k, min(k + self.layers, self.capacity)) for k in range(0, self.capacity, self.layers)]
        if self._host is None:
            yield from zip(stacks, self.textures, strict=True)
            return
        size = self._texels(self.source.width, self.source.height)
        frames, texture = self._on_host(), self.device.texture(*size, self.layers, self.kind)
        try:
            for slots in stacks:
                for slot in slots:
                    if slot in frames:
                        self._send(texture, frames[slot], slot - slots.start)
                yield slots, texture
        finally:
            texture.release()


class PackedFrames(WholeFrames):
    """A window of whole opaque 8-bit frames, in the light that is summed and quick to read (shaders/pack.glsl)."""

    _kind = "rgba16ui"

    _light: Light = "linear"

    def _allocate(self) -> None:
        super()._allocate()
        self._sent()

    def _sent(self) -> Texture:
        """The texture that a frame is sent to."""
        return self._extra.of("sent", (self.source.width, self.source.height, 1), "rgba8")

    def _texels(self, width: int, height: int) -> tuple[int, int]:
        return width + RIM, height + RIM

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        if options.light != self._light:
            self._light = options.light
            self._held.clear()
        super().load(positions, options, shot)

    def _send(self, texture: Texture, rows: np.ndarray, layer: int) -> None:
        size, sent = (self.source.width, self.source.height), self._sent()
        self.device.write(sent, rows, opaque=True)
        program = packing(decoding(self.source.transfer, self._light), self._light == "linear")
        textures, images = {"frame": sent}, {"packed_frames": texture}
        extent = self._texels(*size)
        self.device.run(program, extent, textures=textures, images=images, size=size, layer=layer)


def packing(decode: int, squared: bool) -> Pass:
    """The pass that packs a frame; decode: of `decoding`; squared: what is summed is linear light."""
    return read_pass("pack", DECODE=decode, SQUARED=int(squared))


def decoding(stored: str, light: str) -> int:
    """DECODE of the shaders, how samples become the light that is summed (Options.light): 0 unchanged, 1 made linear,
    2 made encoded. stored: the samples' transfer, "srgb" or "linear"."""
    summed = "srgb" if light == "encoded" else "linear"
    return 0 if stored == summed else 1 if summed == "linear" else 2
