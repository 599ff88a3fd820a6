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
    """Which frame of a matte file a matte shows, by one of three rules.

    Attributes:
        file: The matte file.
        offset: A number of the file's frames, which is added as below.
        time: None: the matte shows the file's frame n + `offset`, where n is the footage's filmed frame that is shown.
            Otherwise, without `timing`: the timeline frames since the start of the file's frame `offset`; the file
            shows frame ⌊`time`⌋ + `offset`.
        timing: The timing of a strip that plays the file. `time` is then the timeline frame, and `offset` is not used.
            None: no strip plays it.
    """

    file: SourceFile
    offset: int = 0
    time: float | None = None
    timing: StripTiming | None = None

    def index(self, source: FrameSource, shown: int) -> int:
        """Return the number, from 0, of the file's frame to show. It can be below 0 or beyond the file's last frame.

        Args:
            source: The opened file; only needed for its length and rate if there is a `timing`.
            shown: The footage's filmed frame that is shown, from 0; only used if `time` is None.
        """
        if self.time is None:
            return shown + self.offset
        if self.timing is None:
            return math.floor(self.time) + self.offset
        return Clip.of(source, self.timing).shown(self.time).source_frame


@dataclass(frozen=True)
class FileFrames:
    """A channel that gives the frame of a matte file (FileFrame) to show at each timeline frame.

    Attributes:
        file: The matte file.
        offset: Frames by which the file plays ahead of the footage, or of the timeline if there is a `first`.
        first: The timeline frame that shows the file's frame `offset`; the file then plays one frame per timeline
            frame. None: the file plays with the footage, frame n + `offset` at the footage's filmed frame n.
        timing: The timing of a strip that plays the file; `offset` and `first` are then not used. None: no strip plays
            it.
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

    A linear ramp rises from left to right; its start and end lie at the picture's outermost corners, at any rotation. A
    radial one rises from the center to 1 at the corners. An angle ramp rises clockwise from the top, once around the
    center, and jumps from 1 to 0 there. All this is before `placed` moves, turns and scales the ramp.

    Attributes:
        kind: The ramp's shape: "linear", "radial" or "angle".
        placed: Where the ramp lies: shifted, turned and scaled about the picture's center. Scale does not change an
            angle ramp. A negative scale adds half a turn to any ramp.
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
    """A matte that is 1 inside closed curves and 0 outside, and in between where a curve crosses a pixel.

    A place inside two overlapping curves is outside (see outlines.coverage).

    Attributes:
        curves: The curves, points in fractions of the picture, y up.
    """

    curves: Curves

    def values(self, width: int, height: int) -> np.ndarray:
        """Return the matte for a picture of this size in pixels: (height, width) float32, 0 to 1, top row first."""
        return coverage(self.curves, width, height)


Content = FileFrame | Ramp | Outline | MaskShape


@dataclass(frozen=True)
class Matte:
    """A matte at one frame: how much of a shutter each pixel gets.

    Attributes:
        shutter: The index of the shutter.
        content: What gives a value 0 to 1 for each pixel: a file's frame, a ramp, an outline or a mask.
        blend: How the matte changes a pixel's shares of the shutters. Its value v is the one after feather, inversion
            and opacity. "over": all shares are multiplied by 1 − v, then v is added to this shutter's. "add": v is
            taken from the default shutter's share only, at most what is left of that. So mattes which add up to 1 can
            lie side by side.
        opacity: 0 to 1, a factor for the values. It is applied last.
        feather: How wide a hard edge becomes by blurring, as a fraction of the picture's height. All values are
            blurred so, before inversion.
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
        """Return the values of mattes at a shown frame, each with a key for caching: equal keys mean equal values.

        Args:
            index: The footage's frame that is shown, from 0, counting moments (frames made between two filmed ones).
                Matte files have filmed frames only; the file's nearest frame is used beyond its ends.
            block: The values are means over blocks of `block` × `block` pixels; 1: one value per pixel.

        Returns:
            (key, values) for each matte: values (rows, columns of blocks) float32, 0 to 1, feathered and inverted, but
            without the opacity.

        Raises:
            UserError: A file cannot be read.
        """

    def another(self) -> MatteReader:
        """Return a new reader for the same pictures, with files of its own."""

    def close(self) -> None:
        """Close the files. They are opened again when needed."""


def blended(coefficients: np.ndarray, mattes: tuple[Matte, ...], values: Sequence[np.ndarray]) -> np.ndarray:
    """Return coefficients (N, h, w) with mattes laid over them, one after another. A pixel's sum stays 1.

    With share s = a matte's value · its opacity, "over" makes each coefficient c of a pixel c (1 − s), and then adds s
    to the matte's shutter. "add" moves s, at most coefficient 0, from shutter 0 to the matte's shutter.

    Args:
        coefficients: How much of each of N shutters a pixel gets: (N, h, w), or (N, 1, 1) if it is the same everywhere.
        mattes: The mattes, at least one, the lowest first.
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
