"""Frames of one video stream by time stamp, in any order, each the same as in a decode from the start of the file."""

import heapq
import math
from fractions import Fraction

import av
from av.video.frame import PictureType

from .errors import MediaError
from .files import FOREIGN, OTHER, is_other

KEPT_DECODING = 16  # frames ahead that are cheaper to reach by decoding on than by a seek, whatever the file
MISSING = 1.0  # seconds between a file's end and the end that it promises, from which on it counts as cut off
# In MPEG program streams a seek may end inside a picture whose remains take the time stamp of the next one, so that
# all up to the next time stamp are off. There only key frames count that a decode from the start has met before.
MISLEADING = frozenset({"mpeg"})
# FFmpeg takes any picture for a movie of one frame: these, and all formats that end in "_pipe".
STILLS = frozenset({"image2", "alias_pix", "brender_pix", "fits", "ico"})
DAMAGED = "its data are damaged"


class FrameReader:
    """A file's video stream. Time stamps are in units of time_base; `start` is the stream's own.

    Memory: the frame on screen, its successor, and what the decoder holds. Not for two threads at once.
    """

    def __init__(self, path, number=0):
        """number: which of the file's video streams. Raises MediaError if nothing of it can be decoded."""
        self._path, self._number, self._threads = path, number, "AUTO"
        self.container = self.stream = self._codec = self._run = None
        self._landmarks = _Landmarks()
        try:
            self._restart()
        except av.error.FFmpegError as error:
            raise MediaError(f"{path.name}: cannot be read as a movie ({reason(error)})") from error
        finally:
            if self.container is not None and self.shown is None:
                self.close()
        if self.container is None:
            raise MediaError(f"{path.name}: no frame of it can be decoded")

    @property
    def shown(self):
        """The frame on screen at the time asked for last."""
        return self._run.shown if self._run else None

    def frame_at(self, time, step):
        """The last frame whose time stamp is not later, or the first one; step: the usual distance of two frames.

        Raises MediaError, with the reason alone, if the file should have that frame but it cannot be decoded."""
        try:
            return self._find(time, step)
        except MediaError:
            if self._threads == "SLICE":
                raise
        self._threads = "SLICE"  # an error within several frames decoded at once takes sound neighbours along
        self._restart()
        return self._find(time, step)

    def _find(self, time, step):
        if not self._near(time, step):
            self._seek(time, step)
        run = self._run
        while run.next is not None and run.next_time <= time:
            run.advance()
        if run.lost_between(time):
            raise MediaError(run.fault)
        if time >= run.shown_time + max(run.shown.duration, step) and run.cut_off():
            raise MediaError(run.fault or "the file is cut off")
        return run.shown

    def close(self):
        """Closes the file and ends the decoder's threads, until it is next asked for a frame."""
        if self._run is not None:
            self._run.close()
        if self.container is not None:
            self.container.close()
        # PyAV's decoder has no close: its threads end when nothing refers to it.
        self.container = self.stream = self._codec = self._run = None

    def _near(self, time, step):
        run = self._run
        if run is None:
            return False
        if run.shown is None or time < run.shown_time:
            return run.is_first
        return run.next is None or time - run.next_time <= max(KEPT_DECODING, self._landmarks.longest) * step

    def _seek(self, time, step):
        for back in (0, 3, 50, 400):
            if self._run and self._run_from(round(time - back * step)) and self._run.shown_time <= time:
                return
        self._restart()

    def _run_from(self, time):
        """Decodes on from a key frame near that time; false if what comes out there is not clean."""
        try:
            self.container.seek(time, stream=self.stream)
        except av.error.FFmpegError:
            return False
        self._codec.flush_buffers()
        run = self._begin(seeking=True)
        # No I frame: a wrong index or a gradual refresh. What follows would lack references.
        return run.shown is not None and (run.shown.key_frame or run.shown.pict_type == PictureType.I)

    def _restart(self):
        """Decodes on from the start. Not by a seek: with an edit list or without an index that ends elsewhere."""
        self.close()
        if is_other(self._path):  # in the place of the file that was there
            raise MediaError(OTHER)
        self.container = av.open(str(self._path))
        self.stream = _video_stream(self.container, self._path.name, self._number)
        self.time_base, self.start = fraction(self.stream.time_base), self.stream.start_time or 0
        self._codec = _decoder(self.stream, self._threads)
        self._begin(seeking=False)

    def _begin(self, seeking):
        """The one run that there is from now on."""
        if self._run is not None:
            self._run.close()
            self._run = None
        self._run = _Run(self.container, self.stream, self._codec, self._landmarks, seeking)
        return self._run


class _Landmarks:
    """What was seen of the key frames: their packets' time stamps and sizes, the most frames from one to the next."""

    def __init__(self):
        self.seen, self.longest, self._since = set(), 0, 0

    def note(self, packet, from_start):
        """Takes in the next packet."""
        self._since = 0 if packet.is_keyframe else self._since + 1
        self.longest = max(self.longest, self._since)
        if packet.is_keyframe and from_start:
            self.seen.add((time_of(packet), packet.size))

    def knows(self, packet):
        """Whether a decode from the start has met that key frame at that time."""
        return (time_of(packet), packet.size) in self.seen


