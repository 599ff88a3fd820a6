"""Windows of frames and of running sums on the host, in tiles."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from ..core import stopping
from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.model.frame_state import Light, Options
from ..core.pixels import compositor
from .resampling import around, resampled
from .running_sums import RunningSums, summable

# A tile's rows and columns, multiples of every block. So small that its arrays stay in the processor's cache, and that
# coefficients differ little across it.
TILE = 128, 128
# Bytes of running sums, at most: enough for windows of 64 frames of 1080p, or 20 of 4K. Larger windows are composed
# from the frames, which take a third as much.
SUMS_BYTES = 2 << 30
# White in the running sums: the largest of which the sum over 256 frames is exact in a float32. In encoded light every
# 8-bit value is exact as well.
WHITE = (1 << 16) - 1


class Tile:
    """A part of the picture: its number, and `rows` and `columns` as slices."""

    def __init__(self, number: int, top: int, left: int, source: FrameSource):
        self.number = number
        self.rows = slice(top, min(top + TILE[0], source.height))
        self.columns = slice(left, min(left + TILE[1], source.width))
        self.shape = self.rows.stop - top, self.columns.stop - left

    def of(self, picture: np.ndarray) -> np.ndarray:
        return picture[self.rows, self.columns]

    def coefficients(self, handle: np.ndarray, block: int) -> np.ndarray:
        """(N, h, w) float32 of the tile's blocks, Σ = 1."""
        rows, columns = (slice(s.start // block, -(-s.stop // block)) for s in (self.rows, self.columns))
        c = np.maximum(handle[:, rows, columns], 0, dtype=np.float32)
        return c / c.sum(axis=0)

    def pixels(self, values: np.ndarray | float, block: int) -> Any:
        """Values (h, w) of the tile's blocks for each of its pixels; a single one stays what it is."""
        if isinstance(values, float) or block == 1 or values.size == 1:
            return values
        return values.repeat(block, 0).repeat(block, 1)[: self.shape[0], : self.shape[1]]


def _tiles(source: FrameSource) -> list[Tile]:
    corners = [(top, left) for top in range(0, source.height, TILE[0]) for left in range(0, source.width, TILE[1])]
    return [Tile(number, *corner, source) for number, corner in enumerate(corners)]


class TiledFrames:
    """A window of the frames as they are, on the host. is_open, sends: see window.Window."""

    is_open, sends = True, False
    unit = 1.0

    def __init__(self, source: FrameSource, capacity: int):
        self.source, self.capacity = source, capacity
        self.shot = range(source.count)
        self.tiles = _tiles(source)
        self.frames: dict[int, np.ndarray] = {}
        self._at: dict[int, int] = {}  # position: source frame
        self._decode = _decoder(source, "linear")

    @property
    def held(self) -> Collection[int]:
        return self.frames.keys()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """See RunningSums.load."""
        self.shot = shot
        frames = compositor.source_frames(options, positions, shot).tolist()
        self._at, wanted = dict(zip(positions.tolist(), frames, strict=True)), set(frames)
        for index in self.frames.keys() - wanted:
            del self.frames[index]
        for index in sorted(wanted - self.frames.keys()):
            self.frames[index] = self.source.read(index)
        self._decode = _decoder(self.source, options.light)

    def light(self, tile: Tile, position: int) -> np.ndarray:
        """The light (3 or 4, h, w) float32 of the frame at a position: premultiplied, `1 / unit` for white."""
        return self._decode(tile.of(self.frames[self._at[position]]))

    def seen(self, tile: Tile, position: int, turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """As `light`, of what the frame shows at turn · z + shift for each pixel z; turn, shift: (h, w), or alike."""
        if not (np.any(turn != 1) or np.any(shift)):
            return self.light(tile, position)
        y, x = np.ogrid[tile.rows, tile.columns]
        frame = self.frames[self._at[position]]
        rows, columns, x, y = around(turn * (x + 1j * y) + shift, frame.shape)
        return resampled(self._decode(frame[rows, columns]), x, y, sharp=self.source.alpha == "opaque")

    def release(self) -> None:
        self.frames = {}


class TiledSums(RunningSums):
    """A window of running sums of opaque 8-bit frames, on the host: three uint32 for each pixel and layer."""

    is_open, sends = True, False
    unit = 1 / WHITE

    def __init__(self, source: FrameSource, capacity: int):
        super().__init__(source, capacity)
        self.tiles = _tiles(source)
        # What a sum begins with is arbitrary.
        self._sums = [np.zeros((3, self.layers, *tile.shape), np.uint32) for tile in self.tiles]

    @staticmethod
    def fit(source: FrameSource, capacity: int) -> bool:
        """Whether running sums can be made of a source, in at most SUMS_BYTES."""
        return summable(source) and 12 * source.width * source.height * (capacity + 1) <= SUMS_BYTES

    def _add(self, light: Light, frame: int, same: int | None, known: int, next_: int) -> None:
        picture = self.source.read(frame) if same is None else None
        levels = np.rint(_curve(self.source, light) * WHITE).astype(np.uint32)
        combine = np.add if next_ > known else np.subtract

        for tile, sums in zip(self.tiles, self._sums, strict=True):
            stopping.check()
            for k, colour in enumerate(sums):
                if same is not None:
                    light_ = colour[(same + 1) % self.layers] - colour[same % self.layers]
                elif picture is not None:
                    light_ = levels.take(tile.of(picture)[..., k])
                combine(colour[known % self.layers], light_, out=colour[next_ % self.layers])

    def light(self, tile: Tile, position: int) -> np.ndarray:
        """As TiledFrames.light."""
        sums = self._sums[tile.number]
        return _difference(sums[:, (position + 1) % self.layers], sums[:, position % self.layers])

    def light_between(self, tile: Tile, origin: int, x: np.ndarray) -> np.ndarray:
        """The light (3, h, w) float32 from the position `origin` to x (h, w), or (1, 1), positions after it."""
        sums = self._sums[tile.number]
        base, whole = sums[:, origin % self.layers], np.floor(x)
        if x.size == 1:
            early, late = (sums[:, (origin + int(whole.item()) + k) % self.layers] for k in (0, 1))
        else:
            place = whole.astype(np.intp)
            place += origin % self.layers
            place *= base[0].size
            place += np.arange(base[0].size).reshape(tile.shape)
            flat = sums.reshape(3, -1)
            # The layers lie in a ring.
            early = flat.take(place, axis=1, mode="wrap")
            place += base[0].size
            late = flat.take(place, axis=1, mode="wrap")
        result = _difference(late, early)
        result *= x - whole
        result += _difference(early, base)
        return result

    def release(self) -> None:
        super().release()
        self._sums = []


def _difference(late: np.ndarray, early: np.ndarray) -> np.ndarray:
    return (late - early).view(np.int32).astype(np.float32)


def _conversion(source: FrameSource, summed: str) -> Callable[[np.ndarray], np.ndarray] | None:
    """From a source's colours to those in the light that is summed (Options.light); None: they are."""
    wanted = {"encoded": "srgb", "linear": "linear"}[summed]
    return None if source.transfer == wanted else light.to_linear if wanted == "linear" else light.to_encoded


def _curve(source: FrameSource, summed: str) -> np.ndarray:
    """The light float32 that is summed for every value of a whole type."""
    most = np.iinfo(source.dtype).max
    values = np.arange(most + 1, dtype=np.float32) / np.float32(most)
    convert = _conversion(source, summed)
    return convert(values) if convert else values


def _decoder(source: FrameSource, summed: str) -> Callable[[np.ndarray], np.ndarray]:
    """A function from samples (h, w, 4) to the light (3 or 4, h, w) float32 that is summed, premultiplied."""
    convert = _conversion(source, summed)
    whole, opaque = np.dtype(source.dtype).kind == "u", source.alpha == "opaque"
    white = np.float32(np.iinfo(source.dtype).max if whole else 1)
    curve = _curve(source, summed) if whole else np.empty(0, np.float32)

    def decode(samples: np.ndarray) -> np.ndarray:
        if source.alpha == "premultiplied" or not whole:
            rgba = samples.astype(np.float32) / white
            if source.alpha != "premultiplied":
                rgba = light.premultiplied(rgba, convert)
            elif convert is light.to_linear:
                rgba = light.linearised(rgba)
            elif convert:
                rgba = light.premultiplied(light.straight(rgba), convert)
            planes = np.ascontiguousarray(np.moveaxis(rgba, -1, 0))
            return planes[:3] if opaque else planes
        planes = np.moveaxis(samples, -1, 0)
        colours = curve.take(planes[:3])
        if opaque:
            return colours
        alpha = planes[3:] / white
        return np.concatenate([colours * alpha, alpha])

    return decode
