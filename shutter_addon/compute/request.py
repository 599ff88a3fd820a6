"""Requests for pictures, and the interfaces of what makes them, on a device or with NumPy."""

from collections.abc import Hashable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model import windows
from ..core.model.frame_state import FrameState
from ..core.model.mattes import Matte
from ..core.pixels.shown_levels import Display

# An object of a compositor: a picture or coefficients (on a GPU a Texture, with NumPy an array), or a window of frames
# (a window.Window or cpu.HostWindow).
Handle: TypeAlias = Any


@dataclass(frozen=True)
class Request:
    """All that a picture depends on, as plain data.

    Attributes:
        index: the shown source frame, from 0; with Smooth, the moment
        state: the effect at that frame
        direction: 1, or −1 if the source plays in reverse: the window's next frames are then those before `index`
        source: the footage and its size, for a caller with several renderers
        levels: the picture has 8-bit display code values instead of scene-linear light
        quick: the diffusion may start from the last coefficients, on which the picture then depends slightly
        display: converts the opaque scene-linear picture to levels. None: the picture itself is wanted.
    """

    index: int
    state: FrameState
    direction: int = 1
    source: Any = None
    levels: bool = False
    quick: bool = False
    display: Display | None = None

    @property
    def key(self) -> tuple:
        """A key that is equal for the same picture, quick or not."""
        return self.source, self.index, self.direction, self.state.key, self.levels, self.display

    def positions(self, shot: range) -> np.ndarray:
        """Return the positions (core.model.windows.positions) that any shutter exposes, with or without a scribble.

        If frames of them are missing (edges "shorten"), return all positions of the window that have a frame, since the
        nearest one may take their place.
        """
        within = windows.positions(self.state.options, self.index, self.direction)
        exposed = slice(*self.state.open_span)
        if self.state.options.edges != "shorten":
            return within[exposed]
        frames = windows.source_frames(self.state.options, within, shot)
        return within[exposed] if (frames[exposed] >= 0).all() else within[frames >= 0]

    def exposed_frames(self, shot: range) -> set[int]:
        """Return the source frames at `positions`."""
        return set(windows.source_frames(self.state.options, self.positions(shot), shot).tolist())


class Coefficients(NamedTuple):
    """How much of each shutter a pixel gets, on a device.

    Attributes:
        handle: on a GPU a texture array rgba32f, four shutters per layer, top row first; with NumPy an array (N, h, w)
        block: each value is for block × block pixels
    """

    handle: Handle
    block: int


class Exposure(NamedTuple):
    """A composed layer, or what lies behind all layers. For opaque frames, both pictures are the same.

    Attributes:
        color: Its picture.
        share: A picture whose alpha is its share of the exposure.
    """

    color: Handle
    share: Handle


class Behind(NamedTuple):
    """What lies behind layers.

    Attributes:
        exposed: composed with its weights
        plain: the picture without layers. None: `exposed` has its bits wherever no layer is.
        plate: (H, W, 4), used where too little was exposed. None: enough was exposed everywhere.
    """

    exposed: Exposure
    plain: Handle | None = None
    plate: np.ndarray | None = None


class Stages(Protocol):
    """A renderer's stages besides the composition. Results are valid until a method's next call."""

    def solve(self, labels: np.ndarray, count: int, *guided: Any, warm: bool = False) -> Handle:
        """Return coefficients, as compute.diffusion.diffuse does.

        Args:
            labels: (h, w)
            count: the number of shutters
            guided: its guide and strength, or nothing
            warm: whether it may start from the last coefficients
        """

    def upload(self, values: np.ndarray) -> Handle:
        """Return coefficients (N, h, w), or (N, 1, 1) for the whole picture, on the device."""

    def add(self, mixed: Handle | None, added: Handle, share: float, size: tuple[int, int]) -> Handle:
        """Return a sum (h, w) of coefficients plus a share of others. mixed: the last sum. None: start one."""

    def blend(
        self, beneath: Handle, mattes: tuple[Matte, ...], layers: Sequence[tuple[Hashable, np.ndarray]]
    ) -> Handle:
        """Return coefficients with mattes laid over them (core.model.mattes.blended).

        Args:
            beneath: the coefficients
            mattes: the mattes
            layers: a key and the values (h, w) float32 of each matte
        """

    def least_share(self, exposed: Exposure) -> float:
        """Return the lowest share of any pixel."""

    def lay(self, behind: Behind, layers: Sequence[Exposure], levels: bool) -> Handle:
        """Return the picture of layers laid over one another (core.pixels.layering)."""

    def release(self) -> None: ...


class Compositor(Protocol):
    """Composes pictures, on a device or with NumPy.

    Attributes:
        name: the device's name
        takes_planes: whether frames are fastest to send as planes (core.frames.frame_source)
    """

    name: str
    takes_planes: bool

    def current(self) -> AbstractContextManager:
        """Return the context manager inside which callers call all other methods (Device.current)."""

    def freeing(self) -> AbstractContextManager:
        """Return the context manager inside which callers release windows and stages (Device.freeing)."""

    def window(
        self, source: FrameSource, capacity: int, moved: bool = False, shutters: int = 4, summed: bool = True
    ) -> Handle:
        """Return a window of `capacity` frames.

        Args:
            source: the footage
            capacity: the number of frames
            moved: whether its pictures have FrameState.following
            shutters: the number of shutters of its pictures
            summed: whether all of them average
        """

    def stages(self) -> Stages: ...

    def labels(self, values: np.ndarray) -> Handle:
        """Return labels (H, W) uint16 on the device (on a GPU a texture r32ui), valid until the next call."""

    def coefficients(self, handle: Handle, count: int) -> np.ndarray:
        """Return coefficients (N, h, w) float32 of `count` shutters as an array."""

    def read(self, drawn: Handle) -> np.ndarray:
        """Return a drawn picture as an array (H, W, 4), top row first: float32, or levels in uint8."""

    def over_black(self, drawn: Handle) -> np.ndarray:
        """Return the levels over black of a drawn scene-linear picture (Renderer.picture)."""

    def shown(self, drawn: Handle, display: Display) -> np.ndarray:
        """Return the display's levels (H, W, 4) uint8 of a drawn, opaque, scene-linear picture, top row first."""

    def draw(self, window: Handle, request: Request, coefficients: Coefficients) -> Handle:
        """Return the picture, premultiplied. The window must have loaded all exposed frames."""

    def release(self) -> None: ...
