"""A moment between two filmed frames, as it is quickest to have: the two, and where what they show lies in between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

STEP = 4  # pixels between two vectors
UNIT = 32  # of a vector's coordinates, in a pixel
ZERO = 1 << 15  # what a coordinate of 0 is stored as


@dataclass(frozen=True)
class Moment:
    """A moment between two frames.

    Attributes:
        pair: numbers of the two frames among filmed ones: neighbours, but where those between repeat the first
        ends: the two frames (H, W, 4), of a FrameSource's type
        number, steps: how many of so many moments after the first frame it is
        vectors: uint16 (⌈H / STEP⌉, ⌈W / STEP⌉, 4). For every STEPth pixel: x and y of the way from the first frame to
            the second that passes there, in 1 / UNIT of a pixel from ZERO; and how surely the first and the second show
            what goes it, 0 to 255. Between these pixels they are bilinear.
        rgba: makes the frame, as FrameSource.read gives it
    """

    pair: tuple[int, int]
    ends: tuple[np.ndarray, np.ndarray]
    number: int
    steps: int
    vectors: np.ndarray
    rgba: Callable[[], np.ndarray]

    @property
    def nbytes(self) -> int:
        """Bytes that it takes; its frames are shared by all moments of the pair."""
        return self.vectors.nbytes + sum(end.nbytes for end in self.ends) // self.steps
