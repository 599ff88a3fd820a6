"""The window on a device: the source frames around the shown one. Each is read once while the window contains it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from ..core import stopping
from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.frames.planes import Planes, chroma_step
from ..core.model import windows
from ..core.model.frame_state import Light, Options
from ..devices import llvmpipe
from ..devices.device import Device, NoDeviceError, Texture
from ..devices.paging import TEXEL_BYTES
from ..devices.passes import Pass, read_pass
from .running_sums import RunningSums, summable

# Bytes of a texture array, at most.
BAND_BYTES = llvmpipe.MOST_BYTES
# What is sent at a time of frames that stay on the host: a share of what the device allows; bytes of a band, at most.
SENT_SHARE, SENT_BYTES = 1 / 8, 64 << 20

# Rows of pixels that one invocation of the passes through frames composes. Bands are a multiple of it high.
BLOCK = 16
# Pixels by which packed frames are larger, as in shaders/include/packed.glsl.
RIM = 5
# A tile of running sums in pixels (across, down), as in shaders/include/sums.glsl.
TILE = 8, BLOCK

_STORED = {np.uint8: "rgba8", np.uint16: "rgba16", np.float16: "rgba16f", np.float32: "rgba32f"}


def open_window(
    device: Device, source: FrameSource, capacity: int, moved: bool, shutters: int, summed: bool = True
) -> Window:
    """The fastest window of `capacity` frames: running sums if the source is `summable` and the device has room for
    them, else the frames. moved: what is seen of a frame lies elsewhere in it, so it has to be whole. shutters: those
    whose coefficients have to have room beside it. summed: all that is made of the frames are sums of them."""
    if moved:
        return (PackedFrames if summable(source) else WholeFrames)(device, source, capacity, shutters)
    if summed and summable(source):
        try:
            return Sums(device, source, capacity, shutters)
        except NoDeviceError:
            pass
    return Frames(device, source, capacity, shutters)


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
    shutters: as for open_window
    is_open: whether it has its textures; once released, it can show nothing any more
    sends: whether every picture sends the frames anew, for which the device has no room
    anew: whether it makes them anew as well (WeightedFrames): those of all its windows would take more of the host than
    the device may hold
    shot: the source frames that the loaded window may show
    rows, tops: rows of pixels in a band (the last band may have fewer), and the top row of each band
    """

    layers: int
    sends = anew = False

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int):
        self.device, self.source, self.capacity, self.shutters = device, source, capacity, shutters
        self.shot = range(source.count)
        self.textures: list[Texture] = []
        self.picture: Texture | None = None
        self._levels: Texture | None = None
        self._mixed: Texture | None = None
        device.use(self)

    @property
    def is_open(self) -> bool:
        return self.picture is not None

    def _allocate(self, kind: str, pixel_bytes: int) -> None:
        """Makes the texture arrays, of the format `kind`, and the picture. NoDeviceError: there is no room for all of
        them; none is kept."""
        source, row_bytes = self.source, self.source.width * pixel_bytes * self.layers
        self._cut(row_bytes, BAND_BYTES)
        try:
            self._check(row_bytes * source.height)
            for top in self.tops:
                self.textures.append(self.device.texture(*self._size(self._height(top)), kind))
            self.picture = self.device.texture(source.width, source.height, 1, "rgba32f")
        except NoDeviceError:
            self.release()
            raise

    def _cut(self, row_bytes: int, most: int) -> None:
        """Cuts the picture into bands of so many bytes at most, but for those of a few rows."""
        self.rows = min(self.source.height, max(1, most // row_bytes // BLOCK) * BLOCK)
        self.tops = range(0, self.source.height, self.rows)

    def _check(self, size: int) -> None:
        """NoDeviceError: a window of so many bytes, with as large ones of the same picture, leaves too little of the
        device's memory."""
        size *= getattr(self.source, "windows", 1)
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
        """The texture that the compositor draws levels into, made when it is first asked for."""
        if self._levels is None:
            self._levels = self.device.texture(self.source.width, self.source.height, 1, "rgba8")
        return self._levels

    def mixed(self) -> Texture:
        """The texture that pictures of several ways to combine are added up in, made when it is first asked for."""
        if self._mixed is None:
            self._mixed = self.device.texture(self.source.width, self.source.height, 1, "rgba32f")
        return self._mixed

    def release(self) -> None:
        for texture in (*self.textures, *filter(None, [self.picture, self._levels, self._mixed])):
            texture.release()
        self.textures, self.picture, self._levels, self._mixed = [], None, None, None
        self.device.forget(self)


class Frames(Window):
    """A window of the frames as they are: source frame i in layer i mod `layers`.

    Where the device has no room for all bands, the frames stay on the host, and every picture sends them band by band.
    Its bits are the same.
    """

    _kind: str | None = None  # of its textures, if it is not that of the frames

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int = 1):
        super().__init__(device, source, capacity, shutters)
        self.layers = capacity
        self._held: dict[int, int] = {}  # layer: source frame
        self._host: dict[int, np.ndarray] | None = None
        # Encoded floats can exceed 1, for which the shaders' curve is not made: they are made linear on the host.
        self._linearises = source.transfer == "srgb" and np.dtype(source.dtype).kind == "f"
        self.transfer = "linear" if self._linearises else source.transfer
        # The linear value of an encoded half can exceed the range of a half.
        stored = np.dtype(np.float32 if self._linearises else source.dtype)
        self.kind, self.pixel_bytes = self._kind or _STORED[stored.type], 8 if self._kind else 4 * stored.itemsize
        try:
            self._allocate(self.kind, self.pixel_bytes)
        except NoDeviceError:
            device.use(self)
            self._host, self.sends = {}, True
            size = source.width * source.height * self.pixel_bytes * capacity * getattr(source, "windows", 1)
            self.anew = getattr(source, "is_made", False) and size > device.budget.limit
            if self.anew:
                source.keep(capacity)  # type: ignore[attr-defined]
            self._divide(int(device.budget.limit * SENT_SHARE))
            try:
                self.picture = device.texture(source.width, source.height, 1, "rgba32f")
            except NoDeviceError:
                self.release()
                raise

    def _divide(self, most: int) -> None:
        """Divides what is sent at a time, in parts of so many bytes at most if they can be."""
        self._cut(self.source.width * self.pixel_bytes * self.layers, min(most, SENT_BYTES, BAND_BYTES))

    @property
    def held(self) -> Collection[int]:
        """The source frames that are loaded, a collection of their indices."""
        return self._held.values()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """See RunningSums.load."""
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

    def _allocate(self, kind: str, pixel_bytes: int) -> None:
        source = self.source
        size = self._texels(source.width, source.height)
        self.rows, self.tops = source.height, range(0, source.height, source.height)
        self._divide(BAND_BYTES)
        try:
            self._check(size[0] * size[1] * pixel_bytes * self.capacity)
            for _ in range(0, self.capacity, self.layers):
                self.textures.append(self.device.texture(*size, self.layers, kind))
            self.picture = self.device.texture(source.width, source.height, 1, "rgba32f")
        except NoDeviceError:
            Window.release(self)
            raise

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

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int = 1):
        self._light: Light = "linear"
        self._sent: Texture | None = None
        super().__init__(device, source, capacity, shutters)
        try:
            self._sent = device.texture(source.width, source.height, 1, "rgba8")
        except NoDeviceError:
            self.release()
            raise

    def _texels(self, width: int, height: int) -> tuple[int, int]:
        return width + RIM, height + RIM

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        if options.light != self._light:
            self._light = options.light
            self._held.clear()
        super().load(positions, options, shot)

    def _send(self, texture: Texture, rows: np.ndarray, layer: int) -> None:
        size = self.source.width, self.source.height
        if self._sent is None:
            raise ValueError("the window was released")
        self.device.write(self._sent, rows, opaque=True)
        program = packing(decoding(self.source.transfer, self._light), self._light == "linear")
        textures, images = {"frame": self._sent}, {"packed_frames": texture}
        extent = self._texels(*size)
        self.device.run(program, extent, textures=textures, images=images, size=size, layer=layer)

    def release(self) -> None:
        super().release()
        if self._sent is not None:
            self._sent.release()


