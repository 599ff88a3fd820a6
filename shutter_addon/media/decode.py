"""Frames of one video stream by time stamp, in any order, each the same as in a decode from the start of the file."""

from __future__ import annotations

import heapq
import math
import struct
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

from .errors import MediaError
from .files import FOREIGN, OTHER, is_other

if TYPE_CHECKING:
    from av.rational import AVRational

KEPT_DECODING = 16  # frames ahead that are cheaper to reach by decoding on than by a seek, whatever the file
MISSING = 1.0  # seconds between a file's end and the end that it promises, from which on it counts as cut off
# In MPEG program streams a seek may end inside a picture whose remains take the time stamp of the next one, so that
# all up to the next time stamp are off. There only key frames count that a decode from the start has met before.
MISLEADING = frozenset({"mpeg"})
# FFmpeg takes any picture for a movie of one frame: these, and all formats that end in "_pipe".
STILLS = frozenset({"image2", "alias_pix", "brender_pix", "fits", "ico"})
DAMAGED = "its data are damaged"


class File(NamedTuple):
    """An open file, its video stream, and what decodes that."""

    container: InputContainer
    stream: VideoStream
    codec: VideoCodecContext


class FrameReader:
    """A file's video stream; tags: of `_tags`. Time stamps are in units of time_base; `start` is the stream's own.

    Memory: the frame on screen, its successor, and what the decoder holds. Not for two threads at once.
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        """number: which of the file's video streams"""
        self._path, self._number, self._threads = path, number, "AUTO"
        self._container: InputContainer | None = None
        self._run: _Run | None = None
        self._landmarks = _Landmarks()

    def first(self) -> tuple[File, av.VideoFrame]:
        """The open file, and its first frame. MediaError: none of it can be decoded."""
        run = self._restart()
        if run.shown is None:
            raise MediaError(f"{self._path.name}: no frame of it can be decoded")
        return run.file, run.shown.frame

    def frame_at(self, time: float, step: float) -> av.VideoFrame:
        """The frame at that time, or the last before the first that is later, or the first one, as in Blender, where
        time stamps go back as well; step: the usual distance of two frames.

        Raises MediaError, with the reason alone, if the file should have that frame but it cannot be decoded."""
        try:
            return self._find(time, step)
        except MediaError:
            if self._threads == "SLICE":
                raise
        self._threads = "SLICE"  # an error within several frames decoded at once takes sound neighbours along
        self._restart()
        return self._find(time, step)

    def _find(self, time: float, step: float) -> av.VideoFrame:
        run = self._run_at(time, step)
        if run.is_first and run.next is not None and time <= _known(run).time == run.next.time:
            # Of key frames that are all at that time, a seek finds the last one, as Blender does.
            run = self._run_from(run.file, run.next.time, run.next.time) or self._restart()
        while run.next is not None and _known(run).time < time and run.next.time <= time:
            run.advance()
        shown = _known(run)
        if run.lost_between(time):
            raise MediaError(run.fault)
        if time >= shown.time + max(shown.frame.duration, step) and run.cut_off():
            raise MediaError(run.fault or "the file is cut off")
        return shown.frame

    def close(self) -> None:
        """Closes the file and ends the decoder's threads, until it is next asked for a frame."""
        if self._run is not None:
            self._run.close()
        if self._container is not None:
            self._container.close()
        # PyAV's decoder has no close: its threads end when nothing refers to it.
        self._container = self._run = None

    def _is_near(self, run: _Run, time: float, step: float) -> bool:
        if run.shown is None or time < run.shown.time:
            return run.is_first
        if time <= run.passed:
            return False
        return run.next is None or time - run.next.time <= max(KEPT_DECODING, self._landmarks.longest) * step

    def _run_at(self, time: float, step: float) -> _Run:
        if (run := self._run) is None:
            return self._restart()
        if self._is_near(run, time, step):
            return run
        tries = (self._run_from(run.file, round(time - back * step), time) for back in (0, 3, 50, 400))
        return next(filter(None, tries), None) or self._restart()

    def _run_from(self, file: File, start: int, time: float) -> _Run | None:
        """Decodes on from a key frame near `start`. None: what comes out there is not clean, or after a time."""
        try:
            file.container.seek(start, stream=file.stream)
        except av.error.FFmpegError:
            return None
        file.codec.flush_buffers()
        run = self._begin(file, seeking=True)
        if (shown := run.shown) is None or shown.time > time:
            return None
        # No I frame: a wrong index or a gradual refresh. What follows would lack references.
        return run if shown.frame.key_frame or shown.frame.pict_type == PictureType.I else None

    def _restart(self) -> _Run:
        """Decodes on from the start. Not by a seek: with an edit list or without an index that ends elsewhere."""
        self.close()
        if is_other(self._path):  # in the place of the file that was there
            raise MediaError(OTHER)
        self._container = av.open(str(self._path))
        stream = _video_stream(self._container, self._path.name, self._number)
        self.time_base, self.start = fraction(stream.time_base), stream.start_time or 0
        self.tags = _tags(stream.codec_context)  # the decoder will write those of frames over them
        return self._begin(File(self._container, stream, _decoder(stream, self._threads)), seeking=False)

    def _begin(self, file: File, seeking: bool) -> _Run:
        """The one run that there is from now on."""
        if self._run is not None:
            self._run.close()
            self._run = None
        self._run = _Run(file, self._landmarks, seeking)
        return self._run


