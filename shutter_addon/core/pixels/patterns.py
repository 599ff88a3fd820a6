"""Patterns on the colors of shutters, for those who cannot tell these apart. shaders/show.glsl draws the same ones."""

from collections.abc import Sequence

import numpy as np

COUNT = 8  # plain, rising lines, dots, falling lines, horizontal, vertical, hatched, grid
STRENGTH = 0.4  # opacity of the ink over a shutter's color
_PERIOD, _SLANTED, _WIDTH, _RADIUS = 8.0, 12.0, 1.7, 1.8  # in units of the interface
_OFF = 0.3  # keeps pixels' middles off the lines' edges, where rounding would decide


def marks(index: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Tell which places have ink in a shutter's pattern.

    Args:
        index: The shutter's index, from 0. Shutter 0 has no ink at all; patterns repeat after COUNT shutters.
        x, y: Coordinates of the places, arrays of one shape, y up, in units of the interface (pixels if its scale is
            1).

    Returns:
        Booleans shaped like x and y.
    """
    across, up = x % _PERIOD < _WIDTH, y % _PERIOD < _WIDTH
    rising, falling = (x - y + _OFF) % _SLANTED < _WIDTH, (x + y + _OFF) % _SLANTED < _WIDTH
    apart = np.hypot(x % _PERIOD - _PERIOD / 2, y % _PERIOD - _PERIOD / 2)
    patterns = across & False, rising, apart < _RADIUS, falling, up, across, rising | falling, across | up
    return patterns[index % COUNT]


def ink(color: Sequence[float]) -> tuple[float, float, float]:
    """Return the color of a pattern's ink, black or white, on a shutter's color (3,). Both are display code values."""
    luminance = np.dot(color, [0.2126, 0.7152, 0.0722])
    return (1.0, 1.0, 1.0) if luminance < 0.35 else (0.0, 0.0, 0.0)


def painted(color: Sequence[float], index: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Paint a shutter's color with its pattern: the color, with ink at STRENGTH of opacity over it (`ink`).

    Args:
        color: The shutter's color (3,), display code values 0 to 1.
        index: The shutter's index, from 0, which determines the pattern (`marks`).
        x, y: Coordinates of the places to paint, arrays of one shape, y up, in units of the interface, as for `marks`.

    Returns:
        The colors at these places (…, 3), display code values.
    """
    share = STRENGTH * marks(index, x, y)[..., None]
    return (1 - share) * np.asarray(color) + share * np.array(ink(color))
