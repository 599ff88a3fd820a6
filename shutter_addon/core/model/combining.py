"""How the frames that a shutter exposes become one picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Mode = Literal["average", "lightest", "darkest", "median"]


@dataclass(frozen=True)
class Combine:
    """mode: the average of all, the lightest or the darkest of them, or their median (core.pixels.combined)

    Of the lightest and the darkest:
    by_luminance: whether a pixel's light is that of one frame; else each channel goes by itself
    threshold: luminance of linear light below which, or of the darkest above which, a frame leaves no trail beside
    what is shown; None: all leaves one
    softness: over how much luminance, around the threshold, that fades in"""

    mode: Mode = "average"
    by_luminance: bool = False
    threshold: float | None = None
    softness: float = 0.0

    @staticmethod
    def of(mode: Mode, by_luminance: bool = False, threshold: float | None = None, softness: float = 0.0) -> Combine:
        """What changes nothing of a mode is left out, so that equal ones are one."""
        if mode in ("average", "median"):
            return Combine(mode)
        return Combine(mode, by_luminance, threshold, 0.0 if threshold is None else softness)


AVERAGE = Combine()
