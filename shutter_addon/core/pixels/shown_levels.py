"""8-bit levels of scene-linear light as Blender makes them, to the bit, including dither."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

_HASH = np.uint32(1103515245)


@dataclass(frozen=True)
class Display:
    """Conversion of light to a file's levels.

    Attributes:
        dither: Its intensity, ≥ 0.
        transfer: Converts light float32 of any shape to code values float32, elementwise and to the bit.
    """

    dither: float
    transfer: Callable[[np.ndarray], np.ndarray]

    def levels(self, light: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Return levels uint8 of light (…, C) float32, with the `noise` (…) of its pixels."""
        return rounded(self.transfer(light) + noise[..., None])

    def noise(self, width: int, height: int) -> np.ndarray:
        """Return the noise (height, width) float32, bottom row first, that is added to code values of all channels.

        It is the same for all frames. Do not modify it.
        """
        return _noise(width, height, self.dither)


@lru_cache(2)
def _noise(width: int, height: int, dither: float) -> np.ndarray:
    """Return noise for each pixel with a triangular distribution from −1 to 1.

    It is the hash iqint3 of the pixel's place (Jarzynski and Olano, Hash Functions for GPU Rendering, 2020).
    """
    if not dither:
        return np.zeros((height, width), np.float32)
    y, x = np.ogrid[:height, :width]
    x, y = x.astype(np.uint32), y.astype(np.uint32)
    across, up = _HASH * ((x >> 1) ^ y), _HASH * ((y >> 1) ^ x)
    even = (_HASH * (across ^ (up >> 3))).astype(np.float32) * np.float32(2**-31) - 1
    triangle = np.sign(even) * (1 - np.sqrt(1 - np.abs(even)))
    return triangle * np.float32(0.0033) * np.float32(dither)  # code values, as in Blender


def rounded(values: np.ndarray) -> np.ndarray:
    """Return the nearest levels uint8 of code values float32 of any range."""
    return (np.float32(255) * np.clip(values, 0, 1) + np.float32(0.5)).astype(np.uint8)
