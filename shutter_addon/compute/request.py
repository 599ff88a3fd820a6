"""What is asked of a renderer, a picture as a function of one value; and what makes it, stage by stage, on a device or
with NumPy."""

from collections.abc import Hashable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model.frame_state import FrameState
from ..core.model.mattes import Matte
from ..core.pixels.shown_levels import Display

# What a compositor has on its device, which nothing else looks into: of a picture or of coefficients, on a GPU a
# Texture, with NumPy an array; of the frames that are exposed, a window.Window or a cpu.HostWindow.
Handle: TypeAlias = Any


@dataclass(frozen=True)
class Request:
    """All that a picture depends on, in plain data.

    index: the source frame that is shown, from 0; where Smooth is on it counts moments
    state: the effect there
    direction: 1, or −1 where the source plays in reverse, so that the window's next frames are those before `index`
    source: what is read and in how much detail, for who has several renderers
    levels: the picture is of 8-bit display code values, not scene-linear
    display: what shows the opaque scene-linear picture, whose levels are wanted in its place; None: the picture is
    quick: the diffusion may start from the last coefficients, so that the picture depends slightly on them
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
        """Equal for requests of the same picture, quick or not."""
        return self.source, self.index, self.direction, self.state.key, self.levels, self.display


class Coefficients(NamedTuple):
    """How much of each shutter a pixel gets, on a device.

    handle: on a GPU a texture array rgba32f, four shutters per layer, top row first; with NumPy an array (N, h, w)
    block: each value is for block × block pixels; a single value is for the whole picture"""

    handle: Handle
    block: int


class Exposure(NamedTuple):
    """What a layer's frames, or those behind all layers, were composed to: a picture, and one whose alpha is the share
    of the exposure that fell on them. Of opaque frames it is the same picture."""

    color: Handle
    share: Handle


class Behind(NamedTuple):
    """What lies behind layers.

    exposed: by its weights
    plain: the picture without layers; None: where there are none, `exposed` has the same bits
    plate: (H, W, 4), what lies there where too little of it is exposed; None: nowhere"""

    exposed: Exposure
    plain: Handle | None = None
    plate: np.ndarray | None = None


class Stages(Protocol):
    """What a renderer has for itself. What a method gives is valid until its next call."""

    def solve(self, labels: np.ndarray, count: int, *guided: Any, warm: bool = False) -> Handle:
        """Coefficients as compute.diffusion.diffuse has them.

        guided: its guide and strength, or nothing; warm: they may start from the last ones"""

    def upload(self, values: np.ndarray) -> Handle:
        """Coefficients (N, h, w), or (N, 1, 1) of the whole picture. Valid until the next call."""

    def add(self, mixed: Handle | None, added: Handle, share: float, size: tuple[int, int]) -> Handle:
        """A sum (h, w) of shares of coefficients with one more; mixed: what was returned last, None: it begins."""

    def blend(
        self, beneath: Handle, mattes: tuple[Matte, ...], layers: Sequence[tuple[Hashable, np.ndarray]]
    ) -> Handle:
        """Coefficients with mattes laid over them (core.model.mattes.blended); layers: of each matte a key, and its
        values (h, w) float32."""

    def least_share(self, exposed: Exposure) -> float:
        """The least share of any pixel."""

    def lay(self, behind: Behind, layers: Sequence[Exposure], levels: bool) -> Handle:
        """The picture of layers that are laid over one another (core.pixels.layering)."""

    def release(self) -> None: ...


class Compositor(Protocol):
    """What composes pictures, on a device or with NumPy.

    takes_planes: whether frames that are planes (core.frames.planes) are quickest to send"""

    name: str
    takes_planes: bool

    def current(self) -> AbstractContextManager:
        """A context manager: all other methods are called inside it, on any one thread (Device.current)."""

    def freeing(self) -> AbstractContextManager:
        """A context manager: what windows and stages hold is released inside it (Device.freeing)."""

    def window(
        self, source: FrameSource, capacity: int, moved: bool = False, shutters: int = 4, summed: bool = True
    ) -> Handle:
        """A window of `capacity` frames; moved: pictures of it have FrameState.following; shutters: of these pictures;
        summed: all of them average."""

    def stages(self) -> Stages: ...

    def labels(self, values: np.ndarray) -> Handle:
        """Labels (H, W) uint16, on a GPU a texture r32ui. Valid until the next call."""

    def coefficients(self, handle: Handle, count: int) -> np.ndarray:
        """Coefficients (N, h, w) float32 of `count` shutters."""

    def read(self, drawn: Handle) -> np.ndarray:
        """A picture of `draw` as an array (H, W, 4), top row first: float32, or levels in uint8."""

    def over_black(self, drawn: Handle) -> np.ndarray:
        """A scene-linear picture of `draw` as Renderer.picture has it of levels."""

    def shown(self, drawn: Handle, display: Display) -> np.ndarray:
        """The levels (H, W, 4) uint8 of an opaque scene-linear picture of `draw`, top row first."""

    def draw(self, window: Handle, request: Request, coefficients: Coefficients) -> Handle:
        """The picture, premultiplied; window: has loaded all frames that some shutter exposes."""

    def release(self) -> None: ...
