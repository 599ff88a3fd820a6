"""Deinterlacing as Blender's movie strips do it, within the frame."""

import av
import numpy as np
from av.video.plane import VideoPlane
from numpy.typing import DTypeLike

PLANAR = frozenset({"yuv420p", "yuvj420p", "yuv422p", "yuvj422p", "yuv444p", "yuv411p", "gray"})


def has_fields(frame: av.VideoFrame) -> bool:
    """Whether Blender interpolates one field of such a frame; it blurs all others."""
    return frame.format.name in PLANAR and frame.width % 4 == 0 and frame.height % 4 == 0


def interpolate_fields(frame: av.VideoFrame) -> av.VideoFrame:
    """A copy of the frame, its odd rows filtered with (-1 4 2 4 -1)/8 down the columns."""
    result = av.VideoFrame(frame.width, frame.height, frame.format.name)
    result.colorspace, result.color_range = frame.colorspace, frame.color_range
    for source, target in zip(frame.planes, result.planes, strict=True):
        rows, out = samples_of(source), samples_of(target)
        r = np.concatenate([rows[:1], rows, rows[-1:], rows[-1:]]).astype(np.int16)  # r[i]: row i - 1
        odd = (-r[0:-4:2] + 4 * r[1:-3:2] + 2 * r[2:-2:2] + 4 * r[3:-1:2] - r[4::2] + 4) >> 3
        out[0::2], out[1::2] = rows[0::2], np.clip(odd, 0, 255)
    return result


def blur_rows(picture: np.ndarray, opaque: bool) -> np.ndarray:
    """A copy of the RGBA picture, filtered with (1 2 1)/4 down the columns from the bottom row upwards.

    It hands on what rounding leaves over to the next row. Blender leaves out an opaque picture's red."""
    result = picture.copy()
    rows = result[::-1, :, 1:] if opaque else result[::-1]
    wide = rows.astype(np.int64)
    total = np.concatenate([wide[:1], wide[:-1]]) + 2 * wide + np.concatenate([wide[1:], wide[-1:]])
    # The remainders add up along the column, so one running sum replaces a loop over the rows.
    rows[:] = np.diff((np.cumsum(total, axis=0) + 2) >> 2, axis=0, prepend=0)
    return result


def samples_of(plane: VideoPlane, dtype: DTypeLike = np.uint8) -> np.ndarray:
    """A plane's samples as a view (height, width) of its memory."""
    samples = np.frombuffer(plane, dtype)
    return samples.reshape(-1, plane.line_size // samples.itemsize)[: plane.height, : plane.width]
