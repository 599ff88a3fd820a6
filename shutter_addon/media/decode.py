"""Decode frames of a video stream by time stamp, in any order, with the same result as decoding from the start.

A run is one decode from a place in the file onward. A frame is found by going on with the last run, or by a seek to a
key frame before it, which begins another.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Generator, Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import av
from av.container import InputContainer
from av.packet import Packet
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType
from av.video.reformatter import ColorRange
from av.video.stream import VideoStream

from ..core.messages import MediaError
from .files import FOREIGN

if TYPE_CHECKING:
    from av.rational import AVRational

KEPT_DECODING = 16  # up to as many frames ahead, decoding on is faster than a seek
MISSING = 1.0  # seconds that a file may end before its declared end without counting as cut off
# In MPEG program streams a seek may end inside a picture, whose rest gets the time stamp of the next one. There only
# key frames count that a decode from the start has seen.
MISLEADING = frozenset({"mpeg"})
# FFmpeg opens pictures as movies of one frame: these formats, and all that end in "_pipe".
STILLS = frozenset({"image2", "alias_pix", "brender_pix", "fits", "ico"})
DAMAGED = "its data are damaged"


class File(NamedTuple):
    """An open file with its video stream and decoder."""

    container: InputContainer
    stream: VideoStream
    codec: VideoCodecContext


class FrameReader:
    """Reads frames of one video stream of a file, for one thread at a time. It keeps two frames in memory.

    Attributes are set when `first` or `frame_at` opens the file.

    Attributes:
        time_base: The unit of time stamps in seconds.
        start: The stream's first time stamp, in this unit.
        tags: The number of the stream's YUV matrix, and whether its range is full (`_tags`).
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        """Prepare to read a file's video stream. `number`: which one of several."""
        self._path, self._number, self._threads = path, number, "AUTO"
        self._container: InputContainer | None = None
        self._run: _Run | None = None
        self._landmarks = _Landmarks()

    def first(self) -> tuple[File, av.VideoFrame]:
        """Open the file again, and return it and its first frame.

        Raises:
            MediaError: It has no such video stream, or no frame can be decoded.
            av.error.FFmpegError: It cannot be opened.
        """
        run = self._restart()
        if run.shown is None:
            raise MediaError(f"{self._path.name}: no frame of it can be decoded")
        return run.file, run.shown.frame

    def frame_at(self, time: float, step: float) -> av.VideoFrame:
        """Return the frame shown at a time: the one before the first frame with a later time stamp, or the first one.

        Blender chooses the same frame, also where time stamps go back.

        Args:
            time: In units of time_base.
            step: The usual distance between two frames in this unit.

        Raises:
            MediaError: The file should have the frame, but it cannot be decoded. The message is only the reason.
        """
        try:
            return self._find(time, step)
        except MediaError:
            if self._threads == "SLICE":
                raise
        self._threads = "SLICE"  # an error while several frames are decoded at once also loses good ones
        self._restart()
        return self._find(time, step)

    def _find(self, time: float, step: float) -> av.VideoFrame:
        """Return the frame shown at a time, as `frame_at` does, without a second try after an error."""
        run = self._run_at(time, step)
        if run.is_first and run.next is not None and time <= _known(run).time == run.next.time:
            # If several key frames have that time, a seek finds the last one, as in Blender.
            run = self._run_from(run.file, run.next.time, run.next.time) or self._restart()
        while run.next is not None and _known(run).time < time and run.next.time <= time:
            run.advance()
        shown = _known(run)
        if any(shown.time < lost <= time for lost in run.lost):
            raise MediaError(run.fault)
        if time >= shown.time + max(shown.frame.duration, step) and run.cut_off():
            raise MediaError(run.fault or "the file is cut off")
        return shown.frame

    def close(self) -> None:
        """Close the file and end the decoder's threads. The next frame opens it again."""
        if self._run is not None:
            self._run.close()
        if self._container is not None:
            self._container.close()
        # PyAV's decoder has no `close`; its threads end when nothing refers to it.
        self._container = self._run = None

    def _is_near(self, run: _Run, time: float, step: float) -> bool:
        """Return whether decoding on in a run (`_Run`) reaches the frame shown at a time, and faster than a seek."""
        if run.shown is None or time < run.shown.time:
            return run.is_first
        if time <= run.passed:
            return False
        return run.next is None or time - run.next.time <= max(KEPT_DECODING, self._landmarks.longest) * step

    def _run_at(self, time: float, step: float) -> _Run:
        """Return a decode (`_Run`) that will soon reach the frame shown at a time.

        It is the last one if that is near, else one that begins with a seek, or at the file's start.
        """
        if (run := self._run) is None:
            return self._restart()
        if self._is_near(run, time, step):
            return run
        tries = (self._run_from(run.file, round(time - back * step), time) for back in (0, 3, 50, 400))
        return next(filter(None, tries), None) or self._restart()

    def _run_from(self, file: File, start: int, time: float) -> _Run | None:
        """Seek to a key frame near the time stamp `start`, and decode from there.

        Returns:
            The decode (`_Run`). None: the seek fails, no frame follows, or the first one is later than `time` or refers
            to earlier frames.
        """
        try:
            file.container.seek(start, stream=file.stream)
        except av.error.FFmpegError:
            return None
        file.codec.flush_buffers()
        run = self._begin(file, seeking=True)
        if (shown := run.shown) is None or shown.time > time:
            return None
        # Without an I frame (wrong index, gradual refresh), the next frames would lack references.
        return run if shown.frame.key_frame or shown.frame.pict_type == PictureType.I else None

    def _restart(self) -> _Run:
        """Open the file again and decode from its start: a seek there fails with an edit list or without an index."""
        self.close()
        self._container = av.open(str(self._path))
        stream = _video_stream(self._container, self._path.name, self._number)
        self.time_base, self.start = fraction(stream.time_base), stream.start_time or 0
        self.tags = _tags(stream.codec_context)  # before the decoder overwrites them
        return self._begin(File(self._container, stream, _decoder(stream, self._threads)), seeking=False)

    def _begin(self, file: File, seeking: bool) -> _Run:
        """Close the last decode, and start one from where the file's container stands.

        Args:
            file: The open file.
            seeking: Whether the caller has moved the container by a seek, so that it is not at the file's start.
        """
        if self._run is not None:
            self._run.close()
            self._run = None
        self._run = _Run(file, self._landmarks, seeking)
        return self._run


