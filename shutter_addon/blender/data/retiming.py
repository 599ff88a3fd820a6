"""Which source frame a strip shows at a timeline frame: Blender's own answer, which its Python API does not give."""

import ctypes
import math
from bisect import bisect_left
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from . import source_media
from .validation import EffectError

# eSeqRetimingKeyFlag: the key starts a smooth transition between two speeds.
_TRANSITION_IN = 1 << 0
# Of factors, which are float32.
_CLOSE = 1e-4


@dataclass(frozen=True)
class RetimingKey:
    """index: position in frames of the content, before retiming; factor: what it shows, 0 to 1 of the content."""

    index: float
    flag: int
    factor: float


def source_frame(strip, frame: float, medium, scene_fps: float) -> int:
    """Frame of the medium that a source strip shows at a timeline frame; medium: it, opened, as a ShotSource.

    Trims, cuts, playback rate, retiming keys, reversed frames and strobe as Blender's sequencer applies them. Where
    there are frames between filmed ones, it is the nearest of all, which Blender knows nothing of. EffectError: how the
    strip is retimed cannot be known.
    """
    length = max(1, medium.filmed - strip.content_trim_start - strip.content_trim_end)
    keys = _retiming_keys(strip)
    rate = _playback_rate(strip, keys, length, float(medium.fps or 0) / medium.step / scene_fps)
    if strip.type == "MOVIECLIP" and abs(length / rate - (strip.content_end - strip.content_start)) > 1:
        sentence = rpt_('strip "{strip}" is not as long as its clip: retimed clips are not supported')
        raise EffectError(sentence.format(strip=strip.name))

    def position(time):
        return _position(strip, keys, rate, length, time)

    first = strip.content_trim_start + (source_media.first_frame(strip) if strip.type == "MOVIECLIP" else 0)
    if medium.step > 1:
        return nearest(first + float(position(frame)), medium)
    if strip.type == "MOVIECLIP":  # Blender takes the whole part
        return first + int(position(frame))
    # Blender decodes the nearest frame, but keeps it for every position with the same whole part: of a slow strip that
    # plays forward, the first of those positions decides.
    whole = int(position(frame))
    earlier = range(1, max(math.floor(frame - strip.left_handle), 0) + 1)
    frame -= bisect_left(earlier, True, key=lambda back: int(position(frame - back)) != whole)
    index = math.floor(position(frame) + np.float32(0.5))
    return first + min(index, length - 1)


def nearest(filmed: float, medium) -> int:
    """The frame of the medium that is nearest to a time, which counts filmed frames from 0 on."""
    return min(max(math.floor(filmed * medium.step + 0.5), 0), medium.count - 1)


def _position(strip, keys, rate: float, length: int, frame: float) -> np.float32:
    """Where in the strip's content a timeline frame lies, in frames; in float32 as Blender reckons, ties included."""
    end = strip.content_end - 1
    position = np.float32(max(end - frame if strip.use_reverse_frames else frame - strip.content_start, 0.0))
    position *= np.float32(rate)
    if len(keys) > 1:
        position = retimed(keys, position) * np.float32(length)
    position = min(max(position, np.float32(0)), np.float32(length - 1))
    if strip.strobe > 1:
        position -= np.float32(math.fmod(position, strip.strobe))
    return position


def _playback_rate(strip, keys, length: int, rate: float) -> float:
    """Source frames per timeline frame: 1, or the movie's rate over the scene's if the strip was added to keep its
    speed. Blender does not tell which; the strip's length does."""
    if rate <= 0:  # images
        return 1.0
    shown = strip.content_end - strip.content_start
    natural = keys[-1].index if len(keys) > 1 else length
    return rate if abs(natural / rate - shown) < abs(natural - shown) or int(natural / rate) == shown else 1.0


def _retiming_keys(strip) -> list[RetimingKey]:
    """The strip's retiming keys from Blender's memory: Python gets their timeline frames, but not what they show.

    Of a clip strip it gets none at all.
    SeqRetimingKey begins with double strip_frame_index, int flag, float retiming_factor. EffectError: not in this
    Blender.
    """

    class Raw(ctypes.Structure):
        _fields_ = (("index", ctypes.c_double), ("flag", ctypes.c_int), ("factor", ctypes.c_float))

    shown = list(getattr(strip, "retiming_keys", ()))
    raw = [Raw.from_address(key.as_pointer()) for key in shown]
    keys = [RetimingKey(key.index, key.flag, key.factor) for key in raw]
    if not are_retiming_keys(keys, [key.timeline_frame - strip.content_start for key in shown]):
        sentence = rpt_('strip "{strip}": its retiming keys cannot be read in this version of Blender')
        raise EffectError(sentence.format(strip=strip.name))
    return keys


def are_retiming_keys(keys: list[RetimingKey], indices: list[float]) -> bool:
    """Whether keys are as Blender has them: from the first frame on, which shows the content's start, to the last one,
    which shows its end, in order, and where Python sees them. indices: whole frames behind the content's start."""
    if not keys and not indices:
        return True
    factors = [key.factor for key in keys]
    return (
        len(keys) == len(indices)
        and all(abs(key.index - index) <= 1 for key, index in zip(keys, indices, strict=True))
        and all(first.index <= second.index for first, second in pairwise(keys))
        and all(-_CLOSE <= factor <= 1 + _CLOSE for factor in factors)
        and abs(keys[0].index) <= _CLOSE
        and abs(factors[0]) <= _CLOSE
        and (len(keys) == 1 or abs(factors[-1] - 1) <= _CLOSE)
    )


def retimed(keys: list[RetimingKey], position: float) -> np.float32:
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


def _arc(first: RetimingKey, speed_in: float, second: RetimingKey, speed_out: float, position: float) -> np.float32:
    """The circle that leaves the first key with one slope and reaches the second with the other."""
    # Its centre lies on both normals: x + slope·y is the same there as at the key.
    slopes = np.array([[1.0, speed_in], [1.0, speed_out]])
    sums = [first.index + speed_in * first.factor, second.index + speed_out * second.factor]
    x, y = np.linalg.solve(slopes, sums)
    radius = math.hypot(first.index - x, first.factor - y)
    side = -1 if y > first.factor else 1
    return np.float32(y + side * math.sqrt(max(radius**2 - (position - x) ** 2, 0.0)))
