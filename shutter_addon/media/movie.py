"""Movies: the frames that Blender's movie strip shows, decoded by PyAV and converted to RGB as in Blender."""

import math
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import partial
from pathlib import Path

import av
import numpy as np
from av.container import InputContainer
from av.stream import Stream
from av.video.format import VideoFormat
from av.video.plane import VideoPlane
from av.video.reformatter import ColorRange, Interpolation, VideoReformatter
from av.video.stream import VideoStream
from numpy.typing import DTypeLike

from ..core.frames.frame_source import Decoded, FrameSource, Matrix, Planes, as_rgba, matrix
from ..core.messages import MediaError
from .decode import FrameReader, fraction, reason
from .files import check_file, check_index
from .reduced import reduced, reduced_size

# Blender's choice from YUV to RGB. libswscale's defaults are a level too dark and blur colors.
SCALER = Interpolation.POINT | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT
REDUCER = Interpolation.AREA | Interpolation.ACCURATE_RND | Interpolation.FULL_CHR_H_INT  # for smaller frames
_NO_COUNT = 1 << 31  # Blender cannot count so many frames; a header that claims them is damaged
# Whether frames have the position of chroma: since PyAV 19. Another extension may bring an older one.
_TELLS_CHROMA = hasattr(av.VideoFrame, "chroma_location")
_UNSPECIFIED = 2  # in ITU-T H.273
# Formats whose fields Blender interpolates. It blurs all others.
_WITH_FIELDS = frozenset({"yuv420p", "yuvj420p", "yuv422p", "yuvj422p", "yuv444p", "yuv411p", "gray"})
_PLANAR_420 = frozenset({"yuv420p", "yuvj420p"})
_PLANAR_YUV = re.compile(r"yuv[aj]?4\d\dp(\d+le)?")