class _Landmarks:
    """The key frames of a stream that were seen so far, which tell where decoding may begin.

    Attributes:
        longest: The most frames from one key frame to the next.
    """

    def __init__(self) -> None:
        self._seen: dict[tuple[int | None, int], bool] = {}  # whether no packet before it has a later time
        self._latest, self._goes_back = -math.inf, False
        self.longest = self._since = 0

    def note(self, packet: Packet, from_start: bool) -> None:
        """Note the next packet of a decode. `from_start`: whether the decode began at the file's start."""
        self._since = 0 if packet.is_keyframe else self._since + 1
        self.longest = max(self.longest, self._since)
        time = time_of(packet)
        if packet.is_keyframe and from_start:
            sound = self._seen.setdefault((time, packet.size), time is None or time >= self._latest)
            self._goes_back |= not sound
        if packet.pts is not None and from_start:
            self._latest = max(self._latest, packet.pts)

    def is_sound(self, packet: Packet, misleading: bool) -> bool:
        """Return whether decoding may begin at a key frame: whether no packet before it in the file has a later time.

        This is known of key frames that a decode from the file's start has passed. Others count as sound, unless
        `misleading` is True or one of the known ones is unsound.

        Args:
            packet: The key frame's.
            misleading: Whether key frames of the file's format cannot be trusted.
        """
        return self._seen.get((time_of(packet), packet.size), not (misleading or self._goes_back))


