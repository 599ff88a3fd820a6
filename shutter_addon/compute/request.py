"""Requests for pictures, and the interfaces of what makes these, on a GPU or with NumPy."""

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
    """A request for one picture: everything that the picture depends on, as plain data.

    Attributes:
        index: The shown source frame, from 0. With Smooth, each moment counts as a source frame.
        state: The effect at that frame.
        direction: 1, or −1 if the footage plays backward: the window's next frames are then those before `index`.
        source: Names the footage and its size. A caller with several renderers chooses one by it.
        levels: Whether the picture is in 8-bit sRGB values over black. Otherwise it is in scene-linear float32.
        quick: Whether the diffusion may start from the last coefficients, on which the picture then depends slightly.
        display: Converts the finished picture, opaque and scene-linear, to 8-bit values as Blender's output does.
            `levels` is False then. None: the picture is not converted.
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
        """A hashable value that is equal for requests of the same picture, quick or not."""
        return self.source, self.index, self.direction, self.state.key, self.levels, self.display

    def positions(self, shot: range) -> np.ndarray:
        """Return the positions (core.model.windows.positions) of the frames that any shutter exposes.

        If frames of them are missing (edges "shorten"), return all positions of the window that have a frame, since the
        nearest one may take their place.

        Args:
            shot: The source frames that may be shown.
        """
        within = windows.positions(self.state.options, self.index, self.direction)
        exposed = slice(*self.state.open_span)
        if self.state.options.edges != "shorten":
            return within[exposed]
        frames = windows.source_frames(self.state.options, within, shot)
        return within[exposed] if (frames[exposed] >= 0).all() else within[frames >= 0]

    def exposed_frames(self, shot: range) -> set[int]:
        """Return the source frames at `positions`, for the same shot."""
        return set(windows.source_frames(self.state.options, self.positions(shot), shot).tolist())


class Coefficients(NamedTuple):
    """How much of each shutter a pixel gets, on a device.

    Attributes:
        handle: On a GPU a texture array rgba32f, four shutters per layer, top row first; with NumPy an array (N, h, w).
        block: The side of the blocks of pixels that share a value.
    """

    handle: Handle
    block: int


class Exposure(NamedTuple):
    """A composed layer, or the composed background behind all layers. For opaque frames, both pictures are the same.

    Attributes:
        color: Its picture, premultiplied.
        share: A picture whose alpha says how much of each pixel's exposure time the layer, or the background, fills.
    """

    color: Handle
    share: Handle


class Behind(NamedTuple):
    """The background behind all layers, for Stages.lay.

    Attributes:
        exposed: The frames' background, composed with weights for what layers leave.
        plain: The picture without layers. None: `exposed` has the same bits wherever no layer is.
        plate: (H, W, 4), used where too little background was exposed. None: enough was exposed everywhere.
    """

    exposed: Exposure
    plain: Handle | None = None
    plate: np.ndarray | None = None


class Stages(Protocol):
    """What makes coefficients and lays layers over one another: a renderer's work besides the composition.

    The result of a method is valid until the next call of that method.
    """

    def solve(self, labels: np.ndarray, count: int, *guided: Any, warm: bool = False) -> Handle:
        """Return how much of each shutter a pixel gets, as compute.diffusion.diffuse does, on the device.

        Args:
            labels: (h, w) uint16: 0 where nothing is drawn, 1 + shutter where that shutter is drawn.
            count: The number of shutters.
            guided: The guide whose edges stop the diffusion, and its strength, or nothing.
            warm: Whether it may start from the last coefficients.
        """

    def upload(self, values: np.ndarray) -> Handle:
        """Send coefficients (how much of each shutter a pixel gets) to the device, and return them there.

        Args:
            values: (N, h, w), or (N, 1, 1) for the whole picture.
        """

    def add(self, mixed: Handle | None, added: Handle, share: float, size: tuple[int, int]) -> Handle:
        """Add a share of some coefficients to a sum, and return the new sum on the device.

        Args:
            mixed: The sum so far. None: start one.
            added: The coefficients.
            share: The share, 0 to 1.
            size: (h, w) of the sum.
        """

    def blend(
        self, beneath: Handle, mattes: tuple[Matte, ...], layers: Sequence[tuple[Hashable, np.ndarray]]
    ) -> Handle:
        """Lay mattes over coefficients (core.model.mattes.blended), and return the new coefficients on the device.

        Args:
            beneath: The coefficients: how much of each shutter a pixel gets.
            mattes: The mattes.
            layers: (key, values) of each matte: values (h, w) float32, and a key that is equal for equal values.
        """

    def least_share(self, exposed: Exposure) -> float:
        """Return the lowest alpha of exposed.share, of any pixel. A low one tells that a plate has to be made."""

    def lay(self, behind: Behind, layers: Sequence[Exposure], levels: bool) -> Handle:
        """Return the picture of layers laid over the background (core.pixels.layering), on the device.

        Args:
            behind: The background.
            layers: The layers, the farthest first.
            levels: As in Request.
        """

    def release(self) -> None: ...


class Compositor(Protocol):
    """Composes pictures, on a GPU or with NumPy.

    Attributes:
        name: The device's name.
        takes_planes: Whether frames are fastest to send as planes (core.frames.frame_source).
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
        """Return a new window, which holds the source frames that a picture exposes.

        Args:
            source: The footage.
            capacity: The most frames that it holds.
            moved: Whether exposures of its pictures follow something (FrameState.following).
            shutters: The number of shutters of its pictures.
            summed: Whether all of them average frames.
        """

    def stages(self) -> Stages: ...

    def labels(self, values: np.ndarray) -> Handle:
        """Send labels to the device, and return them there, until the next call.

        Args:
            values: (H, W) uint16: 0 where nothing is drawn, 1 + shutter where that shutter is drawn.

        Returns:
            On a GPU a texture r32ui.
        """

    def coefficients(self, handle: Handle, count: int) -> np.ndarray:
        """Return how much of each shutter a pixel gets as an array (count, h, w) float32, from the device.

        Args:
            handle: The coefficients on the device.
            count: The number of shutters.
        """

    def read(self, drawn: Handle) -> np.ndarray:
        """Return a drawn picture as an array (H, W, 4), top row first: float32, or levels in uint8."""

    def over_black(self, drawn: Handle) -> np.ndarray:
        """Return the 8-bit sRGB levels over black (H, W, 4), top row first, of a drawn scene-linear picture."""

    def shown(self, drawn: Handle, display: Display) -> np.ndarray:
        """Return the display's levels (H, W, 4) uint8 of a drawn, opaque, scene-linear picture, top row first."""

    def draw(self, window: Handle, request: Request, coefficients: Coefficients) -> Handle:
        """Return a picture on the device, premultiplied.

        Args:
            window: The window, which has loaded all exposed frames.
            request: The picture.
            coefficients: How much of each shutter a pixel gets.
        """

    def release(self) -> None: ...