class MovieSource(FrameSource):
    """A movie, decoded by PyAV. It gives the same frames that a movie strip of Blender shows.

    Frame i is what is on screen i / fps seconds after the stream's start: the last frame whose time stamp is not later,
    or the first one if all are later. So frames repeat or are skipped if the rate varies, and the last one repeats
    while the sound goes on. Samples are sRGB display values: uint8 of 8-bit movies, uint16 of deeper ones (even if they
    are floats).
    """

    transfer = "srgb"

    def __init__(self, path: str | Path, *, stream: int = 0, deinterlace: bool = False, divisor: int = 1) -> None:
        """Open a movie. Arguments and errors as for opening.open_source."""
        self.path = check_file(path)
        self.files = [self.path]
        self._deinterlace, self._divisor = deinterlace, divisor
        self.options = {"stream": stream, "deinterlace": bool(deinterlace)}
        self._to_planes, self._to_packed = VideoReformatter(), VideoReformatter()
        self._converting = threading.Lock()  # planes are converted on any thread
        self._reader = FrameReader(self.path, stream)
        try:
            self._probe()
        except av.error.FFmpegError as error:
            self.close()
            raise MediaError(f"{self.path.name}: cannot be read as a movie ({reason(error)})") from error
        except BaseException:
            self.close()
            raise

    def _probe(self) -> None:
        """Set this source's attributes, such as size, length and dtype, from the movie's header and first frame.

        Raises:
            MediaError: It has no such video stream, its length is unknown, or no frame can be decoded.
            av.error.FFmpegError: It cannot be opened.
        """
        file, first = self._reader.first()
        codec = file.stream.codec_context
        profile = f" ({codec.profile})" if codec.profile else ""
        self.file_kind = f"{file.container.format.name}, {codec.name}{profile}, {codec.pix_fmt}"
        self.fps = fraction(file.stream.guessed_rate)
        self.count = _count(file.container, file.stream, self.fps)
        if not 0 < self.count < _NO_COUNT:
            raise MediaError(f"{self.path.name}: its length is unknown; put it into an MP4 or MKV file first")
        self.has_audio = bool(file.container.streams.audio)
        self._step = float(1 / (self.fps * self._reader.time_base))
        self._space, self._is_full = self._reader.tags
        self._turns = round(first.rotation / 90) % 4  # counterclockwise, until pictures are upright
        self._range = ColorRange.JPEG if self._is_full else ColorRange.MPEG
        filmed = first.width, first.height
        size = reduced_size(first.width, self._divisor), reduced_size(first.height, self._divisor)
        self.width, self.height = size[::-1] if self._turns % 2 else size
        deep = max(component.bits for component in first.format.components) > 8
        self._format, self.dtype = "rgba64le" if deep else "rgba", np.dtype(np.uint16 if deep else np.uint8)
        # In Blender, 8-bit colors are straight, but those of deeper movies, which are floats there, are premultiplied.
        has_alpha = any(component.is_alpha for component in first.format.components)
        self.alpha = "opaque" if not has_alpha else "premultiplied" if deep else "straight"
        # libswscale would average straight colors without regard to alpha.
        in_conversion = size != filmed and self.alpha != "straight"
        self._size, self._scaler = (size, REDUCER) if in_conversion else (filmed, SCALER)

    def read(self, index: int) -> np.ndarray:
        return as_rgba(self.decoded(index))

    def _picture(self, index: int, frame: av.VideoFrame) -> np.ndarray:
        """Convert a decoded frame to RGBA pixels (H, W, 4). The index is used in the error's message."""
        with self._named(index):
            return self._pixels(frame)

    def decoded(self, index: int) -> Decoded:
        """Return a frame as RGBA (H, W, 4), or as planes of luma and chroma if a GPU can convert these.

        A GPU can convert 8-bit 4:2:0 planes in BT.601 or BT.709 of frames that are neither scaled, rotated nor
        deinterlaced. Planes are views of the decoder's memory. Converted by their matrix, they equal the result of
        `read` to the bit.

        Raises:
            MediaError, IndexError: As for FrameSource.read.
        """
        with self._named(index):
            frame = self._frame(index)
            if (to_rgb := self._matrix(frame)) is None:
                return self._pixels(frame)
            luma, cb, cr = map(_samples_of, frame.planes)
            return Planes(luma=luma, chroma=(cb, cr), matrix=to_rgb, rgba=partial(self._picture, index, frame))

    def grey(self, index: int) -> np.ndarray | None:
        """Return a frame's luma (height, width, 1) if the frame is grey, for mattes: a faster way to its luminance.

        Returns:
            Samples of the source's dtype, over the full range. They equal the luminance of RGB. None: the frame may
            have colors, because its chroma is not neutral, or its format is neither grey nor planar YUV.
        """
        with self._named(index):
            frame = self._frame(index)
            if not _is_grey(frame):
                return None
            return self._upright(self._converted(frame, "gray16le" if self.dtype == np.uint16 else "gray"))[..., None]

    def _frame(self, index: int) -> av.VideoFrame:
        """Return the decoded frame of an index, with the tags by which it is converted to RGB."""
        check_index(self, index)
        frame = self._reader.frame_at(self._reader.start + _round(index * self._step), self._step)
        if not frame.format.is_rgb:
            frame.colorspace, frame.color_range = self._space, self._range
        # Colors are converted later. As in Blender, libswscale assumes the default position of chroma.
        frame.color_primaries = frame.color_trc = _UNSPECIFIED
        if _TELLS_CHROMA:
            frame.chroma_location = 0
        return frame

    @contextmanager
    def _named(self, index: int) -> Iterator[None]:
        """Turn errors inside this context into a MediaError that names the frame."""
        try:
            yield
        except (av.error.FFmpegError, MediaError) as error:
            why = error if isinstance(error, MediaError) else reason(error)
            raise MediaError(f"frame {index} of {self.path.name} cannot be decoded: {why}") from error

    def _matrix(self, frame: av.VideoFrame) -> Matrix | None:
        """Return the matrix that converts a frame's luma and chroma to RGB, or None if a matrix alone is not enough."""
        if frame.format.name not in _PLANAR_420 or self._deinterlace or self._turns:
            return None
        if (frame.width, frame.height) != self._size or self._scaler != SCALER:
            return None
        return matrix(frame.colorspace, frame.format.name == "yuvj420p" or self._is_full)

    def _pixels(self, frame: av.VideoFrame) -> np.ndarray:
        """Return the RGBA pixels (H, W, 4) of a decoded frame: converted, deinterlaced, reduced and upright."""
        has_fields = frame.format.name in _WITH_FIELDS and frame.width % 4 == 0 and frame.height % 4 == 0
        by_fields = self._deinterlace and has_fields
        frame = _interpolate_fields(frame) if by_fields else frame
        picture = self._converted(frame, self._format)
        if self._deinterlace and not by_fields and self._divisor == 1:  # smaller frames average both fields
            picture = _blur_rows(picture, opaque=self.alpha == "opaque")
        if self.alpha == "straight":
            picture = reduced(picture, self._divisor, self.alpha)
        return self._upright(picture)

    def _converted(self, frame: av.VideoFrame, pix_fmt: str) -> np.ndarray:
        """Return a decoded frame as an array in a pixel format of FFmpeg."""
        with self._converting:
            # Converting to planes and then to packed colors takes libswscale half the time of converting directly.
            if pix_fmt == "rgba" and _is_opaque_yuv(frame.format):
                frame = self._reformatted(self._to_planes, frame, "gbrp")
            return self._reformatted(self._to_packed, frame, pix_fmt).to_ndarray()

    def _reformatted(self, by: VideoReformatter, frame: av.VideoFrame, pix_fmt: str) -> av.VideoFrame:
        """Return a decoded frame in another pixel format of FFmpeg, and in the size that is wanted."""
        if frame.interlaced_frame or not _TELLS_CHROMA:  # libswscale would scale each field by itself
            frame = _untold(frame)
        samples = ColorRange.JPEG if frame.format.is_rgb else frame.color_range
        width, height = self._size
        return by.reformat(frame, width, height, pix_fmt, None, None, self._scaler, samples, ColorRange.JPEG)

    def _upright(self, picture: np.ndarray) -> np.ndarray:
        """Return a picture rotated as the movie's header asks for, in memory of its own."""
        return np.require(np.rot90(picture, self._turns), requirements=["C", "W"])

    def close(self) -> None:
        """Close the file and end the decoder's threads. A later read opens it again."""
        self._reader.close()
        with self._converting:
            self._to_planes, self._to_packed = VideoReformatter(), VideoReformatter()


