"""The effect as it stands at one frame: what a picture is composed with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from . import scribbles

Interpolation = Literal["displacement", "value"]
Light = Literal["linear", "encoded"]
Exposure = Literal["normalized", "weighted"]
Edges = Literal["hold", "mirror", "shorten"]
Position = Literal["start", "center", "end"]


@dataclass(frozen=True)
class Options:
    """How a window of L frames becomes a picture; the recipe's fields of the same names.

    step: frames of the window for each that was filmed, which are more where there are in-between frames."""

    window: int
    position: Position = "start"
    interpolation: Interpolation = "displacement"
    light: Light = "linear"
    exposure: Exposure = "normalized"
    edges: Edges = "hold"
    aggregate: Literal[1, 2, 4] = 1
    border: bool = False
    stop_at_cuts: bool = True
    step: int = 1

    @property
    def before(self) -> int:
        """How many frames of the window lie before the filmed frame itself, which is `step` of them long."""
        filmed = -(-self.window // self.step)
        center, end = (filmed - 1) // 2 * self.step, max(self.window - self.step, 0)
        return {"start": 0, "center": center, "end": end}[self.position]


@dataclass(frozen=True)
class FrameState:
    """The effect at one frame: bars (N, L) float64, the first shutter is the default; moved shapes in order.

    reference: the exposure that counts as full brightness where exposure is "weighted"; the default shutter's.
    """

    options: Options
    bars: np.ndarray
    shapes: tuple[scribbles.Shape, ...] = ()
    reference: float | None = None

    @property
    def gains(self) -> np.ndarray:
        """Brightness (N,) of each shutter: all 1, or its exposure over the reference ("weighted").

        It scales linear light, after decoding where encoded values are summed, as an aperture would."""
        exposures = self.bars.sum(axis=1)
        if self.options.exposure == "normalized":
            return np.ones_like(exposures)
        return exposures / (self.reference or exposures[0])

    @property
    def key(self) -> tuple:
        """Equal for states that give the same picture; hashable."""
        shapes = ((s.shutter, s.kind, s.width, *(stroke.tobytes() for stroke in s.strokes)) for s in self.shapes)
        return self.options, self.bars.shape, self.bars.tobytes(), self.reference, tuple(shapes)

    def alone(self, chosen: int) -> FrameState:
        """The same where one shutter alone holds for the whole picture."""
        return FrameState(self.options, self.bars[chosen, None], (), self.reference or float(self.bars[0].sum()))
