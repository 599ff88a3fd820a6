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
        index: The number of the shown source frame, from 0. With Smooth, frames computed between filmed ones are
            numbered, too.
        state: The state of the effect at that frame.
        direction: 1, or −1 if the footage plays backward. Later frames of the window then have lower numbers.
        source: Any hashable value that stands for the footage and its size. A caller with several renderers finds the
            right one by it; renderers only compare it.
        levels: Whether the picture has 8-bit sRGB values, over black from Renderer.picture. Otherwise it is
            scene-linear float32.
        quick: Whether the diffusion may start from its last result. It is then quicker, and the picture depends
            slightly on the one before.
        display: Converts the finished picture, which is opaque and scene-linear, to the 8-bit values of Blender's
            output. `levels` must then be False. None: the picture is not converted.
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
        """Return the window's frame numbers (n,) from the first to the last that any shutter exposes, in its order.

        They may lie beyond the footage's ends, as core.model.windows.positions do.

        With edges "shorten", if one of them lies beyond the shot, the result is all frame numbers of the window that
        lie in the shot, since the nearest frame may take the place of a missing one. If none lies there, it is the same
        as with other edges.

        Args:
            shot: The source frames of the shot.
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
        block: The side in pixels of the square blocks that share a value. For one value everywhere, it is at least as
            large as the picture.
    """

    handle: Handle
    block: int


class Exposure(NamedTuple):
    """A layer, or the background behind all layers, exposed by itself.

    For opaque footage, both attributes are the same picture.

    Attributes:
        color: The exposed picture, premultiplied, in linear light.
        share: A picture whose alpha is the share of the exposure time in which the layer or the background is visible
            at a pixel, whatever the alpha of the footage.
    """

    color: Handle
    share: Handle


class Behind(NamedTuple):
    """The background behind all layers, and what replaces it in some pixels, for Stages.lay.

    Attributes:
        exposed: The exposed background: a sum of frames, each weighted by what layers leave visible in it.
        plain: The picture without layers, which is shown at pixels where no layer is in any exposed frame. None: not
            needed, `exposed` is used there, too.
        plate: (H, W, 4), linear light, top row first: the background where the exposure shows too little of it. None:
            no pixel needs it.
    """

    exposed: Exposure
    plain: Handle | None = None
    plate: np.ndarray | None = None


class Stages(Protocol):
    """What makes coefficients and lays layers over one another: a renderer's work besides the composition.

    The result of a method is valid until the next call of that method.
    """

    def solve(self, labels: np.ndarray, count: int, *guided: Any, warm: bool = False) -> Handle:
        """Spread shutters from labels to all pixels, and return how much of each shutter a pixel gets, on the device.

        It solves the same equations as compute.diffusion.diffuse.

        Args:
            labels: (h, w) uint16: 0 where nothing is drawn, 1 + index of the shutter that is drawn.
            count: The number of shutters.
            guided: Two arguments, if edges stop the spreading: the guide (from Guides.guide) and the strength, 0 to 1.
                Else none.
            warm: Whether it may start from the last result, which is quicker and slightly inexact.
        """

    def upload(self, values: np.ndarray) -> Handle:
        """Send coefficients (how much of each shutter a pixel gets) to the device, and return them there.

        Args:
            values: (N, h, w), or (N, 1, 1) for the whole picture.
        """

    def add(self, mixed: Handle | None, added: Handle, share: float, size: tuple[int, int]) -> Handle:
        """Add coefficients, times a factor, to a sum of such products, and return the new sum on the device.

        Args:
            mixed: The sum so far, from the last call. None: there is none yet, start with 0.
            added: The coefficients to add, of the sum's size, or one set for all pixels.
            share: The factor, 0 to 1.
            size: (h, w) of the sum.
        """

    def blend(
        self, beneath: Handle, mattes: tuple[Matte, ...], layers: Sequence[tuple[Hashable, np.ndarray]]
    ) -> Handle:
        """Lay mattes over coefficients (core.model.mattes.blended), and return the new coefficients on the device.

        Args:
            beneath: The coefficients beneath: how much of each shutter a pixel gets.
            mattes: The mattes, the lowest first. They tell the shutter, opacity and kind of blending.
            layers: (key, values) for each matte: values (h, w) float32, 0 to 1, without opacity; and a hashable key.
                Equal keys mean equal values, which need not be sent again.
        """

    def least_share(self, exposed: Exposure) -> float:
        """Return the lowest alpha of exposed.share, of any pixel. A low one tells that a plate has to be made."""

    def lay(self, behind: Behind, layers: Sequence[Exposure], levels: bool) -> Handle:
        """Lay exposed layers over the background (core.pixels.layering), and return the picture on the device.

        Args:
            behind: The background.
            layers: The exposed layers, the farthest first; at least one.
            levels: Whether to return 8-bit sRGB values (over black with NumPy, on a GPU with alpha, as from
                GPUCompositor.draw). Otherwise the picture is scene-linear float32.
        """

    def release(self) -> None: ...


class Compositor(Protocol):
    """Exposes frames: combines those of a window by the shutters that each pixel gets, on a GPU or with NumPy.

    Attributes:
        name: The device's name.
        takes_planes: Whether frames are sent fastest as planes of luma and chroma (frame_source.Planes), not as RGBA.
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
        """Make an empty window: storage for the source frames that a picture exposes.

        The arguments choose how frames are stored, and how much memory is left for other textures. With NumPy only
        `source` counts.

        Args:
            source: The footage.
            capacity: The most source frames that the window has to hold at once.
            moved: Whether an exposure of its pictures follows a motion (FrameState.following).
            shutters: The number of shutters of its pictures.
            summed: Whether all shutters average their frames, so that running sums suffice.
        """

    def stages(self) -> Stages: ...

    def labels(self, values: np.ndarray) -> Handle:
        """Send labels to the device for the preview. The result is valid until the next call.

        Args:
            values: (h, w) uint16: 0 where nothing is drawn, 1 + index of the shutter that is drawn.

        Returns:
            On a GPU a texture array r32ui, top row first. With NumPy `values`.
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
        """Expose a window's frames. Return the picture, premultiplied: on a GPU a texture, with NumPy an array.

        Args:
            window: The window. All frames that the picture exposes must be loaded in it.
            request: The picture. Its layers, strokes and mattes are not looked at.
            coefficients: How much of each shutter a pixel gets.
        """

    def release(self) -> None: ...
