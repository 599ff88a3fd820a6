"""Timing of a strip in Blender's sequencer: trimmed, retimed, reversed, strobed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RetimingKey:
    """A key: position in frames of the content before retiming, and the shown position, 0 to 1 of the content."""

    index: float
    flag: int
    factor: float


@dataclass(frozen=True)
class StripTiming:
    """Timing of a source strip. Fields have Blender's names and count timeline frames.

    Attributes:
        first: The frame of the medium that is the content's first.
        scene_fps: Frames per second of the edit.
        keys: The retiming keys, finite and in order.
        is_known: Whether the keys could be read; otherwise constant speed is assumed.
    """

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
        """The first frame of the medium that is shown, without retiming."""
        return self.first + self.content_trim_start


def position(strip: StripTiming, rate: float, length: int, frame: float) -> np.float32:
    """Return the position in the strip's content of a timeline frame, in frames, in float32 like Blender.

    Args:
        rate: From `playback_rate`.
        length: Frames of the content.
    """
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
    """Return the source frames per timeline frame before retiming.

    That is 1, or the movie's rate / the scene's if the strip keeps its speed. Blender's API does not tell; the strip's
    length does.
    """
    rate = fps / strip.scene_fps
    if rate <= 0:  # images
        return 1.0
    shown = strip.content_end - strip.content_start
    natural = strip.keys[-1].index if len(strip.keys) > 1 else length
    return rate if abs(natural / rate - shown) < abs(natural - shown) or int(natural / rate) == shown else 1.0


def retimed(keys: Sequence[RetimingKey], position: float | np.float32) -> np.float32:
    """Return the keys' value, 0 to 1, at a position in the content: lines, and arcs for transitions."""
    k = max((i for i, key in enumerate(keys[:-1]) if key.index <= position), default=0)
    first, second = keys[k], keys[k + 1]
    speed = _speed(first, second)
    # The first flag of eSeqRetimingKeyFlag: the key begins a smooth transition between two speeds.
    if first.flag & 1 and 0 < k < len(keys) - 2:
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
    """Return the value of the circle that leaves the first key with one slope and reaches the second with the other."""
    # Its centre is on both normals, where x + slope·y is the same as at the key.
    slopes = np.array([[1.0, speed_in], [1.0, speed_out]])
    sums = [first.index + speed_in * first.factor, second.index + speed_out * second.factor]
    x, y = np.linalg.solve(slopes, sums)
    radius = math.hypot(first.index - x, first.factor - y)
    side = -1 if y > first.factor else 1
    return np.float32(y + side * math.sqrt(max(radius**2 - (position - x) ** 2, 0.0)))