class _Landmarks:
    """What was seen of the key frames: their packets' time stamps and sizes, the most frames from one to the next."""

    def __init__(self) -> None:
        self._seen: dict[tuple[int | None, int], bool] = {}  # whether its time is later than all before it
        self._latest, self._goes_back = -math.inf, False
        self.longest = self._since = 0

    def note(self, packet: Packet, from_start: bool) -> None:
        """Takes in the next packet."""
        self._since = 0 if packet.is_keyframe else self._since + 1
        self.longest = max(self.longest, self._since)
        time = time_of(packet)
        if packet.is_keyframe and from_start:
            sound = self._seen.setdefault((time, packet.size), time is None or time >= self._latest)
            self._goes_back |= not sound
        if packet.pts is not None and from_start:
            self._latest = max(self._latest, packet.pts)

    def is_sound(self, packet: Packet, misleading: bool) -> bool:
        """Whether decoding may begin at that key frame: what a decode from the start has met before it is earlier.
        misleading: whether it has to have been met, as where time stamps go back."""
        return self._seen.get((time_of(packet), packet.size), not (misleading or self._goes_back))


class _Timed(NamedTuple):
    """A frame and its time stamp."""

    time: int
    frame: av.VideoFrame


class _Run:
    """One decode onwards from where the container stands.

    shown: the frame on screen; next: its successor; None past the end
    fault: the last error's sentence; is_first: whether the file's first frame is shown
    passed: the latest time of a frame before it
    """

    def __init__(self, file: File, landmarks: _Landmarks, seeking: bool) -> None:
        self.file, self._landmarks = file, landmarks
        self.fault, self.is_first = "", not seeking
        self._awaited: list[int] = []
        self._lost: list[int] = []
        self._end = self.passed = -math.inf
        self._ended = self._broken = False
        self._frames = self._decoded(seeking)
        self.shown = next(self._frames, None)
        self.next = next(self._frames, None)

    def close(self) -> None:
        """Ends it. The generator refers to the run and the run to it: together they would wait for the collector."""
        self._frames.close()

    def advance(self) -> None:
        """On to the successor."""
        self.passed = max(self.passed, _known(self).time)
        self.shown, self.is_first = self.next, False
        self.next = next(self._frames, None)

    def lost_between(self, time: float) -> bool:
        """Whether a frame that the file has at or before that time, after the one shown, failed to decode."""
        return self.shown is not None and any(self.shown.time < lost <= time for lost in self._lost)

    def cut_off(self) -> bool:
        """Whether the file's end is reached, and before the end that it promises."""
        container = self.file.container
        if self._broken or not self._ended or container.duration is None:
            return self._broken
        promised = ((container.start_time or 0) + container.duration) / av.time_base
        return promised - self._end > MISSING

    def _decoded(self, seeking: bool) -> Generator[_Timed, None, None]:
        """Frames in order of presentation. seeking: from the first key frame on, without the pictures shown before it:
        in an open group they lean on frames that were not decoded."""
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
                time = time_of(frame) or 0  # a raw stream has none, nor a length: MovieSource does not accept it
                if time < floor:
                    continue
                self._settle(time)
                if frame.is_corrupt:
                    self.fault = DAMAGED
                    self._lost.append(time)
                else:
                    yield _Timed(time, frame)
        self._settle(math.inf)

    def _packets(self) -> Iterator[Packet | None]:
        """The stream's packets, then None. Packets of all streams are looked at, to know where the file ends."""
        try:
            for packet in self.file.container.demux():
                if packet.size == 0:  # PyAV's mark of the end; to the decoder an empty packet says the same
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
        try:
            return self.file.codec.decode(packet)
        except (av.error.FFmpegError, ValueError) as error:  # ValueError: of a decoder that could not be opened
            self.fault = f"{DAMAGED} ({reason(error)})"
            return []

    def _settle(self, time: float) -> None:
        """Notes which frames before that time never came. Without an error they were not meant to be shown."""
        while self._awaited and self._awaited[0] <= time:
            awaited = heapq.heappop(self._awaited)
            if awaited < time and self.fault:
                self._lost.append(awaited)


