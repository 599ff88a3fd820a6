"""Mattes: coefficients that are given for every pixel, by a file, a mask or a ramp, in place of scribbles.

They are laid over the coefficients that scribbles give, in the order of the regions, the later over the earlier.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from ..frames.retiming import StripTiming
from .clip import Clip, Medium
from .masks import MaskShape
from .outlines import Curves, coverage

Blend = Literal["over", "add"]
# What gives an outline's matte between two drawings: the footage's own motion, or curves that go straight.
Between = Literal["carried", "straight"]
RampKind = Literal["linear", "radial", "angle"]
# A placement's scale from which on a ramp is a step, or none at all.
_SMALLEST = 1e-6


class MatteFile(Hashable, Protocol):
    """A movie, an image sequence or a picture that mattes are read from; equal where it gives the same values."""

    def open(self) -> MatteSource:
        """It, opened. MediaError: it cannot be read."""


class MatteSource(Medium, Protocol):
    """What was opened."""

    def read(self, index: int) -> np.ndarray:
        """The values (height, width) float32 of a frame, 0 to 1, top row first. Beyond its ends the nearest one's.
        MediaError: they cannot be read."""

    def close(self) -> None:
        """Closes the file."""


@dataclass(frozen=True)
class NoFile:
    """A MatteFile of which nobody may ask for values: a recipe's, as long as it is not known where that lies."""

    def open(self) -> MatteSource:
        raise NotImplementedError


@dataclass(frozen=True)
class FileFrame:
    """A frame of a file.

    offset: from the filmed frame of the source that is shown to the matte's, both counted from 0
    time: frames since the one that shows frame `offset`, which count in place of the source's
    timing: or a strip of the edit, which shows the frame at the timeline frame `time`"""

    file: MatteFile
    offset: int = 0
    time: float | None = None
    timing: StripTiming | None = None

    def index(self, source: MatteSource, shown: int) -> int:
        """Which frame it is, of the opened file, where the source shows the filmed frame `shown`; perhaps beyond its
        ends. EffectError: how the strip is retimed cannot be known."""
        if self.time is None:
            return shown + self.offset
        if self.timing is None:
            return math.floor(self.time) + self.offset
        return Clip.of(source, self.timing).shown(self.time).source_frame


@dataclass(frozen=True)
class FileFrames:
    """Channel of the frames of a file: as the source shows its own, `offset` frames on.

    first: the timeline frame that shows the file's frame `offset`, and later ones those behind it, in place of that
    timing: or a strip of the edit, that shows the file as this says"""

    file: MatteFile
    offset: int = 0
    first: float | None = None
    timing: StripTiming | None = None

    def at(self, frame: float) -> FileFrame:
        """What is shown at a timeline frame."""
        if self.timing is not None:
            return FileFrame(file=self.file, offset=0, time=frame, timing=self.timing)
        return FileFrame(file=self.file, offset=self.offset, time=None if self.first is None else frame - self.first)


@dataclass(frozen=True)
class Ramp:
    """Values from 0 to 1 across the picture.

    linear: from left to right, where the first and the last corner of the picture are 0 and 1, whichever way it is
    turned; radial: from the centre to the farthest corner; angle: once around the centre, clockwise from its top
    location: (2,) fractions of the picture, rotation: degrees counter-clockwise, scale: about the picture's centre"""

    kind: RampKind
    location: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    scale: float = 1.0

    def values(self, width: int, height: int) -> np.ndarray:
        """(height, width) float32, 0 to 1, top row first."""
        scale = max(abs(self.scale), _SMALLEST)
        x = np.arange(width) + 0.5 - width * (0.5 + self.location[0])
        y = height * (0.5 - self.location[1]) - (np.arange(height)[:, None] + 0.5)
        turn = math.radians(self.rotation) + (math.pi if self.scale < 0 else 0)
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
    """What closed curves enclose (core.model.outlines)."""

    curves: Curves

    def values(self, width: int, height: int) -> np.ndarray:
        """As Ramp.values."""
        return coverage(self.curves, width, height)


Content = FileFrame | Ramp | Outline | MaskShape


@dataclass(frozen=True)
class Matte:
    """A matte at one frame.

    shutter: index of the shutter that gets its values as coefficients
    opacity: 0 to 1, what they are multiplied by, once they are inverted
    feather: over what part of the picture's height a hard edge is spread
    blend: "over": what is beneath shares the rest; "add": the default shutter alone gives what the matte takes, so that
    mattes which add up to 1 stand side by side"""

    shutter: int
    content: Content
    blend: Blend = "over"
    opacity: float = 1.0
    feather: float = 0.0
    invert: bool = False


class MatteReader(Protocol):
    """What makes values of mattes. It keeps files open, and the last values of each."""

    def values(self, mattes: tuple[Matte, ...], index: int, block: int) -> list[tuple[Hashable, np.ndarray]]:
        """Of each matte, at a frame of the source, its values (h, w) float32, 0 to 1, of pixels, or of blocks of block
        × block pixels, without its opacity; and a key that is equal for equal values. One of UserError."""

    def another(self) -> MatteReader:
        """A new one for the same pictures."""

    def close(self) -> None:
        """Closes the files; they are opened again when they are needed."""


def blended(coefficients: np.ndarray, mattes: tuple[Matte, ...], values: Sequence[np.ndarray]) -> np.ndarray:
    """Coefficients (N, h, w), Σ = 1, with mattes laid over them: c ← (1 − m) c + m e for the matte's shutter e.

    coefficients: (N, h, w), or (N, 1, 1) for those of the whole picture; values: of each matte (h, w), 0 to 1"""
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
