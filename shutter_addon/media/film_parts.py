"""Write a movie in parts, each complete or missing, so that an interrupted bake can go on; and join the parts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core import atomic_write
from ..core.messages import MediaError
from .files import check_name
from .rendered_pictures import is_whole_movie

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import OutputContainer
    from av.video.stream import VideoStream

LENGTH = 32  # frames of a part
ENDING = ".mp4"
# 99 % of levels are within 3. For quick seeking, key frames are close, and no frame depends on a later one.
_OPTIONS = {"crf": "8", "preset": "fast", "tune": "fastdecode", "g": "12", "bf": "0"}


def write_part(path: Path, pictures: Iterable[np.ndarray], fps: Fraction) -> None:
    """Write pictures as an H.264 movie (MP4), which gets its final name only when it is complete.

    Args:
        path: The movie.
        pictures: sRGB values (H, W, 3 or 4) uint8, all of one size; alpha is ignored. If iterating raises OSError,
            ValueError, IndexError, OverflowError or an error of FFmpeg, it becomes a MediaError. Others are passed on.
        fps: The frame rate.

    Raises:
        MediaError: The movie cannot be written, or there are no pictures.
    """

    def fill(container: OutputContainer) -> int:
        stream, count = None, 0
        for picture in pictures:
            stream = stream or _stream(container, picture.shape, fps)
            container.mux(stream.encode(_frame(picture, stream, count)))
            count += 1
        if stream is None:
            raise MediaError(f"{path}: there are no frames")
        container.mux(stream.encode(None))
        return count

    _write(path, fill)


def _write(path: Path, fill: Callable[[OutputContainer], int]) -> None:
    """Write an MP4, which gets its final name only when it is complete.

    Args:
        path: The file.
        fill: Adds streams and frames to the opened file, and returns how many frames it has added. The written file is
            checked to have at least so many.

    Raises:
        MediaError: The file cannot be written, or has fewer frames.
    """
    import av

    try:
        with atomic_write.writing(path) as part:
            with av.open(check_name(part), "w", format="mp4") as container:
                count = fill(container)
            if not is_whole_movie(part, count):
                raise MediaError(f"{path}: could not be written whole")
    except (OSError, ValueError, IndexError, OverflowError, av.error.FFmpegError) as error:
        raise MediaError(f"{path}: cannot be written ({getattr(error, 'strerror', None) or error})") from None


def _stream(container: OutputContainer, shape: Sequence[int], fps: Fraction) -> VideoStream:
    """Add an H.264 video stream to an opened file. `shape` is the pictures' (H, W, …)."""
    stream = container.add_stream("libx264", rate=fps, options=_OPTIONS)
    stream.height, stream.width = shape[:2]
    stream.pix_fmt = "yuv420p" if shape[0] % 2 == shape[1] % 2 == 0 else "yuv444p"  # odd sizes have no halves
    context = stream.codec_context
    context.color_range, context.colorspace = 1, 1  # of video, BT.709
    context.color_primaries, context.color_trc = 1, 1
    return stream


def _frame(picture: np.ndarray, stream: VideoStream, index: int) -> VideoFrame:
    """Convert a picture (H, W, 3 or 4) uint8 to the frame number `index` of a stream, in the stream's pixel format."""
    import av

    levels = np.ascontiguousarray(picture[..., :3])
    frame = av.VideoFrame.from_ndarray(levels, "rgb24").reformat(
        format=stream.pix_fmt,
        src_colorspace="itu709",
        dst_colorspace="itu709",
        dst_color_range="MPEG",
        interpolation="AREA",
    )
    frame.pts, frame.time_base = index, 1 / stream.codec_context.framerate
    return frame


def join(paths: Sequence[Path], output: Path, fps: Fraction) -> None:
    """Join movies of `write_part` into one, without encoding them again.

    Args:
        paths: The movies, in the order in which they follow one another.
        output: The new movie. It gets its final name only when it is complete.
        fps: The frame rate of all of them.

    Raises:
        MediaError: A part cannot be read, or the movie cannot be written.
    """
    import av

    def fill(container: OutputContainer) -> int:
        stream, count = None, 0
        for path in paths:
            with av.open(check_name(path)) as read:
                if stream is None:
                    stream = container.add_stream_from_template(read.streams.video[0])
                    stream.time_base = 1 / fps
                for packet in read.demux(video=0):
                    if packet.size:
                        packet.stream, packet.time_base = stream, 1 / fps
                        packet.pts = packet.dts = count  # no frame depends on a later one
                        packet.duration = 1
                        container.mux(packet)
                        count += 1
        return count

    _write(output, fill)
