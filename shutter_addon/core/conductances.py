"""Conductances between neighbouring pixels: how freely coefficients spread from one to the other.

They are small where the picture has an edge, so that what a scribble says ends there.
"""

from __future__ import annotations

import numpy as np

# The difference of guides at which a conductance has fallen to 1/e.
SIGMA = 0.03
# No conductance is smaller: every pixel can be reached, and the equations stay solvable in single precision.
FLOOR = 3e-3
# The squared difference in units of SIGMA from which on a conductance is FLOOR.
STEEPEST = float(-np.log(FLOOR))


def conductances(guide: np.ndarray, strength: float) -> tuple[np.ndarray, np.ndarray]:
    """Conductances (h, w − 1) to the right neighbour and (h − 1, w) to the one below, float64 in FLOOR … 1.

    guide: (h, w, 3 or more), finite: display colours, 0 … 1, times the picture's scale; the first three channels count
    strength: 0 … 1; 0 gives 1 everywhere, 1 the full contrast
    """
    colours = np.asarray(guide)[..., :3].astype(np.float64)
    return tuple(_across(np.diff(colours, axis=axis), strength) for axis in (1, 0))


def _across(differences: np.ndarray, strength: float) -> np.ndarray:
    largest = np.abs(differences).max(axis=-1, initial=0.0)
    return np.exp(-strength * np.minimum((largest / SIGMA) ** 2, STEEPEST))
