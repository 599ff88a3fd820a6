"""Requests for pictures, and what is handed from stage to stage, on a device or with NumPy."""

from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from ..core.model.frame_state import FrameState
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


class Coefficients(NamedTuple):
    """How much of each shutter a pixel gets, on a device.

    Attributes:
        handle: on a GPU a texture array rgba32f, four shutters per layer, top row first; with NumPy an array (N, h, w)
        block: each value is for block × block pixels
    """

    handle: Handle
    block: int


class Exposure(NamedTuple):
    """A composed layer, or what lies behind all: its picture, and a picture whose alpha is its share of the exposure.

    For opaque frames both are the same picture."""

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
