"""Convert scene-linear light to the 8-bit levels that Blender makes of it, to the bit, including dither."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

_HASH = np.uint32(1103515245)


@dataclass(frozen=True)
class Display:
    """The conversion from scene-linear light to the 8-bit levels that Blender would write to a file, to the bit.

    Attributes:
        dither: The intensity of dither (noise against banding) as in Blender's render settings; 0: no noise.
        transfer: Converts scene-linear light (any shape, float32) to code values for an sRGB display, as Blender does
            (same shape, float32; white is 1), element by element.
    """

    dither: float
    transfer: Callable[[np.ndarray], np.ndarray]

    def levels(self, light: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Convert light (…, C) float32 to levels uint8, with the noise (…) of each pixel added for dither."""
        return rounded(self.transfer(light) + noise[..., None])

    def noise(self, width: int, height: int) -> np.ndarray:
        """Return the noise to add to code values before they are rounded to levels (see `levels`).

        The noise is the same for all frames and all channels. Do not modify it: it is cached.

        Returns:
            The noise (height, width) float32, the bottom row first; zeros if `dither` is 0.
        """
        return _noise(width, height, self.dither)


@lru_cache(2)
def _noise(width: int, height: int, dither: float) -> np.ndarray:
    """Make Blender's dither noise: triangularly distributed, between −0.0033 · dither and 0.0033 · dither.

    The noise of a pixel is a hash of its place: iqint3 (Jarzynski and Olano, Hash Functions for GPU Rendering, 2020).

    Args:
        width, height: The picture's size in pixels.
        dither: The intensity; 0: zeros are returned.

    Returns:
        Noise (height, width) float32 to add to code values (white is 1), the bottom row first. Do not modify it.
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
    """Return code values float32 (white is 1) as the nearest levels uint8, clipped to 0 … 255."""
    return (np.float32(255) * np.clip(values, 0, 1) + np.float32(0.5)).astype(np.uint8)
