"""Patterns that distinguish shutters without colour; the reference of shaders/show.glsl."""

from collections.abc import Sequence

import numpy as np

COUNT = 8  # plain, rising lines, dots, falling lines, horizontal, vertical, hatched, grid
STRENGTH = 0.4  # opacity of the ink over a shutter's colour
_PERIOD, _SLANTED, _WIDTH, _RADIUS = 8.0, 12.0, 1.7, 1.8  # in units of the interface
_OFF = 0.3  # keeps pixels' middles off the lines' edges, where rounding would decide


def marks(index: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return where a shutter's pattern has ink: bool, like x and y, in units of the interface, y up.

    The first shutter's pattern is plain. Patterns repeat after COUNT shutters.
    """
    across, up = x % _PERIOD < _WIDTH, y % _PERIOD < _WIDTH
    rising, falling = (x - y + _OFF) % _SLANTED < _WIDTH, (x + y + _OFF) % _SLANTED < _WIDTH
    apart = np.hypot(x % _PERIOD - _PERIOD / 2, y % _PERIOD - _PERIOD / 2)
    patterns = across & False, rising, apart < _RADIUS, falling, up, across, rising | falling, across | up
    return patterns[index % COUNT]


def ink(color: Sequence[float]) -> tuple[float, float, float]:
    """Return the ink's colour on a colour (3,), both display code values."""
    luminance = np.dot(color, [0.2126, 0.7152, 0.0722])
    return (1.0, 1.0, 1.0) if luminance < 0.35 else (0.0, 0.0, 0.0)


def painted(color: Sequence[float], index: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return a colour (3,) with a pattern at places as for `marks`: (..., 3), display code values."""
    share = STRENGTH * marks(index, x, y)[..., None]
    return (1 - share) * np.asarray(color) + share * np.array(ink(color))
