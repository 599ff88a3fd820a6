"""Mattes: coefficients for every pixel from a file, a mask or a ramp instead of scribbles.

They are laid over the scribbles' coefficients in the order of the regions, later ones on top.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from ..frames.frame_source import FrameSource, SourceFile
from ..frames.retiming import StripTiming
from .clip import Clip
from .masks import MaskShape
from .motions import Placement
from .outlines import Curves, coverage

Blend = Literal["over", "add"]
# How an outline's matte gets from one drawing to the next: by the footage's motion, or linearly.
Between = Literal["carried", "straight"]
RampKind = Literal["linear", "radial", "angle"]
# The smallest scale of a ramp, which is almost a step.
_SMALLEST = 1e-6


@dataclass(frozen=True)
class FileFrame:
    """A frame of a file.

    Attributes:
        offset: From the source's shown filmed frame to the matte's, both counted from 0.
        time: Frames since the one that shows frame `offset`; replaces the source's frame.
        timing: A strip of the edit, which shows the file at the timeline frame `time`.
    """

    file: SourceFile
    offset: int = 0
    time: float | None = None
    timing: StripTiming | None = None

    def index(self, source: FrameSource, shown: int) -> int:
        """Return the index in the opened file while the source shows the filmed frame `shown`; it may be out of range.

        Raises:
            EffectError: The strip's retiming is unknown.
        """
        if self.time is None:
            return shown + self.offset
        if self.timing is None:
            return math.floor(self.time) + self.offset
        return Clip.of(source, self.timing).shown(self.time).source_frame


@dataclass(frozen=True)
class FileFrames:
    """A channel of a file's frames. By default they belong to the source's, `offset` frames ahead.

    Attributes:
        first: The timeline frame that shows the file's frame `offset`; the file then plays along the timeline.
        timing: A strip of the edit that shows the file.
    """

    file: SourceFile
    offset: int = 0
    first: float | None = None
    timing: StripTiming | None = None

    def at(self, frame: float) -> FileFrame:
        """Return the frame at a timeline frame."""
        if self.timing is not None:
            return FileFrame(file=self.file, offset=0, time=frame, timing=self.timing)
        return FileFrame(file=self.file, offset=self.offset, time=None if self.first is None else frame - self.first)


@dataclass(frozen=True)
class Ramp:
    """Values from 0 to 1 across the picture.

    A linear ramp goes from left to right; at any rotation, the outermost corners are 0 and 1. A radial one goes from
    the centre to the farthest corner. An angle goes once around the centre, clockwise from the top.

    Attributes:
        placed: Where it lies, turned and scaled about the picture's centre.
    """

    kind: RampKind
    placed: Placement = Placement()

    def values(self, width: int, height: int) -> np.ndarray:
        """Return (height, width) float32, 0 to 1, top row first."""
        scale = max(abs(self.placed.scale), _SMALLEST)
        x = np.arange(width) + 0.5 - width * (0.5 + self.placed.location[0])
        y = height * (0.5 - self.placed.location[1]) - (np.arange(height)[:, None] + 0.5)
        turn = math.radians(self.placed.rotation) + (math.pi if self.placed.scale < 0 else 0)
        cos, sin = math.cos(turn), math.sin(turn)
        along, across = x * cos + y * sin, y * cos - x * sin
        if self.kind == "angle":
            return (np.arctan2(along, across) / (2 * math.pi) % 1).astype(np.float32)
        if self.kind == "radial":
            values = np.hypot(along, across) / (scale * math.hypot(width, height) / 2)
        else:
            values = along / (scale * (width * abs(cos) + height * abs(sin))) + 0.5
        return np.clip(values, 0, 1).astype(np.float32)


@dataclass(frozen=True)
class Outline:
    """A matte inside closed curves (core/model/outlines.py)."""

    curves: Curves

    def values(self, width: int, height: int) -> np.ndarray:
        """Return (height, width) float32, 0 to 1, top row first."""
        return coverage(self.curves, width, height)


Content = FileFrame | Ramp | Outline | MaskShape


@dataclass(frozen=True)
class Matte:
    """A matte at one frame.

    Attributes:
        shutter: Index of the shutter whose coefficients the values are.
        opacity: 0 to 1, a factor after inversion.
        feather: The width of a hard edge, as a fraction of the picture's height.
        blend: "over" leaves the rest to what is beneath. "add" takes only from the default shutter, so that mattes that
            add up to 1 stand side by side.
    """

    shutter: int
    content: Content
    blend: Blend = "over"
    opacity: float = 1.0
    feather: float = 0.0
    invert: bool = False


class MatteReader(Protocol):
    """A reader of mattes' values, which keeps files open and the last values of each."""

    def values(self, mattes: tuple[Matte, ...], index: int, block: int) -> list[tuple[Hashable, np.ndarray]]:
        """Return for each matte a key that is equal for equal values, and the values at a frame of the source.

        Values are (h, w) float32, 0 to 1, per pixel or block of block × block pixels, without the opacity.

        Raises:
            UserError: They cannot be made.
        """

    def another(self) -> MatteReader:
        """Return a new reader for the same pictures."""

    def close(self) -> None:
        """Close the files. They are reopened when needed."""


def blended(coefficients: np.ndarray, mattes: tuple[Matte, ...], values: Sequence[np.ndarray]) -> np.ndarray:
    """Lay mattes over coefficients, Σ = 1: c ← (1 − m) c + m e for the matte's shutter e.

    Args:
        coefficients: (N, h, w), or (N, 1, 1) if they are the same everywhere.
        values: (h, w) of each matte, 0 to 1.
    """
    result = np.array(np.broadcast_to(coefficients, (len(coefficients), *np.shape(values[0]))))
    for matte, value in zip(mattes, values, strict=True):
        share = value * result.dtype.type(matte.opacity)
        if matte.blend == "add":
            share = np.minimum(share, result[0])
            result[0] -= share
        else:
            result *= 1 - share
        result[matte.shutter] += share
    return result