class _Timed(NamedTuple):
    """A decoded frame with its time stamp."""

    time: int
    frame: av.VideoFrame


class _Run:
    """A decode from a place in the file onward, frame after frame.

    Attributes:
        shown: The frame that it has reached, None past the end.
        next: The frame after it, None past the end.
        fault: The message of the last error, or "".
        is_first: Whether `shown` is the file's first frame.
        passed: The latest time stamp of a frame before `shown`.
        lost: The time stamps of frames that could not be decoded.
    """

    def __init__(self, file: File, landmarks: _Landmarks, seeking: bool) -> None:
        self.file, self._landmarks = file, landmarks
        self.fault, self.is_first = "", not seeking
        self._awaited: list[int] = []
        self.lost: list[int] = []
        self._end = self.passed = -math.inf
        self._ended = self._broken = False
        self._frames = self._decoded(seeking)
        self.shown = next(self._frames, None)
        self.next = next(self._frames, None)

    def close(self) -> None:
        """End this decode, so that its memory is freed at once: it and its generator refer to each other."""
        self._frames.close()

    def advance(self) -> None:
        """Go to the next frame: set `shown` to `next`, and decode the one after it.

        Raises:
            MediaError: There is no frame to go on from: `shown` is None.
        """
        self.passed = max(self.passed, _known(self).time)
        self.shown, self.is_first = self.next, False
        self.next = next(self._frames, None)

    def cut_off(self) -> bool:
        """Return whether reading the file failed, or ended over MISSING seconds before the end its header declares."""
        container = self.file.container
        if self._broken or not self._ended or container.duration is None:
            return self._broken
        promised = ((container.start_time or 0) + container.duration) / av.time_base
        return promised - self._end > MISSING

    def _decoded(self, seeking: bool) -> Generator[_Timed, None, None]:
        """Yield the stream's frames with their time stamps, in the order in which they are shown.

        A damaged frame is not yielded; its time stamp goes to `lost`.

        Args:
            seeking: True after a seek: begin at the first key frame where decoding may begin (_Landmarks.is_sound), and
                skip frames with an earlier time stamp, which may refer to frames before that key frame. False: yield
                every frame.
        """
        floor: float | None = None if seeking else -math.inf
        misleading = self.file.container.format.name in MISLEADING
        for packet in self._packets():
            if packet is not None:
                self._landmarks.note(packet, from_start=not seeking)
                if floor is None and packet.is_keyframe and self._landmarks.is_sound(packet, misleading):
                    floor = time_of(packet)
            if floor is None:
                continue
            if packet is not None and packet.pts is not None and packet.pts >= floor:
                heapq.heappush(self._awaited, packet.pts)
            for frame in self._decode(packet):
                time = time_of(frame) or 0  # a raw stream has none; it has no length, so MovieSource refuses it
                if time < floor:
                    continue
                self._note_lost(time)
                if frame.is_corrupt:
                    self.fault = DAMAGED
                    self.lost.append(time)
                else:
                    yield _Timed(time, frame)
        self._note_lost(math.inf)

    def _packets(self) -> Iterator[Packet | None]:
        """Yield the stream's packets, then None. Packets of all streams are read, to know where the file ends."""
        try:
            for packet in self.file.container.demux():
                if packet.size == 0:  # PyAV's mark of the end
                    continue
                if (time := time_of(packet)) is not None:
                    self._end = max(self._end, float((time + (packet.duration or 0)) * packet.time_base))
                if packet.stream_index == self.file.stream.index:
                    yield packet
        except av.error.FFmpegError as error:
            self.fault, self._broken = f"the file is cut off or damaged ({reason(error)})", True
        self._ended = True
        yield None

    def _decode(self, packet: Packet | None) -> list[av.VideoFrame]:
        """Return the frames that the decoder gives for a packet (None: the last ones). An error is kept as `fault`."""
        try:
            return self.file.codec.decode(packet)
        except (av.error.FFmpegError, ValueError) as error:  # ValueError: the decoder could not be opened
            self.fault = f"{DAMAGED} ({reason(error)})"
            return []

    def _note_lost(self, time: float) -> None:
        """Add frames that the decoder failed to give to `lost`, the list of lost time stamps.

        A frame is lost if the decoder was given its data, frames with a later time stamp come out already, and there
        has been an error (`fault`). Without an error, a missing frame is one that is not meant to be shown.

        Args:
            time: The time stamp of the frame that the decoder has just given; infinity at the end. Earlier ones are
                checked.
        """
        while self._awaited and self._awaited[0] <= time:
            awaited = heapq.heappop(self._awaited)
            if awaited < time and self.fault:
                self.lost.append(awaited)


