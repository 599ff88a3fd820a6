"""Mattes: how much of a shutter each pixel gets, from a file, a mask, a ramp or an outline instead of scribbles.

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
    """The frame of a matte file that a matte shows.

    Attributes:
        file: The file.
        offset: The number of frames that the matte plays ahead of the footage (or of `time`).
        time: Timeline frames since the one that shows the file's frame `offset`. None: the matte follows the footage,
            and shows the frame with the number of the footage's filmed frame plus `offset`.
        timing: The timing of a strip that shows the file; `time` is then a timeline frame.
    """

    file: SourceFile
    offset: int = 0
    time: float | None = None
    timing: StripTiming | None = None

    def index(self, source: FrameSource, shown: int) -> int:
        """Return the index of the frame in the opened file; it may be out of range.

        Args:
            source: The opened file.
            shown: The filmed frame of the footage that is shown, from 0.
        """
        if self.time is None:
            return shown + self.offset
        if self.timing is None:
            return math.floor(self.time) + self.offset
        return Clip.of(source, self.timing).shown(self.time).source_frame


@dataclass(frozen=True)
class FileFrames:
    """A channel of the frames of a matte file. By default they follow those of the footage, `offset` frames ahead.

    Attributes:
        file: The file.
        offset: The number of frames that the matte plays ahead.
        first: The timeline frame that shows the file's frame `offset`; the file then plays along the timeline. None: it
            follows the footage.
        timing: The timing of a strip that shows the file. `offset` and `first` then do not count.
    """

    file: SourceFile
    offset: int = 0
    first: float | None = None
    timing: StripTiming | None = None

    def at(self, frame: float) -> FileFrame:
        """Return which frame of the file a timeline frame shows."""
        if self.timing is not None:
            return FileFrame(file=self.file, offset=0, time=frame, timing=self.timing)
        return FileFrame(file=self.file, offset=self.offset, time=None if self.first is None else frame - self.first)


@dataclass(frozen=True)
class Ramp:
    """A gradient of values from 0 to 1 across the picture.

    A linear ramp goes from left to right; at any rotation, the outermost corners are 0 and 1. A radial one goes from
    the centre to the farthest corner. An angle goes once around the centre, clockwise from the top.

    Attributes:
        kind: Its shape.
        placed: Where it lies, turned and scaled about the picture's centre.
    """

    kind: RampKind
    placed: Placement = Placement()

    def values(self, width: int, height: int) -> np.ndarray:
        """Return the ramp for a picture of this size in pixels: (height, width) float32, 0 to 1, top row first."""
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
    """A matte that is 1 inside closed curves and 0 outside (core/model/outlines.py)."""

    curves: Curves

    def values(self, width: int, height: int) -> np.ndarray:
        """Return the matte for a picture of this size in pixels: (height, width) float32, 0 to 1, top row first."""
        return coverage(self.curves, width, height)


Content = FileFrame | Ramp | Outline | MaskShape


@dataclass(frozen=True)
class Matte:
    """A matte at one frame.

    Attributes:
        shutter: The index of the shutter that pixels get in proportion to the matte's values.
        content: What gives the values.
        blend: "over" leaves the rest to the regions beneath. "add" takes only from the default shutter, so that mattes
            that add up to 1 can be side by side.
        opacity: 0 to 1, a factor after inversion.
        feather: The width to which hard edges are blurred, as a fraction of the picture's height.
        invert: Whether each value v becomes 1 − v.
    """

    shutter: int
    content: Content
    blend: Blend = "over"
    opacity: float = 1.0
    feather: float = 0.0
    invert: bool = False


class MatteReader(Protocol):
    """Reads the values of mattes for pictures of one size. It keeps files open, and the last values in memory."""

    def values(self, mattes: tuple[Matte, ...], index: int, block: int) -> list[tuple[Hashable, np.ndarray]]:
        """Return the values of mattes in the shown frame, each with a key that is equal for equal values.

        Args:
            mattes: The mattes.
            index: The shown source frame.
            block: The side of the blocks of pixels that share a value.

        Returns:
            (key, values) for each matte: (h, w) float32, 0 to 1, without the opacity.

        Raises:
            UserError: A file cannot be read.
        """

    def another(self) -> MatteReader:
        """Return a new reader for the same pictures, with files of its own."""

    def close(self) -> None:
        """Close the files. They are opened again when needed."""


def blended(coefficients: np.ndarray, mattes: tuple[Matte, ...], values: Sequence[np.ndarray]) -> np.ndarray:
    """Return coefficients (N, h, w) with mattes laid over them, one after another.

    A matte with value m gives the shutter e its share: c ← (1 − m) c + m e. The sum of a pixel's coefficients stays 1.

    Args:
        coefficients: (N, h, w), or (N, 1, 1) if they are the same everywhere.
        mattes: The mattes, the lowest first.
        values: (h, w) of each matte, 0 to 1, without its opacity.
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
