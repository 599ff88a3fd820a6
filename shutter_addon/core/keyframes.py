"""Keys on the timeline: which two surround a frame, how far between them, and with which ease."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from . import shutters

EASES = ("linear", "bezier", "constant")


def eased(u: float, ease: str) -> float:
    """Progress 0 to 1 through a span. "bezier" has flat handles of a third of the span: u²(3 − 2u)."""
    if ease == "constant":
        return 0.0 if u < 1 else 1.0
    return u * u * (3 - 2 * u) if ease == "bezier" else u


def span(frames: list[float], frame: float) -> tuple[int, int, float]:
    """Indices of the keys before and after `frame` in ascending `frames`, and the share 0 to 1 between them.

    Outside the keys both are the nearest one; on a key both are that key.
    """
    after = bisect_right(frames, frame)
    if after == 0:
        return 0, 0, 0.0
    before = after - 1
    if after == len(frames) or frames[before] == frame:
        return before, before, 0.0
    return before, after, (frame - frames[before]) / (frames[after] - frames[before])


def between_bars(first, second, u: float, interpolation: str = "displacement") -> np.ndarray:
    """Bars (L,) a share u of the way from one shutter to another: by displacement, or, as F-curves do, bar by bar
    ("value")."""
    if u <= 0:
        return np.asarray(first, dtype=np.float64)
    if u >= 1:
        return np.asarray(second, dtype=np.float64)
    if interpolation == "value":
        return (1 - u) * np.asarray(first, dtype=np.float64) + u * np.asarray(second, dtype=np.float64)
    return shutters.displace([first, second], [1 - u, u])