def _untold(frame: av.VideoFrame) -> av.VideoFrame:
    """Return a copy of a frame without its marks for interlaced fields and the position of chroma.

    libswscale would heed these marks, and Blender's conversion does not. PyAV cannot clear them.
    """
    copy = av.VideoFrame(frame.width, frame.height, frame.format.name)
    for own, plane in zip(frame.planes, copy.planes, strict=True):
        rows = np.frombuffer(own, np.uint8)[: own.height * own.line_size].reshape(own.height, own.line_size)
        width = min(own.line_size, plane.line_size)
        target = np.frombuffer(plane, np.uint8)[: own.height * plane.line_size].reshape(own.height, plane.line_size)
        target[:, :width] = rows[:, :width]
    for name in ("colorspace", "color_range", "color_primaries", "color_trc"):
        setattr(copy, name, getattr(frame, name))
    return copy


def _is_opaque_yuv(pixels: VideoFormat) -> bool:
    """Return whether a pixel format has luma and chroma, and no alpha."""
    return not pixels.is_rgb and len(pixels.components) == 3 and not any(each.is_alpha for each in pixels.components)


def _is_grey(frame: av.VideoFrame) -> bool:
    """Return whether the luma of a decoded frame is the luminance of its RGB: whether chroma is neutral or missing."""
    name, bits = frame.format.name, frame.format.components[0].bits
    if name.startswith("gray"):
        return True
    if not _PLANAR_YUV.fullmatch(name):
        return False
    neutral, dtype = 1 << (bits - 1), np.uint8 if bits == 8 else np.uint16
    return all((_samples_of(plane, dtype) == neutral).all() for plane in list(frame.planes)[1:3])


def _round(x: float) -> int:
    return math.floor(x + 0.5)  # as in C; Python rounds halves to even


def _count(container: InputContainer, stream: VideoStream, fps: Fraction) -> int:
    """Return the number of a movie's frames by its header, as Blender finds it without decoding. 0: unknown."""
    if not fps:
        return 0
    time_base = fraction(stream.time_base)
    if stream.duration is not None:
        return _round(float(stream.duration * time_base) * float(fps))
    if container.duration is None:
        return stream.frames
    sound = container.streams.audio[:1]
    late = _start(stream) - (_start(sound[0]) if sound else 0.0)
    return _round((container.duration / av.time_base - max(late, 0.0)) * float(fps))


def _start(stream: Stream) -> float:
    """Return when a stream starts, in seconds."""
    return float((stream.start_time or 0) * fraction(stream.time_base))


def _interpolate_fields(frame: av.VideoFrame) -> av.VideoFrame:
    """Deinterlace a frame as Blender does: a copy whose odd rows are filtered with (-1 4 2 4 -1)/8 down the columns."""
    result = av.VideoFrame(frame.width, frame.height, frame.format.name)
    result.colorspace, result.color_range = frame.colorspace, frame.color_range
    for source, target in zip(frame.planes, result.planes, strict=True):
        rows, out = _samples_of(source), _samples_of(target)
        r = np.concatenate([rows[:1], rows, rows[-1:], rows[-1:]]).astype(np.int16)  # r[i]: row i - 1
        odd = (-r[0:-4:2] + 4 * r[1:-3:2] + 2 * r[2:-2:2] + 4 * r[3:-1:2] - r[4::2] + 4) >> 3
        out[0::2], out[1::2] = rows[0::2], np.clip(odd, 0, 255)
    return result


def _blur_rows(picture: np.ndarray, opaque: bool) -> np.ndarray:
    """Deinterlace a picture by a vertical blur, as Blender does for formats whose fields it does not interpolate.

    The filter is (1 2 1) / 4, computed from the bottom row upward. What rounding leaves over is carried to the next
    row. Like Blender, this leaves the red of opaque pictures unchanged.

    Args:
        picture: RGBA (H, W, 4).
        opaque: Whether the movie has no alpha.

    Returns:
        A blurred copy.
    """
    result = picture.copy()
    rows = result[::-1, :, 1:] if opaque else result[::-1]
    wide = rows.astype(np.int64)
    total = np.concatenate([wide[:1], wide[:-1]]) + 2 * wide + np.concatenate([wide[1:], wide[-1:]])
    # The remainders add up along the column, so one running sum replaces a loop over the rows.
    rows[:] = np.diff((np.cumsum(total, axis=0) + 2) >> 2, axis=0, prepend=0)
    return result


def _samples_of(plane: VideoPlane, dtype: DTypeLike = np.uint8) -> np.ndarray:
    """Return the samples of a frame's plane as a view (height, width) of its memory."""
    samples = np.frombuffer(plane, dtype)
    return samples.reshape(-1, plane.line_size // samples.itemsize)[: plane.height, : plane.width]