def _known(run: _Run) -> _Timed:
    """What a run shows. MediaError: what was put in the place of a file has no frame."""
    if run.shown is None:
        raise MediaError(run.fault or "no frame of it can be decoded")
    return run.shown


def time_of(item: Packet | av.VideoFrame) -> int | None:
    """The time stamp of a packet or frame; AVI files may have none but those of decoding."""
    return item.dts if item.pts is None else item.pts


def fraction(rational: AVRational | Fraction | None) -> Fraction:
    """PyAV's rational as a Fraction; 0 where there is none."""
    return Fraction(rational.numerator, rational.denominator) if rational and rational.denominator else Fraction(0)


def reason(error: Exception) -> str:
    """What libav says of an error, for use inside a sentence."""
    text = (getattr(error, "strerror", None) or str(error)).strip()
    return text[:1].lower() + text[1:]


def _tags(codec: VideoCodecContext) -> tuple[int, bool, int]:
    """What Blender takes from a file before it decodes a frame, and keeps for all of them: the matrix of YUV, by its
    number in ITU-T H.273; whether samples are of full range; and the quarter turns counter-clockwise by which pictures
    are stored."""
    # libswscale takes what it does not know for BT.601.
    space = {1: 1, 4: 4, 7: 7, 9: 9, 10: 9}.get(int(codec.colorspace), 5)
    side_data = getattr(codec, "coded_side_data", {})  # PyAV before 19 has none, and pictures lie as they are stored
    return space, codec.color_range == ColorRange.JPEG, _turns(side_data.get("display_matrix"))


def _turns(display_matrix: bytes | None) -> int:
    """FFmpeg's av_display_rotation_get, in quarter turns; 0 where the matrix is empty or lacking."""
    if display_matrix is None or len(display_matrix) != 36:
        return 0
    a, b, _, c, d, *_ = struct.unpack("=9i", display_matrix)
    across, down = math.hypot(a, c), math.hypot(b, d)
    return round(math.atan2(b / down, a / across) / (math.pi / 2)) % 4 if across and down else 0


def _video_stream(container: InputContainer, name: str, number: int) -> VideoStream:
    pictures = av.stream.Disposition.attached_pic
    streams = [s for s in container.streams.video if not s.disposition & pictures]
    if not streams or container.format.name == "tty":  # FFmpeg takes any text for a movie of a terminal
        raise MediaError(f"{name}: no video stream")
    if container.format.name.endswith("_pipe") or container.format.name in STILLS:
        raise MediaError(f"{name}: {FOREIGN}")
    if number >= len(streams):
        raise MediaError(f"{name}: no video stream {number}, it has {len(streams)}")
    if streams[number].codec_context is None:
        raise MediaError(f"{name}: its video codec is unknown")
    return streams[number]


def _decoder(stream: VideoStream, threads: str) -> VideoCodecContext:
    codec = stream.codec_context
    # FFmpeg's own decoders of VP8 and VP9 ignore the alpha channel; Blender turns to libvpx as well.
    if codec.name in ("vp8", "vp9") and stream.metadata.get("alpha_mode") == "1":
        codec = av.CodecContext.create("libvpx" if codec.name == "vp8" else "libvpx-vp9", "r")
        codec.extradata = stream.codec_context.extradata
    codec.thread_type = threads
    return codec
