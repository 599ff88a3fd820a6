"""Frames of a movie where PyAV is missing: decoded by a second Blender, those of movie.MovieSource. Whoever has Blender
says how it is started (`lend`); it answers as blender/data/decoding_process.py says, and ends with this one."""

import itertools
import json
import math
import subprocess
import threading
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import IO

import numpy as np

from ..core import threads
from ..core.frames.frame_source import FrameSource
from .errors import MediaError
from .files import OTHER, check_file, check_index, check_name, check_size, is_other

ANSWER = "Virtual Shutter decodes"  # what an answer's line begins with: a Blender prints what it likes before
STARTING = 60  # seconds after which a process that has not begun to answer is killed
ANSWERING = 120  # seconds after which one that does not answer any more is: no frame takes as long
ENDING = 5  # seconds after which one that does not end is
_PIPE = 1 << 20  # bytes, where a pipe's size can be chosen: of 64 KB, a frame takes twice as long

_command: list[str] | None = None  # what starts the process, which all movies share
_process: subprocess.Popen[bytes] | None = None  # that runs
_asking = threading.Lock()  # one question at a time, from any thread
_numbers = itertools.count()  # a movie's for the process, which may have the same file open several times
_FLOAT_ERROR = 2**-23  # relative, of a number that Blender has as a float


class BlenderMovie(FrameSource):
    """A movie's frames, as movie.MovieSource has them; but for damaged ones, in whose place Blender may show others.

    8 bits are equal to the bit; deeper ones are as Blender's floats are."""

    file_kind, transfer, by_blender = "a movie, read by a second Blender", "srgb", True

    def __init__(self, path: str | Path, *, deinterlace: bool = False) -> None:
        self.path = check_file(path)
        self.files = [self.path]
        check_name(self.path.absolute())
        self.options = {"stream": 0, "deinterlace": bool(deinterlace)}
        self._known = {"number": next(_numbers), "path": str(self.path.absolute()), "deinterlace": bool(deinterlace)}
        try:
            about, _ = ask(self._known | {"wanted": "about"})
        except MediaError as error:
            raise MediaError(f"{self.path.name}: cannot be read as a movie ({error})") from None
        self.width, self.height = about["size"]
        check_size(self.path.name, self.width, self.height)
        self.count, self.has_audio = about["count"], about["audio"]
        if self.count < 1 or not math.isfinite(about["fps"]) or about["fps"] <= 0:
            self.close()
            raise MediaError(f"{self.path.name}: its length is unknown; put it into an MP4 or MKV file first")
        self.fps = frame_rate(about["fps"])
        self.dtype = np.dtype(np.uint16 if about["deep"] else np.uint8)
        # Blender takes 8-bit colours for straight, but those of deeper movies, its floats, for premultiplied.
        self.alpha = "opaque" if not about["alpha"] else "premultiplied" if about["deep"] else "straight"

    def read(self, index: int) -> np.ndarray:
        check_index(self, index)
        try:
            if is_other(self.path):  # in the place of the file that was there
                raise MediaError(OTHER)
            _, frame = ask(self._known | {"wanted": index})
        except MediaError as error:
            raise MediaError(f"frame {index} of {self.path.name} cannot be decoded: {error}") from None
        if frame is None or frame.shape != (self.height, self.width, 4) or frame.dtype != self.dtype:
            raise MediaError(f"frame {index} of {self.path.name} cannot be decoded: the file is another one now")
        return frame

    def close(self) -> None:
        tell(self._known | {"wanted": "close"})


def frame_rate(number: float) -> Fraction:
    """The frame rate that Blender has as a float: a whole number, a thousand of 1001ths of one, or the fraction that is
    nearest."""
    for rate in (Fraction(round(number)), Fraction(round(number * 1.001) * 1000, 1001)):
        if rate and abs(float(rate) / number - 1) <= _FLOAT_ERROR:
            return rate
    return Fraction(number).limit_denominator(1000) or Fraction(1, 1000)


def lend(command: list[str] | None) -> None:
    """Says what starts the process, whose last argument will be ANSWER; None: nothing does. One that runs is ended,
    without the answer that somebody may be waiting for, if that takes long."""
    global _command
    _command = command
    if _asking.acquire(timeout=ENDING):
        try:
            _end()
        finally:
            _asking.release()
    elif (process := _process) is not None:
        process.kill()  # whoever waits is told so by its pipe, and ends it


def is_lent() -> bool:
    """Whether movies can be decoded so."""
    return _command is not None


def ask(wanted: dict) -> tuple[dict, np.ndarray | None]:
    """What the process answers, with a frame of new memory, if it gives one. MediaError: why it cannot."""
    with _asking:
        for _ in range(2):  # it may have ended with another movie
            if (answer := _answer(wanted)) is not None:
                return answer
    raise MediaError("the Blender that decodes it has ended")


def tell(wanted: dict) -> None:
    """Tells the process something, if one runs."""
    with _asking, suppress(MediaError):
        if _process is not None:
            _answer(wanted)


def _answer(wanted: dict) -> tuple[dict, np.ndarray | None] | None:
    """None: the process has ended, or was ended as it did not answer."""
    is_new = _process is None
    try:
        asked = threads.start(_asked, _process or _started(), json.dumps(wanted).encode() + b"\n")
        return asked.result(STARTING if is_new else ANSWERING)
    except MediaError:
        raise
    except BaseException as error:  # an interrupt, say: what is still to come would be taken for the next answer
        _end()
        if is_new and isinstance(error, TimeoutError):  # it was stopped, say
            raise MediaError(f"the Blender that decodes it is not ready after {STARTING} seconds") from None
        if isinstance(error, (EOFError, OSError, ValueError)):
            return None
        raise


def _asked(process: subprocess.Popen[bytes], question: bytes) -> tuple[dict, np.ndarray | None]:
    """By a thread, as Windows waits for no pipe for some time only. EOFError: the process ended before it answered."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(question)
    process.stdin.flush()
    said = json.loads(_line(process.stdout))
    if "error" in said:
        raise MediaError(said["error"])
    if not said["bytes"]:
        return said, None
    frame = np.empty(said["shape"], said["dtype"])
    if process.stdout.readinto(memoryview(frame).cast("B")) != frame.nbytes:  # type: ignore[attr-defined]
        raise EOFError
    return said, frame


def _line(stream: IO[bytes]) -> bytes:
    """The next answer's line, without its beginning."""
    while line := stream.readline():
        if line.startswith(ANSWER.encode()):
            return line.removeprefix(ANSWER.encode())
    raise EOFError


def _started() -> subprocess.Popen[bytes]:
    """MediaError: it cannot be."""
    global _process
    if _command is None:
        raise MediaError("no Blender decodes it any more")
    try:
        _process = subprocess.Popen(
            [*_command, ANSWER],
            stdin=subprocess.PIPE,  # which ends with this process, and with that the other one
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # What stops this process by the keyboard is not for the other one: a frame that is read comes whole.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except OSError as error:
        raise MediaError(f"the Blender that decodes it cannot be started: {error.strerror or error}") from None
    with suppress(ImportError, AttributeError, OSError):
        # Not every system can, and Linux refuses it to a user who has many large pipes.
        import fcntl

        fcntl.fcntl(_process.stdout, fcntl.F_SETPIPE_SZ, _PIPE)  # type: ignore[arg-type]
    return _process


def _end() -> None:
    global _process
    process, _process = _process, None
    if process is None:
        return
    assert process.stdin is not None
    assert process.stdout is not None
    with suppress(OSError):  # what was still to be written cannot be
        process.stdin.close()
    try:
        process.wait(ENDING)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    process.stdout.close()