class _Run:
    """One decode onwards from where the container stands.

    shown, shown_time: the frame on screen and its time stamp; next, next_time: its successor; None past the end
    fault: the last error's sentence; is_first: whether the file's first frame is shown
    """

    def __init__(self, container, stream, codec, landmarks, seeking):
        self._container, self._stream, self._codec, self._landmarks = container, stream, codec, landmarks
        self.fault, self.is_first = "", not seeking
        self._awaited, self._lost, self._end = [], [], -math.inf
        self._ended = self._broken = False
        self._frames = self._decoded(seeking)
        self.shown_time, self.shown = next(self._frames, (None, None))
        self.next_time, self.next = next(self._frames, (None, None))

    def close(self):
        """Ends it. The generator refers to the run and the run to it: together they would wait for the collector."""
        self._frames.close()

    def advance(self):
        """On to the successor."""
        self.shown_time, self.shown, self.is_first = self.next_time, self.next, False
        self.next_time, self.next = next(self._frames, (None, None))

    def lost_between(self, time):
        """Whether a frame that the file has at or before that time, after the one shown, failed to decode."""
        return any(self.shown_time < lost <= time for lost in self._lost)

    def cut_off(self):
        """Whether the file's end is reached, and before the end that it promises."""
        if self._broken or not self._ended or self._container.duration is None:
            return self._broken
        promised = ((self._container.start_time or 0) + self._container.duration) / av.time_base
        return promised - self._end > MISSING

    def _decoded(self, seeking):
        """(time stamp, frame) in order of presentation. seeking: from the first key frame on, without the pictures
        shown before it: in an open group they lean on frames that were not decoded."""
        floor = None if seeking else -math.inf
        misleading = self._container.format.name in MISLEADING
        for packet in self._packets():
            if packet is not None:
                self._landmarks.note(packet, from_start=not seeking)
                if floor is None and packet.is_keyframe and (not misleading or self._landmarks.knows(packet)):
                    floor = time_of(packet)
            if floor is None:
                continue
            self._await(packet, floor)
            for frame in self._decode(packet):
                time = time_of(frame) or 0  # a raw stream has none, nor a length: MovieSource does not accept it
                if time < floor:
                    continue
                self._settle(time)
                if frame.is_corrupt:
                    self.fault = DAMAGED
                    self._lost.append(time)
                else:
                    yield time, frame
        self._settle(math.inf)

    def _packets(self):
        """The stream's packets, then None. Packets of all streams are looked at, to know where the file ends."""
        try:
            for packet in self._container.demux():
                if packet.size == 0:  # PyAV's mark of the end; to the decoder an empty packet says the same
                    continue
                if time_of(packet) is not None:
                    end = (time_of(packet) + (packet.duration or 0)) * packet.time_base
                    self._end = max(self._end, float(end))
                if packet.stream_index == self._stream.index:
                    yield packet
        except av.error.FFmpegError as error:
            self.fault, self._broken = f"the file is cut off or damaged ({reason(error)})", True
        self._ended = True
        yield None

    def _decode(self, packet):
        try:
            return self._codec.decode(packet)
        except (av.error.FFmpegError, ValueError) as error:  # ValueError: of a decoder that could not be opened
            self.fault = f"{DAMAGED} ({reason(error)})"
            return []

    def _await(self, packet, floor):
        if packet is not None and packet.pts is not None and packet.pts >= floor:
            heapq.heappush(self._awaited, packet.pts)

    def _settle(self, time):
        """Notes which frames before that time never came. Without an error they were not meant to be shown."""
        while self._awaited and self._awaited[0] <= time:
            awaited = heapq.heappop(self._awaited)
            if awaited < time and self.fault:
                self._lost.append(awaited)


def time_of(item):
    """The time stamp of a packet or frame; AVI files may have none but those of decoding."""
    return item.dts if item.pts is None else item.pts


def fraction(rational):
    """PyAV's rational as a Fraction; 0 where there is none."""
    return Fraction(rational.numerator, rational.denominator) if rational and rational.denominator else Fraction(0)


def reason(error):
    """What libav says of an error, for use inside a sentence."""
    text = (getattr(error, "strerror", None) or str(error)).strip()
    return text[:1].lower() + text[1:]


def _video_stream(container, name, number):
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


def _decoder(stream, threads):
    codec = stream.codec_context
    # FFmpeg's own decoders of VP8 and VP9 ignore the alpha channel; Blender turns to libvpx as well.
    if codec.name in ("vp8", "vp9") and stream.metadata.get("alpha_mode") == "1":
        codec = av.CodecContext.create("libvpx" if codec.name == "vp8" else "libvpx-vp9", "r")
        codec.extradata = stream.codec_context.extradata
    codec.thread_type = threads
    return codec
