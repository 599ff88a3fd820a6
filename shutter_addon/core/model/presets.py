"""Shutters by name: each preset makes L bars in [0, 1] from a window length and a few parameters."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np


def still(window: int, frame: int = 0) -> np.ndarray:
    """One sharp frame, a delta at `frame` (0 to L − 1; beyond the window: the last)."""
    bars = np.zeros(window)
    bars[min(max(frame, 0), window - 1)] = 1
    return bars


def angle(window: int, degrees: float = 180.0) -> np.ndarray:
    """A rotary disc: open for `degrees` of 360 of the window; the last bar may be a part."""
    return np.clip(window * degrees / 360.0 - np.arange(window), 0, 1)


def cuts(window: int, count: int = 2, width: int = 1) -> np.ndarray:
    """A disc with `count` even cuts, each `width` frames wide: that many pictures on top of each other."""
    bars = np.zeros(window)
    for start in np.floor(np.arange(count) * window / count).astype(int):
        bars[start : start + width] = 1
    return bars


def ramp_up(window: int) -> np.ndarray:
    """From almost closed to open: a trail that ends sharp."""
    return np.arange(1, window + 1) / window


def ramp_down(window: int) -> np.ndarray:
    """From open to almost closed."""
    return ramp_up(window)[::-1].copy()


def triangle(window: int) -> np.ndarray:
    """Rises to the middle of the window and falls again."""
    bars = 1 - np.abs(2 * (np.arange(window) + 0.5) / window - 1)
    return bars / bars.max()


def gaussian(window: int, sigma: float = 0.2) -> np.ndarray:
    """A bell around the middle; `sigma` in windows."""
    return np.exp(-0.5 * (((np.arange(window) + 0.5) / window - 0.5) / sigma) ** 2)


def trail(window: int, decay: float = 0.25) -> np.ndarray:
    """An exponential trail: a bar falls to 1/e of the first after `decay` windows."""
    return np.exp(-np.arange(window) / (decay * window))


def stutter(window: int, every: int = 4) -> np.ndarray:
    """Every n-th frame, as a strobe lights them."""
    return (np.arange(window) % every == 0).astype(float)


# name: (label, description, bars of a window). "Custom" is no preset: it is whatever the bars are.
PRESETS: dict[str, tuple[str, str, Callable[[int], np.ndarray]]] = {
    "STILL": ("Still Frame", "The shown frame alone", still),
    "ANGLE_45": ("45°", "Open for an eighth of the frames", partial(angle, degrees=45.0)),
    "ANGLE_90": ("90°", "Open for a quarter of the frames", partial(angle, degrees=90.0)),
    "ANGLE_180": ("180°", "Open for half of the frames, as film cameras are", angle),
    "ANGLE_270": ("270°", "Open for three quarters of the frames", partial(angle, degrees=270.0)),
    "ANGLE_360": ("360°", "Open for all frames", partial(angle, degrees=360.0)),
    "TWO_CUTS": ("Two Cuts", "Two frames on top of each other", cuts),
    "CUTS": ("Four Cuts", "Four frames on top of each other", partial(cuts, count=4)),
    "RAMP_UP": ("Ramp Up", "Opens from frame to frame: a trail with a sharp end", ramp_up),
    "RAMP_DOWN": ("Ramp Down", "Closes from frame to frame: a trail with a sharp start", ramp_down),
    "TRIANGLE": ("Triangle", "Opens to the middle frame and closes again", triangle),
    "GAUSSIAN": ("Gaussian", "A bell curve around the middle frame", gaussian),
    "TRAIL": ("Exponential Trail", "Fades quickly at first and slowly later on", trail),
    "STUTTER": ("Stutter", "Every fourth frame, as a strobe lights them", stutter),
    # Along two edges, these are a rolling shutter (paper Figure 11).
    "FIRST": ("First Frame", "The first of the frames alone", still),
    "LAST": ("Last Frame", "The last of the frames alone", lambda window: still(window, window - 1)),
}


def bars(name: str, window: int, position: str = "start") -> np.ndarray:
    """Bars (L,) of the preset `name`; position: as frame_state.Options has it. KeyError: no such preset."""
    _label, _description, make = PRESETS[name]
    if name != "STILL":
        return make(window)
    return still(window, {"center": (window - 1) // 2, "end": window - 1}.get(position, 0))
