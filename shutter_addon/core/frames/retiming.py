"""How a strip of Blender's sequencer lies on the timeline: trimmed, retimed, reversed, strobed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

# eSeqRetimingKeyFlag: the key starts a smooth transition between two speeds.
_TRANSITION_IN = 1 << 0


@dataclass(frozen=True)
class RetimingKey:
    """index: position in frames of the content, before retiming; factor: what it shows, 0 to 1 of the content."""

    index: float
    flag: int
    factor: float


@dataclass(frozen=True)
class StripTiming:
    """How a source strip lies on the timeline; the fields have Blender's names, and its frames of the timeline.

    first: the frame of the medium that is the content's first
    scene_fps: frames per second of the edit
    keys: the retiming keys, as Blender has them (are_retiming_keys)
    is_known: whether these could be read; otherwise it is taken to play evenly"""

    name: str
    first: int
    scene_fps: float
    content_start: float
    content_end: float
    content_trim_start: int
    content_trim_end: int
    left_handle: int
    use_reverse_frames: bool
    strobe: float
    keys: tuple[RetimingKey, ...] = ()
    is_known: bool = True

    @property
    def start(self) -> int:
        """The frame of the medium that is shown first, as far as it is not retimed."""
        return self.first + self.content_trim_start


def position(strip: StripTiming, rate: float, length: int, frame: float) -> np.float32:
    """Where in the strip's content, of so many frames, a timeline frame lies, in frames; in float32 as Blender reckons,
    ties included. rate: of playback_rate"""
    end = strip.content_end - 1
    position = np.float32(max(end - frame if strip.use_reverse_frames else frame - strip.content_start, 0.0))
    position *= np.float32(rate)
    if len(strip.keys) > 1:
        position = retimed(strip.keys, position) * np.float32(length)
    position = min(max(position, np.float32(0)), np.float32(length - 1))
    if strip.strobe > 1:
        position -= np.float32(math.fmod(position, strip.strobe))
    return position


def playback_rate(strip: StripTiming, length: int, fps: float) -> float:
    """Source frames per timeline frame, before it is retimed: 1, or the movie's rate over the scene's if the strip was
    added to keep its speed. Blender does not tell which; the strip's length does."""
    rate = fps / strip.scene_fps
    if rate <= 0:  # images
        return 1.0
    shown = strip.content_end - strip.content_start
    natural = strip.keys[-1].index if len(strip.keys) > 1 else length
    return rate if abs(natural / rate - shown) < abs(natural - shown) or int(natural / rate) == shown else 1.0


def are_retiming_keys(keys: Sequence[RetimingKey]) -> bool:
    """Whether keys can be Blender's: numbers, in the order of their frames."""
    numbers = [number for key in keys for number in (key.index, key.factor)]
    return all(map(math.isfinite, numbers)) and all(a.index <= b.index for a, b in pairwise(keys))


def retimed(keys: Sequence[RetimingKey], position: float | np.float32) -> np.float32:
    """What the keys make of a position in the content, 0 to 1: lines between them, arcs through transitions."""
    k = max((i for i, key in enumerate(keys[:-1]) if key.index <= position), default=0)
    first, second = keys[k], keys[k + 1]
    speed = _speed(first, second)
    if first.flag & _TRANSITION_IN and 0 < k < len(keys) - 2:
        speed, speed_out = _speed(keys[k - 1], first), _speed(second, keys[k + 2])
        if abs(speed - speed_out) * np.float32(keys[-1].index) >= 0.01:
            return min(np.float32(1), _arc(first, speed, second, speed_out, position))
    along = np.float32(position - first.index)
    return min(np.float32(1), np.float32(first.factor) + speed * along)


def _speed(first: RetimingKey, second: RetimingKey) -> np.float32:
    return np.float32(second.factor - first.factor) / np.float32(max(second.index - first.index, 1e-9))


def _arc(
    first: RetimingKey, speed_in: np.float32, second: RetimingKey, speed_out: np.float32, position: float | np.float32
) -> np.float32:
    """The circle that leaves the first key with one slope and reaches the second with the other."""
    # Its centre lies on both normals: x + slope·y is the same there as at the key.
    slopes = np.array([[1.0, speed_in], [1.0, speed_out]])
    sums = [first.index + speed_in * first.factor, second.index + speed_out * second.factor]
    x, y = np.linalg.solve(slopes, sums)
    radius = math.hypot(first.index - x, first.factor - y)
    side = -1 if y > first.factor else 1
    return np.float32(y + side * math.sqrt(max(radius**2 - (position - x) ** 2, 0.0)))
