"""What is asked of a renderer, a picture as a function of one value; and what its stages hand on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from ..core.model.frame_state import FrameState
from ..core.pixels.shown_levels import Display

if TYPE_CHECKING:
    from .cpu import CPUCompositor
    from .gpu import GPUCompositor

Compositor: TypeAlias = "CPUCompositor | GPUCompositor"
# What a compositor has on its device, which nothing else looks into: of a picture or of coefficients, on a GPU a
# Texture, with NumPy an array; of the frames that are exposed, a window.Window or a cpu.HostWindow.
Handle: TypeAlias = Any


@dataclass(frozen=True)
class Request:
    """All that a picture depends on, in plain data.

    index: the source frame that is shown, from 0; where there are in-between frames it counts them as well
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
