"""Levels of 8 bits as Blender makes them of scene-linear light, to the bit, dither included."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

_HASH = np.uint32(1103515245)
_SPREAD = np.float32(0.0033)  # of Blender's dither at an intensity of 1, in code values


@dataclass(frozen=True)
class Display:
    """What light becomes on its way to a file.

    dither: its intensity, 0 or more
    transfer: code values float32 that light float32 of any shape is shown as, each to the bit and by itself"""

    dither: float
    transfer: Callable[[np.ndarray], np.ndarray]

    def levels(self, light: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Levels uint8 of light (…, C) float32. noise: of its pixels (…), see `noise`."""
        return rounded(self.transfer(light) + noise[..., None])

    def noise(self, width: int, height: int) -> np.ndarray:
        """What is added to the code values of a picture (height, width) float32, bottom row first: the same to all its
        channels, and in all frames. It is not to be written to."""
        return _noise(width, height, self.dither)


@lru_cache(2)
def _noise(width: int, height: int, dither: float) -> np.ndarray:
    """The hash iqint3 (Jarzynski and Olano, Hash Functions for GPU Rendering, 2020) of a pixel's place, its evenly
    spread values made a triangle from −1 to 1."""
    if not dither:
        return np.zeros((height, width), np.float32)
    y, x = np.ogrid[:height, :width]
    x, y = x.astype(np.uint32), y.astype(np.uint32)
    across, up = _HASH * ((x >> 1) ^ y), _HASH * ((y >> 1) ^ x)
    even = (_HASH * (across ^ (up >> 3))).astype(np.float32) * np.float32(2**-31) - 1
    triangle = np.sign(even) * (1 - np.sqrt(1 - np.abs(even)))
    return triangle * _SPREAD * np.float32(dither)


def rounded(values: np.ndarray) -> np.ndarray:
    """The levels uint8 of code values float32 of any range: to the nearest."""
    return (np.float32(255) * np.clip(values, 0, 1) + np.float32(0.5)).astype(np.uint8)
