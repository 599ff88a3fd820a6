"""Compose pictures with NumPy, tile by tile, by the reference itself. It is slow, for machines without a GPU."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np

from ..core import stopping
from ..core.frames import light
from ..core.frames.frame_source import FrameSource
from ..core.model import mattes, windows
from ..core.model.frame_state import Options
from ..core.pixels import compositor, layering
from ..core.pixels.shown_levels import Display
from .diffusion import diffuse
from .layer_frames import LARGEST, linear
from .request import Behind, Coefficients, Exposure, Request

# Rows and columns of a tile, a multiple of every block. Its arrays stay in the processor's cache.
TILE = 64

Tile = tuple[slice, slice]
Moves = tuple[np.ndarray, np.ndarray]


class HostWindow:
    """A window (window.Window) of CPUCompositor: the source frames that a picture exposes, in main memory.

    Attributes:
        is_open: True: it can always load frames.
        sends: False: frames are not sent to a device.
        source: The footage.
        shot: The source frames that may be exposed, from the last call of `load`.
        frames: {source frame: its pixels (H, W, 4), as FrameSource.read returns them}.
    """

    is_open, sends = True, False

    def __init__(self, source: FrameSource) -> None:
        self.source, self.shot = source, range(source.count)
        self.frames: dict[int, np.ndarray] = {}

    @property
    def held(self) -> Collection[int]:
        """The indices of the loaded source frames."""
        return self.frames.keys()

    def load(self, positions: np.ndarray, options: Options, shot: range) -> None:
        """Read the frames at some positions that are not loaded, and free all others. Arguments as for Sums.load."""
        self.shot = shot
        wanted = set(windows.source_frames(options, positions, shot).tolist())
        self.frames = {index: frame for index, frame in self.frames.items() if index in wanted}
        for index in sorted(wanted - self.frames.keys()):
            self.frames[index] = self.source.read(index)

    def seen(self, indices: np.ndarray, tile: Tile, moves: Moves | None) -> tuple[list[np.ndarray], Moves | None]:
        """Return what one tile of the picture needs from each frame, as arguments of core.pixels.compositor.compose.

        Args:
            indices: (L,) source frame at each place of the window. For one that is not loaded, or −1, one black pixel
                is returned; the caller exposes none of it.
            tile: The tile's rows and columns in the picture.
            moves: (turns, shifts), complex (L, N), for each frame and shutter: a point z of the picture lies at turn ·
                z + shift in the frame (motions.Similarity). None: no exposure follows a motion.

        Returns:
            A list of L parts of frames (h, w, 4) in linear light, premultiplied. Without `moves` it is the tile. With
                them it is the rectangle that covers the tile in the frame under every shutter's motion, plus 3 pixels,
                clipped at the frame's edges.
            The moves from points of the tile to those of the parts, each counted from the first pixel of its array;
                None if `moves` is None.
        """
        if moves is None:
            parts, moved = [tile] * len(indices), None
        else:
            turns, shifts = moves
            corners = np.add.outer([1j * row for row in _ends(tile[0])], _ends(tile[1])).ravel()
            places = turns[..., None] * corners + shifts[..., None]
            parts = [_around(looked, self.source) for looked in places]
            starts = np.array([columns.start + 1j * rows.start for rows, columns in parts])
            moved = turns, shifts + turns * corners[0] - starts[:, None]
        black = np.zeros((1, 1, 4), np.float32)
        frames = [
            linear(self.frames[index][part], self.source) if index in self.frames else black
            for index, part in zip(indices.tolist(), parts, strict=True)
        ]
        return frames, moved

    def release(self) -> None:
        """Free the frames."""
        self.frames = {}


def _ends(pixels: slice) -> tuple[int, int]:
    """Return the first and the last pixel of a range."""
    return pixels.start, pixels.stop - 1


def _around(places: np.ndarray, source: FrameSource) -> Tile:
    """Return the part of a source's frame that covers all places x + iy and 3 pixels around, clipped at its edges."""
    sides = (places.imag, source.height), (places.real, source.width)
    rows, columns = (np.clip((along.min() - 3, along.max() + 3), 0, size - 1).astype(int) for along, size in sides)
    return slice(rows[0], rows[1] + 1), slice(columns[0], columns[1] + 1)


