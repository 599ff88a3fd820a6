"""Which frame of its content a strip of Blender's sequencer shows: trimmed, retimed, reversed or with strobe."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RetimingKey:
    """A retiming key of a strip, as Blender stores it.

    Attributes:
        index: Its position in frames of the content before retiming.
        flag: Bits of eSeqRetimingKeyFlag; the first one begins a smooth transition between two speeds.
        factor: The position in the content that is shown there, 0 to 1.
    """

    index: float
    flag: int
    factor: float


@dataclass(frozen=True)
class StripTiming:
    """The timing of a strip that shows footage. Fields that are not explained here are those of Blender's strips.

    Attributes:
        name: The strip's.
        first: How many of the footage's frames come before the content: *Frame Offset* of a movie clip, else 0.
        scene_fps: Frames per second of the edit.
        strobe: Only every n-th frame of the content is shown, and held; 1: all are.
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
        """The first frame of the footage that is shown, without retiming."""
        return self.first + self.content_trim_start


def position(strip: StripTiming, rate: float, length: int, frame: float) -> np.float32:
    """Return which position in a strip's content a timeline frame shows, in frames from 0, in float32 like Blender.

    Args:
        strip: The strip.
        rate: From `playback_rate`.
        length: The number of frames of the content.
        frame: The timeline frame.
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
    """Return how many frames of a strip's content pass in a timeline frame, before retiming.

    That is the movie's rate / the scene's if the strip was imported to keep the movie's speed, else 1. Blender's API
    does not tell which. The strip's length does.

    Args:
        strip: The strip.
        length: The number of frames of the content.
        fps: The movie's frames per second; 0 for images.
    """
    rate = fps / strip.scene_fps
    if rate <= 0:  # images
        return 1.0
    shown = strip.content_end - strip.content_start
    natural = strip.keys[-1].index if len(strip.keys) > 1 else length
    return rate if abs(natural / rate - shown) < abs(natural - shown) or int(natural / rate) == shown else 1.0


def retimed(keys: Sequence[RetimingKey], position: float | np.float32) -> np.float32:
    """Apply retiming keys: convert a position in frames, before retiming, to the position in the content, 0 to 1.

    It is linear between keys, and an arc where Blender makes a smooth transition between two speeds.
    """
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
    """Return the speed between two retiming keys: by how much the shown position (0 to 1) changes per frame."""
    return np.float32(second.factor - first.factor) / np.float32(max(second.index - first.index, 1e-9))


def _arc(
    first: RetimingKey, speed_in: np.float32, second: RetimingKey, speed_out: np.float32, position: float | np.float32
) -> np.float32:
    """Return the shown position on a smooth transition between two speeds.

    It is the circle that leaves the first key with one slope and reaches the second key with the other.
    """
    # Its centre is on both normals, where x + slope·y is the same as at the key.
    slopes = np.array([[1.0, speed_in], [1.0, speed_out]])
    sums = [first.index + speed_in * first.factor, second.index + speed_out * second.factor]
    x, y = np.linalg.solve(slopes, sums)
    radius = math.hypot(first.index - x, first.factor - y)
    side = -1 if y > first.factor else 1
    return np.float32(y + side * math.sqrt(max(radius**2 - (position - x) ** 2, 0.0)))
