"""Windows on a device: they hold the source frames that a picture exposes, and read each frame once."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.model import windows
from ..core.model.frame_state import Light, Options
from .devices import llvmpipe
from .devices.device import Device, NamedTextures, NoDeviceError, Texture, texel_bytes
from .devices.passes import read_pass

# The most bytes of a texture array.
BAND_BYTES = llvmpipe.MOST_BYTES
# If frames stay on the host, the most that is sent at once: a share of the budget, and bytes.
SENT_SHARE, SENT_BYTES = 1 / 8, 64 << 20

# Rows of pixels that one invocation composes in most passes. The height of a band is a multiple of it.
BLOCK = 16
# The rim of packed frames in pixels (shaders/pack.glsl).
RIM = 5

_STORED = {np.uint8: "rgba8", np.uint16: "rgba16", np.float16: "rgba16f", np.float32: "rgba32f"}


def summable(source: FrameSource) -> bool:
    """Return whether running sums can be made of a source's frames: whether they are opaque and have 8 bits."""
    return np.dtype(source.dtype) == np.uint8 and source.alpha == "opaque"


def beside(source: FrameSource, shutters: int) -> int:
    """Return how many bytes of the device's budget a window must leave for a frame to send and for other textures.

    Most of it is for the diffusion along edges: four times the size of the coefficients, at one per pixel.

    Args:
        source: The footage, for the picture's size.
        shutters: The number of shutters.
    """
    return source.width * source.height * (16 * (4 * -(-shutters // 4) + 2) + 4)


class Part(NamedTuple):
    """Which part of a window is stored in one of its texture arrays.

    Attributes:
        top: The part's first row of pixels in the picture, from 0.
        height: The number of rows of pixels.
        layers: Which layers of the window (frames or running sums) the texture array has.
    """

    top: int
    height: int
    layers: range


class Window:
    """The base of all windows. A window stores the source frames that a picture exposes, in texture arrays on a device.

    It also has the textures that the compositor draws into. Whether a window fits depends only on sizes and on the
    device's budget, not on the memory that is free. So a picture has the same bits whatever was rendered before. If
    another window needs memory, the device may release this one.

    Attributes:
        capacity: The most source frames that it holds.
        layers: How many layers it has, each with a frame or a running sum.
        kind: The GLSL format of its texture arrays.
        parts: The parts into which it is divided, one for each texture array.
        shutters: The number of shutters of its pictures.
        is_open: Whether it can be used. A released window cannot be used again.
        sends: Whether frames stay on the host and are sent again for every picture, since the device has no room for
            them.
        cover: Which weights its frames were multiplied by: 0 none, 1 those of a layer, 2 those of the background.
        shot: The source frames that it may show, from the last call of `load`.
    """

    layers: int
    kind: str
    cover = 0
    is_open = sends = False

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int) -> None:
        self.device, self.source, self.capacity, self.shutters = device, source, capacity, shutters
        self.shot = range(source.count)
        self.parts: list[Part] = []
        self._textures: list[Texture] = []  # of the parts
        self._extra = NamedTextures(device)
        device.use(self.release)
        try:
            self._allocate()
        except NoDeviceError:
            self.release()
            raise
        self.is_open = True

    def _allocate(self) -> None:
        """Create the texture arrays for frames or sums, and the texture that the compositor draws into.

        Raises:
            NoDeviceError: The device has no room: for these, for as many such windows as read the source, and for the
                textures of other passes (`beside`).
        """
        width, height = self._texels(self.source.width, self.source.height)
        size = width * height * texel_bytes(self.kind) * self.layers * self.source.windows
        if size + beside(self.source, self.shutters) > self.device.budget.limit:
            raise NoDeviceError("over the budget")
        self.parts = self._divided(BAND_BYTES)
        for part in self.parts:
            self._textures.append(self.device.texture(*self._size(part), self.kind))
        self.picture()

    def _divided(self, most: int) -> list[Part]:
        """Divide the window into bands of rows, so that no texture array becomes too large. Each band has all layers.

        Args:
            most: The most bytes of a band's texture array. A band still has at least BLOCK rows.

        Returns:
            The bands from top to bottom. The height of each is a multiple of BLOCK rows; the last one has the remaining
            rows.
        """
        source = self.source
        row_bytes = source.width * texel_bytes(self.kind) * self.layers
        rows = max(1, most // row_bytes // BLOCK) * BLOCK
        tops = range(0, source.height, rows)
        return [Part(top, min(rows, source.height - top), range(self.layers)) for top in tops]

    def _texels(self, width: int, height: int) -> tuple[int, int]:
        """Return how large (width, height) a layer is in texels, for a picture of this size in pixels."""
        return width, height

    def _size(self, part: Part) -> tuple[int, int, int]:
        """Return the size (width, height, layers) of the texture array of a part."""
        return *self._texels(self.source.width, part.height), len(part.layers)

    def stored(self) -> Iterator[tuple[Part, Texture]]:
        """Yield each part with its texture array, which is valid until the next part."""
        yield from zip(self.parts, self._textures, strict=True)

    def decode(self, light: str) -> int:
        """Return how shaders convert the samples that the window stores: 0, 1 or 2, as from `decoding`.

        Args:
            light: Options.light: in which light frames are summed.
        """
        return 0

    def picture(self, levels: bool = False) -> Texture:
        """Return the texture that the compositor draws into: rgba8 for levels, else rgba32f."""
        return self._own("levels", "rgba8") if levels else self._own("picture", "rgba32f")

    def mixed(self) -> Texture:
        """Return the texture for the sum of the pictures of shutters that combine frames in different ways."""
        return self._own("mixed", "rgba32f")

    def _own(self, name: str, kind: str) -> Texture:
        """Return the texture of a name, with the picture's size and one layer."""
        return self._extra.of(name, (self.source.width, self.source.height, 1), kind)

    def release(self) -> None:
        """Free all textures. The window cannot be used again."""
        for texture in self._textures:
            texture.release()
        self._extra.release()
        self._textures, self.is_open = [], False
        self.device.forget(self.release)


class Frames(Window):
    """A window that stores frames, each in a layer of its own: source frame i in layer i mod `layers`.

    Samples are stored as they are, except for sRGB floats, which are converted to linear light.

    If the device has no room for the whole window, the frames stay on the host. Every picture then sends them to the
    device part by part (Window.parts, here bands of rows). Pictures have the same bits in both cases.
    """

    def __init__(self, device: Device, source: FrameSource, capacity: int, shutters: int = 1) -> None:
        self.layers = capacity
        self._held: dict[int, int] = {}  # {layer: source frame}
        self._host: dict[int, np.ndarray] | None = None
        # Encoded floats can exceed 1, the limit of the shaders' curve: they become linear on the host.
        self._linearises = source.transfer == "srgb" and np.dtype(source.dtype).kind == "f"
        self.transfer = "linear" if self._linearises else source.transfer
        self.kind = self._kind(source)
        super().__init__(device, source, capacity, shutters)

    def _kind(self, source: FrameSource) -> str:
        # The linear value of an encoded half can exceed the range of a half.
        return _STORED[np.dtype(np.float32 if self._linearises else source.dtype).type]

    def _allocate(self) -> None:
        try:
            super()._allocate()
        except NoDeviceError:
            self.release()
            self.device.use(self.release)
            self._host, self.sends = {}, True
            self.parts = self._divided(min(int(self.device.budget.limit * SENT_SHARE), SENT_BYTES, BAND_BYTES))
            self.picture()

    @property
    def held(self) -> Collection[int]:
        """The loaded source frames."""
        return self._held.values()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """Read the frames at some positions that are not loaded. Arguments as for Sums.load."""
        self.shot = shot
        self.device.use(self.release)
        for index in sorted(set(windows.source_frames(options, positions, shot).tolist())):
            layer = index % self.capacity
            if self._held.get(layer) == index:
                continue
            self._held.pop(layer, None)  # in case it is interrupted
            frame = self._read(index)
            if self._host is None:
                for part, texture in super().stored():
                    self._send(part, texture, layer, frame)
            else:
                self._host[layer] = frame
            self._held[layer] = index

    def stored(self) -> Iterator[tuple[Part, Texture]]:
        """Yield each part with its texture array (Window.stored). Frames on the host are sent, part by part."""
        if self._host is None:
            yield from super().stored()
            return
        texture = self.device.texture(*self._size(self.parts[0]), self.kind)
        try:
            for part in self.parts:
                for layer, frame in self._host.items():
                    self._send(part, texture, layer, frame)
                yield part, texture
        finally:
            texture.release()

    def decode(self, light: str) -> int:
        return decoding(self.transfer, light)

    def _read(self, index: int) -> np.ndarray:
        """Return a frame (height, width, 4) of the source, with samples in the form that is stored."""
        frame = self.source.read(index)
        if self._linearises:
            frame = frame.astype(np.float32, copy=False)
            if self.source.alpha == "premultiplied":
                return light.linearised(frame)
            frame = np.concatenate([light.to_linear(frame[..., :3]), frame[..., 3:]], axis=-1)
        return frame

    def _send(self, part: Part, texture: Texture, layer: int, frame: np.ndarray) -> None:
        """Send the rows of a frame that belong to a part to the part's texture."""
        if layer in part.layers:
            self._write(texture, frame[part.top : part.top + part.height], layer - part.layers.start)

    def _write(self, texture: Texture, rows: np.ndarray, layer: int) -> None:
        self.device.write(texture, rows, layer, opaque=self.source.alpha == "opaque")

    def release(self) -> None:
        super().release()
        self._held, self._host = {}, None


class WholeFrames(Frames):
    """A window of frames that are not divided into bands of rows, for exposures that follow a motion.

    These read pixels anywhere in a frame. Instead, the frames are divided among texture arrays, with as many in each as
    BAND_BYTES (SENT_BYTES and SENT_SHARE, if they stay on the host) and the device allow.
    """

    def _divided(self, most: int) -> list[Part]:
        height = self.source.height
        across, down = self._texels(self.source.width, height)
        count = max(1, min(most // (across * down * texel_bytes(self.kind)), self.capacity, self.device.max_layers))
        layers = range(self.capacity)
        return [Part(0, height, layers[start : start + count]) for start in layers[::count]]


class PackedFrames(WholeFrames):
    """A window of whole, opaque 8-bit frames for exposures that follow a motion, converted for quick interpolation.

    shaders/pack.glsl converts each frame to the light that is summed (Options.light), and packs a pixel's color into 32
    bits. A texel has the pixel and the one below it. A rim of pixels repeats the frame's edges.
    """

    _light: Light = "linear"

    def _kind(self, source: FrameSource) -> str:
        return "rgba16ui"

    def _texels(self, width: int, height: int) -> tuple[int, int]:
        return width + RIM, height + RIM

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """Read the frames at some positions that are not loaded, and pack them. Arguments as for Sums.load."""
        if options.light != self._light:
            self._light = options.light
            self._held.clear()
        super().load(positions, options, shot)

    def decode(self, light: str) -> int:
        return 0

    def _write(self, texture: Texture, rows: np.ndarray, layer: int) -> None:
        sent = self._own("sent", "rgba8")
        self.device.write(sent, rows, opaque=True)
        decode, squared = decoding(self.source.transfer, self._light), int(self._light == "linear")
        program = read_pass("pack", DECODE=decode, SQUARED=squared)
        textures, images = {"frame": sent}, {"packed_frames": texture}
        size, last = texture.size[:2], (self.source.width - 1, self.source.height - 1)
        self.device.run(program, size, textures=textures, images=images, size=size, last=last, layer=layer)


def decoding(stored: str, light: str) -> int:
    """Return how shaders convert stored samples to the light that is summed: their macro DECODE.

    Args:
        stored: The transfer of the stored samples, "srgb" or "linear".
        light: Options.light: "linear", or "encoded" for sRGB values.

    Returns:
        0: leave samples unchanged; 1: convert sRGB values to linear light; 2: convert linear light to sRGB values.
    """
    summed = "srgb" if light == "encoded" else "linear"
    return 0 if stored == summed else 1 if summed == "linear" else 2