def _tiles(source: FrameSource) -> Iterator[Tile]:
    """Yield the rows and columns of all tiles of a picture."""
    for top in range(0, source.height, TILE):
        for left in range(0, source.width, TILE):
            yield slice(top, min(top + TILE, source.height)), slice(left, min(left + TILE, source.width))


class CPUCompositor:
    """Composes pictures with NumPy. It implements request.Compositor and request.Stages.

    It is for machines without a GPU, and for pictures that a GPU's passes cannot make (GPUCompositor._draw_on_host).
    Pictures and coefficients are NumPy arrays, windows are HostWindow.
    """

    name = "NumPy"
    takes_planes = False

    def current(self) -> AbstractContextManager:
        return nullcontext(self)

    freeing = current

    def window(self, source: FrameSource, *_size: object) -> HostWindow:
        return HostWindow(source)

    def stages(self) -> CPUCompositor:
        return self

    def upload(self, values: np.ndarray) -> np.ndarray:
        return values.astype(np.float32, copy=False)

    def labels(self, values: np.ndarray) -> np.ndarray:
        return values

    def coefficients(self, handle: np.ndarray, count: int) -> np.ndarray:
        return handle[:count]

    def read(self, drawn: np.ndarray) -> np.ndarray:
        return drawn

    def over_black(self, drawn: np.ndarray) -> np.ndarray:
        levels = np.full(drawn.shape, 255, np.uint8)
        levels[..., :3] = 255 * light.to_encoded(np.nan_to_num(drawn[..., :3]).clip(0, 1)) + np.float32(0.5)
        return levels

    def shown(self, drawn: np.ndarray, display: Display) -> np.ndarray:
        levels = np.full(drawn.shape, 255, np.uint8)
        noise = display.noise(drawn.shape[1], drawn.shape[0])[::-1]
        levels[..., :3] = display.levels(drawn[..., :3], noise)
        return levels

    def solve(self, labels: np.ndarray, count: int, *guided: Any, warm: bool = False) -> np.ndarray:
        return diffuse(labels, count, *guided)

    def add(self, mixed: np.ndarray | None, added: np.ndarray, share: float, size: tuple[int, int]) -> np.ndarray:
        part = np.broadcast_to(added * np.float32(share), (len(added), *size))
        return part if mixed is None else mixed + part

    def blend(
        self, beneath: np.ndarray, shown: tuple[mattes.Matte, ...], layers: Sequence[tuple[Hashable, np.ndarray]]
    ) -> np.ndarray:
        return mattes.blended(beneath, shown, [values for _, values in layers])

    def least_share(self, exposed: Exposure) -> float:
        return exposed.share[..., 3].min()

    def lay(self, behind: Behind, layers: Sequence[Exposure], levels: bool) -> np.ndarray:
        color, share = behind.exposed
        picture = layering.with_plate(color, share[..., 3], behind.plate)
        if behind.plain is not None:
            picture = np.where((share[..., 3] > layering.UNCOVERED)[..., None], behind.plain, picture)
        for layer in layers:
            picture = layer.color + (1 - layer.share[..., 3:]) * picture
        return self.over_black(picture) if levels else picture

    def draw(self, window: HostWindow, request: Request, coefficients: Coefficients) -> np.ndarray:
        """Return the picture (H, W, 4), top row first: float32 scene-linear, or with request.levels uint8.

        Args:
            window: The window, in which all frames that the picture exposes must be loaded.
            request: The picture. Its strokes, mattes and layers are not looked at.
            coefficients: How much of each shutter a pixel gets.

        Raises:
            StoppedError: The calling thread's work was cancelled.
        """
        state, source = request.state, window.source
        indices = windows.indices(state.options, request.index, window.shot, request.direction)
        moves = None if state.following is None else state.following.at(indices)
        values, block = coefficients.handle[: len(state.bars)], coefficients.block
        picture = np.empty((source.height, source.width, 4), np.float32)
        for tile in _tiles(source):
            stopping.check()
            frames, moved = window.seen(indices, tile, moves)
            rows, columns = (np.arange(pixels.start, pixels.stop) // block for pixels in tile)
            shares = np.maximum(values[:, rows[:, None], columns], 0, dtype=np.float64)
            shares /= shares.sum(axis=0)
            made = compositor.compose(state, frames, indices >= 0, shares, moved, source.alpha == "opaque")
            picture[tile] = made.clip(-LARGEST, LARGEST)
        return self.over_black(picture) if request.levels else picture

    def release(self) -> None:
        """Do nothing: there is nothing to free."""
