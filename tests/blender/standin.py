"""Films whose motion is known, and random moments between frames in place of optical flow's, which are known, too."""

from itertools import pairwise

import cv2
import numpy as np

APART = 50  # levels by which frames differ on average that have nothing in common


class Between:
    """In place of flow.Between: moments that no blend or flow would give, and that follow from the two frames and the
    time alone. Those of frames that have nothing in common are the nearer one, as flow's are."""

    def __init__(self, first, second, *_):
        self._ends = first, second
        self._is_cut = np.abs(first.astype(float) - second).mean() > APART

    def moment(self, _pair, number, steps):
        if self._is_cut:
            return self._ends[2 * number > steps]
        seeds = (*(int(end.sum()) for end in self._ends), number * 16 // steps)
        frame = np.random.default_rng(seeds).integers(0, 256, self._ends[0].shape, dtype=np.uint8)
        frame[..., 3] = 255
        return frame


def moments(frames, steps):
    """All moments ((n - 1) * steps + 1, H, W, 4) of filmed frames (n, H, W, 4) uint8."""
    found = []
    for pair, (first, second) in enumerate(pairwise(frames)):
        between = Between(first, second)
        found += [first, *(between.moment(pair, number, steps) for number in range(1, steps))]
    return np.stack([*found, frames[-1]])


def spread(bars, steps):
    """The weights (L * steps,) of the moments of bars (L,), by the intervals that a moment stands for: each bar's light
    lies evenly on the half intervals towards its open neighbors."""
    weights = np.zeros(len(bars) * steps)
    for place, weight in enumerate(bars):
        sides = [side for side in (-1, 1) if 0 <= place + side < len(bars) and weight > 0 < bars[place + side]]
        if not sides:
            weights[place * steps] += weight
        for side in sides:
            for step in range(steps // 2 + 1):
                start, end = max((step - 0.5) / steps, 0), min((step + 0.5) / steps, 0.5)
                weights[place * steps + side * step] += weight / len(sides) * (end - start) / 0.5
    return weights


def moving(pixels, count=6, width=320, height=180):
    """Frames (count, height, width, 3) of a texture that moves to the left by pixels a frame."""
    noise = np.random.default_rng(2).integers(0, 256, (60, 160, 3), dtype=np.uint8)
    texture = cv2.resize(noise, None, fx=4, fy=4, interpolation=cv2.INTER_CUBIC)
    return np.stack([texture[20 : 20 + height, 8 + k * pixels : 8 + k * pixels + width] for k in range(count)])
