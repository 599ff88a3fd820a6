"""Which frame of its content a strip of Blender's sequencer shows: trimmed, retimed, reversed or with strobe."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RetimingKey:
    """A retiming key of a strip, as Blender stores it: which place of the content is shown at which time.

    Attributes:
        index: The time of the key: timeline frames since StripTiming.content_start, times the `playback_rate`. If the
            strip is reversed, they count back from the content's last timeline frame.
        flag: Bits of Blender's eSeqRetimingKeyFlag. If the lowest bit is set, a smooth transition between two speeds
            begins here and ends at the next key.
        factor: The place that is shown at this time, from 0, the content's start, to 1, its end.
    """

    index: float
    flag: int
    factor: float


@dataclass(frozen=True)
class StripTiming:
    """The timing of a strip of Blender's sequencer that shows footage. The content is the footage's part that it plays.

    Attributes:
        name: The strip's name.
        first: How many frames of the footage come before the content: *Frame Offset* of a clip of a movie, else 0.
        scene_fps: Frames per second of the edit.
        content_start, content_end: The timeline frame of the content's first frame, and one past its last, whether the
            strip's handles hide them or not.
        content_trim_start, content_trim_end: How many frames are cut off before and after the content, besides `first`.
        left_handle: The first timeline frame at which the strip is visible.
        use_reverse_frames: Whether the content plays backward.
        strobe: Only every strobe-th frame of the content is shown, and stays until the next one is; 1: all are shown.
        keys: The retiming keys, all finite, by ascending index; fewer than two: there is no retiming.
        is_known: Whether Blender's retiming keys could be read. If not, a constant speed is assumed.
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
    """Return which position in a strip's content a timeline frame shows, computed in float32 like Blender.

    Args:
        rate: Frames of the content per timeline frame before retiming, from `playback_rate`.
        length: The number of frames of the content.
        frame: The timeline frame.

    Returns:
        The position in frames of the content, 0 to length − 1, with a fraction. Timeline frames outside the content get
        its first or last frame. With a strobe, the position is rounded down to a multiple of the strobe.
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

    A strip can be imported so that it keeps the movie's speed: the rate is then fps / the scene's fps. Otherwise it is
    1. Blender's API does not tell which, so the one is chosen that agrees better with the strip's length.

    Args:
        length: The number of frames of the content.
        fps: The movie's frames per second. 0, for images: the result is 1.
    """
    rate = fps / strip.scene_fps
    if rate <= 0:  # images
        return 1.0
    shown = strip.content_end - strip.content_start
    natural = strip.keys[-1].index if len(strip.keys) > 1 else length
    return rate if abs(natural / rate - shown) < abs(natural - shown) or int(natural / rate) == shown else 1.0


def retimed(keys: Sequence[RetimingKey], position: float | np.float32) -> np.float32:
    """Apply retiming keys: convert a time in a strip to the place of the content that is shown then.

    The place changes linearly between keys, and on an arc where Blender makes a smooth transition between two speeds.
    Outside the keys, the speed between the two nearest ones continues.

    Args:
        keys: At least two, by ascending index.
        position: The time, in the unit of RetimingKey.index.

    Returns:
        The place, in the unit of RetimingKey.factor, at most 1.
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
    """Return the place that is shown at a time within a smooth transition between two speeds.

    Drawn over time, the place is an arc of the circle that leaves the first key with the slope `speed_in` and reaches
    the second key with the slope `speed_out`.

    Args:
        first, second: The keys at which the transition begins and ends.
        speed_in, speed_out: The speeds before and after it, in RetimingKey.factor per RetimingKey.index. They differ.
        position: The time, in the unit of RetimingKey.index.

    Returns:
        The place, in the unit of RetimingKey.factor.
    """
    # Its center is on both normals, where x + slope·y is the same as at the key.
    slopes = np.array([[1.0, speed_in], [1.0, speed_out]])
    sums = [first.index + speed_in * first.factor, second.index + speed_out * second.factor]
    x, y = np.linalg.solve(slopes, sums)
    radius = math.hypot(first.index - x, first.factor - y)
    side = -1 if y > first.factor else 1
    return np.float32(y + side * math.sqrt(max(radius**2 - (position - x) ** 2, 0.0)))