def packing(decode: int, squared: bool) -> Pass:
    """The pass that packs a frame; decode: of `decoding`; squared: what is summed is linear light."""
    return read_pass("pack", DECODE=decode, SQUARED=int(squared))


def decoding(stored: str, light: str) -> int:
    """DECODE of the shaders, how samples become the light that is summed (Options.light): 0 unchanged, 1 made linear,
    2 made encoded. stored: the samples' transfer, "srgb" or "linear"."""
    summed = "srgb" if light == "encoded" else "linear"
    return 0 if stored == summed else 1 if summed == "linear" else 2


def stores_rows(device: Device) -> bool:
    """Whether the device keeps textures in memory row by row."""
    return llvmpipe.is_llvmpipe(device.name)


def _in_tiles(width: int, height: int, layers: int) -> tuple[int, int, int]:
    """The size of a texture for so many layers of pixels stored tile by tile: a row of texels has all layers of a tile,
    a layer of texels a row of tiles."""
    across, down = TILE
    return across * down * layers, -(-width // across), -(-height // down)


# What running sums are stored as, by COVER of shaders/include/sums.glsl.
STORED_SUMS = ("rgba16ui", "rgba32ui", "rgba32ui")


def accumulation(decode: int, sent: str, back: bool, tiled: bool, cover: int = 0) -> Pass:
    """The pass that makes a layer of sums from its neighbour: with the frame between the two added, or subtracted.

    decode: of `decoding`
    sent: as what the frame was sent, "colours", "numbers" (Device.send) or "planes"; "before": it is taken as the
    difference of two layers that hold it already
    back: it is subtracted
    tiled: the sums are stored in tiles
    cover: of WeightedSums
    """
    return read_pass(
        "accumulate",
        DECODE=decode,
        AGAIN=int(sent == "before"),
        BACK=int(back),
        TILED=int(tiled),
        NUMBERS=int(sent == "numbers"),
        PLANES=int(sent == "planes"),
        COVER=cover,
        STORED=STORED_SUMS[cover],
    )


def _in_fours(plane: np.ndarray) -> np.ndarray:
    """Samples uint8 (h, w) as uint32 (h, ⌈w/4⌉), four side by side."""
    if missing := -plane.shape[1] % 4:
        plane = np.pad(plane, ((0, 0), (0, missing)))
    return np.ascontiguousarray(plane).view(np.dtype("<u4"))


class Sums(RunningSums, Window):
    """A window of running sums of opaque 8-bit frames, in textures rgba16ui: three fields of 21 bits for each pixel.

    whole: what white is in a field
    tiled: whether pixels are stored tile by tile, in TILE
    cover: COVER of the shaders: 0, these are no layer's
    """

    cover = 0

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int = 1):
        Window.__init__(self, device, source, capacity, shutters)
        RunningSums.__init__(self, source, capacity)
        # White is the largest 2ⁿ − 1 for which the sum of a whole window fits into 21 bits, and n is 16 at most.
        self.whole = (1 << min(16, 21 - (capacity - 1).bit_length())) - 1
        # A workgroup reads all layers of its pixels. In tiles, they are one run of memory.
        texels, _, tiles = _in_tiles(source.width, source.height, self.layers)
        self.tiled = stores_rows(device) and texels <= device.max_size and tiles <= device.max_layers
        self._sent: dict[str, Texture] = {}
        self._allocate(STORED_SUMS[self.cover], TEXEL_BYTES[STORED_SUMS[self.cover]])
        try:
            self._hold("frame")
        except NoDeviceError:
            self.release()
            raise

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        self.device.use(self)
        super().load(positions, options, shot)

    def _size(self, height: int) -> tuple[int, int, int]:
        return _in_tiles(self.source.width, height, self.layers) if self.tiled else super()._size(height)

    def _hold(self, *names: str) -> None:
        """Has the textures that a frame is sent to: "frame", or "luma" and "chroma". The others go."""
        if self._sent.keys() == set(names):
            return
        self._free_sent()
        width, height = self.source.width, self.source.height
        sizes = {"frame": (width, height, 1, "rgba8"), "luma": (-(-width // 4), height, 1, "r32ui")}
        sizes["chroma"] = -(-width // 8), -(-height // 2), 2, "r32ui"
        for name in names:
            self._sent[name] = self.device.texture(*sizes[name])

    def _free_sent(self) -> None:
        for texture in self._sent.values():
            texture.release()
        self._sent = {}

    def _send(self, index: int) -> tuple[str, dict[str, Any]]:
        """Sends a source frame: as what (`accumulation`), and the arguments of the pass that adds it."""
        frame = self.source.decoded(index) if self.device.takes_planes else self.source.read(index)
        if isinstance(frame, Planes):
            return "planes", self._send_planes(frame)
        self._hold("frame")
        sent = self.device.send(self._sent["frame"], frame)
        return "colours" if sent is self._sent["frame"] else "numbers", {"textures": {"frame": sent}}

    def _send_planes(self, frame: Planes) -> dict[str, Any]:
        self._hold("luma", "chroma")
        self.device.write(self._sent["luma"], _in_fours(frame.luma))
        for layer, plane in enumerate(frame.chroma):
            self.device.write(self._sent["chroma"], _in_fours(plane), layer)
        matrix = frame.matrix
        return {
            "images": self._sent,
            "chroma_step": (chroma_step(self.source.width), chroma_step(self.source.height)),
            "luma_of": (matrix.offset, matrix.luma),
            "red_of": matrix.red_of_cr,
            "green_of": (matrix.green_of_cb, matrix.green_of_cr),
            "blue_of": matrix.blue_of_cb,
        }

    def _add(self, light: Light, frame: int, same: int | None, known: int, next_: int) -> None:
        images: dict[str, Texture] = {}
        given: dict[str, Any] = {"known": known % self.layers, "next": next_ % self.layers}
        if same is None:
            sent, arguments = self._send(frame)
            given |= arguments | {"whole": float(self.whole)}
            images = given.pop("images", images)
        else:
            sent = "before"
            given |= {"before": same % self.layers, "after": (same + 1) % self.layers}
        decode = decoding(self.source.transfer, light)
        program = accumulation(decode, sent, next_ < known, self.tiled, self.cover)
        for top, height, sums in self.bands():
            size = self.source.width, height
            self.device.run(program, size, images=images | {"sums": sums}, size=size, top=top, **given)

    def release(self) -> None:
        RunningSums.release(self)
        Window.release(self)
        self._free_sent()
