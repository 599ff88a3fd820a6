"""Which frames are decoded in advance: those that a picture lacks, then those of the next ones."""

from __future__ import annotations

from collections.abc import Callable

from ..core.frames.frame_source import FrameSource

# Pictures whose frames are decoded in advance, and how many frames or bytes of them lie decoded at most, besides those
# on the device: enough for a long window, whose frames are decoded while its first picture is diffused and compiled.
_AHEAD, _DECODED, _DECODED_BYTES = 4, 8, 256 << 20


def want(source: FrameSource, index: int, direction: int, missing: Callable[[int], set[int]]) -> list[int]:
    """Has the frames decoded that the picture of frame `index` lacks, then those of the next pictures. Returns the
    frames to be wanted once that picture is made: the rest is on the device by then.

    missing: gives the source frames that the picture of a frame lacks, as far as cuts are known"""
    indices = (index + step * direction * source.step for step in range(_AHEAD + 1))
    lacking = [missing(min(max(shown, 0), source.count - 1)) for shown in indices]
    source.want(_in_order(source, lacking))
    return _in_order(source, [frames - lacking[0] for frames in lacking[1:]])


def _in_order(source: FrameSource, lacking: list[set[int]]) -> list[int]:
    frame_bytes = source.width * source.height * 4 * source.dtype.itemsize
    most = max(_DECODED, _DECODED_BYTES // frame_bytes)
    # One that is not built yet would be remembered as a fault, and may come before it is needed.
    wanted = dict.fromkeys(i for frames in lacking for i in sorted(frames) if source.has(i))
    return list(wanted)[:most]