def _known(run: _Run) -> _Timed:
    """Return the frame that a decode has reached (`_Run.shown`), for callers that need one.

    Raises:
        MediaError: There is none (`shown` is None), because no frame could be decoded. The file may have been replaced.
    """
    if run.shown is None:
        raise MediaError(run.fault or "no frame of it can be decoded")
    return run.shown


def time_of(item: Packet | av.VideoFrame) -> int | None:
    """Return the time stamp of a packet or frame; that of decoding if it has no other (AVI). None: it has none."""
    return item.dts if item.pts is None else item.pts


def fraction(rational: AVRational | Fraction | None) -> Fraction:
    """Return a rational number of PyAV as a Fraction; 0 if there is none."""
    return Fraction(rational.numerator, rational.denominator) if rational and rational.denominator else Fraction(0)


def reason(error: Exception) -> str:
    """Return FFmpeg's message of an error, in small letters for use inside a sentence."""
    text = (getattr(error, "strerror", None) or str(error)).strip()
    return text[:1].lower() + text[1:]


def _tags(codec: VideoCodecContext) -> tuple[int, bool]:
    """Return the two color tags of a movie's header that Blender uses for all of its frames.

    Returns:
        The YUV matrix as a number of ITU-T H.273 (5, BT.601, if libswscale does not know the tagged one), and True if
        samples have the full range, False for the limited range of video.
    """
    # libswscale assumes BT.601 for matrices that it does not know.
    space = {1: 1, 4: 4, 7: 7, 9: 9, 10: 9}.get(int(codec.colorspace), 5)
    return space, codec.color_range == ColorRange.JPEG


def _video_stream(container: InputContainer, name: str, number: int) -> VideoStream:
    """Return one of the video streams of an opened file.

    Args:
        container: The opened file.
        name: The file's name, for the error message.
        number: Which stream, from 0. Cover pictures do not count.

    Raises:
        MediaError: There is no such stream, its codec is unknown, or the file is no movie, but a picture or a text.
    """
    pictures = av.stream.Disposition.attached_pic
    streams = [s for s in container.streams.video if not s.disposition & pictures]
    if not streams or container.format.name == "tty":  # FFmpeg opens any text as a movie of a terminal
        raise MediaError(f"{name}: no video stream")
    if container.format.name.endswith("_pipe") or container.format.name in STILLS:
        raise MediaError(f"{name}: {FOREIGN}")
    if number >= len(streams):
        raise MediaError(f"{name}: no video stream {number}, it has {len(streams)}")
    if streams[number].codec_context is None:
        raise MediaError(f"{name}: its video codec is unknown")
    return streams[number]


def _decoder(stream: VideoStream, threads: str) -> VideoCodecContext:
    """Return the decoder of a stream. `threads`: how it may use threads, "AUTO" or "SLICE"."""
    codec = stream.codec_context
    # FFmpeg's decoders of VP8 and VP9 ignore alpha. Blender uses libvpx as well.
    if codec.name in ("vp8", "vp9") and stream.metadata.get("alpha_mode") == "1":
        codec = av.CodecContext.create("libvpx" if codec.name == "vp8" else "libvpx-vp9", "r")
        codec.extradata = stream.codec_context.extradata
    codec.thread_type = threads
    return codec
