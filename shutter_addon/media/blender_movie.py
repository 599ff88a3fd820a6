"""Movies where PyAV is missing: a second Blender, a process that this one starts, decodes their frames.

`lend` sets the command that starts the process. blender/data/decoding_process.py is the script that it runs; questions
and answers go through pipes. It ends with this process.
"""

import itertools
import json
import math
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import IO

import numpy as np

from ..core import threads
from ..core.frames.frame_source import FrameSource
from ..core.messages import MediaError
from .files import check_file, check_index, check_name, check_size

ANSWER = "Virtual Shutter decodes"  # the beginning of an answer's line, since Blender prints other lines as well
ANSWERING = 120  # seconds after which a process is killed if it does not answer; no frame takes as long
ENDING = 5  # seconds after which it is killed if it does not end
_FLOAT_ERROR = 2**-23  # the relative error of Blender's floats
_PIPE = 1 << 20  # the pipe's bytes, if they can be set; with 64 KB a frame takes twice as long


@dataclass
class _Decoder:
    """The process that decodes movies; all of them share one.

    Attributes:
        command: The command that starts it. None: movies cannot be decoded this way.
        process: The running process, or None.
        asking: Lock that a thread holds from a question to its answer.
        numbers: Gives each BlenderMovie the number by which the process knows it; paths can occur several times.
    """

    command: list[str] | None = None
    process: subprocess.Popen[bytes] | None = None
    asking: threading.Lock = field(default_factory=threading.Lock)
    numbers: Iterator[int] = field(default_factory=itertools.count)


class BlenderMovie(FrameSource):
    """A movie whose frames a second Blender decodes.

    8-bit frames equal those of movie.MovieSource to the bit. Deeper ones are Blender's floats, rounded to uint16.
    Blender may show another frame in place of a damaged one.
    """

    decoder = _Decoder()  # all movies share a process: starting one takes seconds
    file_kind, transfer, by_blender = "a movie, read by a second Blender", "srgb", True

    def __init__(self, path: str | Path, *, deinterlace: bool = False) -> None:
        self.path = check_file(path)
        self.files = [self.path]
        check_name(self.path.absolute())
        self.options = {"stream": 0, "deinterlace": bool(deinterlace)}
        number = next(BlenderMovie.decoder.numbers)
        self._known = {"number": number, "path": str(self.path.absolute()), "deinterlace": bool(deinterlace)}
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
        # Blender takes 8-bit colors for straight, but those of deeper movies, its floats, for premultiplied.
        self.alpha = "opaque" if not about["alpha"] else "premultiplied" if about["deep"] else "straight"

    def read(self, index: int) -> np.ndarray:
        check_index(self, index)
        try:
            _, frame = ask(self._known | {"wanted": index})
        except MediaError as error:
            raise MediaError(f"frame {index} of {self.path.name} cannot be decoded: {error}") from None
        if frame is None or frame.shape != (self.height, self.width, 4) or frame.dtype != self.dtype:
            raise MediaError(f"frame {index} of {self.path.name} cannot be decoded: the file is another one now")
        return frame

    def close(self) -> None:
        with BlenderMovie.decoder.asking, suppress(MediaError):
            if BlenderMovie.decoder.process is not None:
                _answer(self._known | {"wanted": "close"})


def frame_rate(number: float) -> Fraction:
    """Return the exact frame rate, in frames per second, that Blender has rounded to a float.

    It is a whole number, a whole number · 1000/1001, or else a near fraction with a denominator of at most 1000.
    """
    for rate in (Fraction(round(number)), Fraction(round(number * 1.001) * 1000, 1001)):
        if rate and abs(float(rate) / number - 1) <= _FLOAT_ERROR:
            return rate
    return Fraction(number).limit_denominator(1000) or Fraction(1, 1000)


def lend(command: list[str] | None) -> None:
    """Set the command that starts the second Blender, which decodes movies, and end the one that runs.

    Args:
        command: The command, which gets ANSWER as its last argument. None: movies cannot be decoded this way.
    """
    BlenderMovie.decoder.command = command
    if (process := BlenderMovie.decoder.process) is not None:
        with _killed_after(ENDING, process), BlenderMovie.decoder.asking:  # held by a thread that waits for an answer
            _end()


def ask(wanted: dict) -> tuple[dict, np.ndarray | None]:
    """Send a question to the second Blender, which decodes movies, and return its answer.

    Args:
        wanted: A question, as decoding_process.py describes them.

    Returns:
        The answer's properties, and a frame (H, W, 4) if one was asked for.

    Raises:
        MediaError: The process cannot be started, ends without an answer, or answers with an error.
    """
    with BlenderMovie.decoder.asking:
        for _ in range(2):  # another movie may have ended it
            if (answer := _answer(wanted)) is not None:
                return answer
    raise MediaError("the Blender that decodes it has ended")


def _answer(wanted: dict) -> tuple[dict, np.ndarray | None] | None:
    """Ask the second Blender as `ask` does, and start it if it does not run.

    Returns:
        What `ask` returns; None if the process has ended, or was killed because it did not answer.
    """
    process = BlenderMovie.decoder.process or _started()
    try:
        with _killed_after(ANSWERING, process):
            return _asked(process, json.dumps(wanted).encode() + b"\n")
    except MediaError:
        raise
    except BaseException as error:  # such as an interrupt: its late answer would be taken for the next one
        _end()
        if isinstance(error, (EOFError, OSError, ValueError)):
            return None
        raise


@contextmanager
def _killed_after(seconds: float, process: subprocess.Popen[bytes]) -> Iterator[None]:
    """Kill the process if a `with` block takes longer than `seconds`. Reading from a pipe has no timeout."""
    ended = threading.Event()

    def watch() -> None:
        if not ended.wait(seconds):
            process.kill()

    threads.daemon(watch)
    try:
        yield
    finally:
        ended.set()


def _asked(process: subprocess.Popen[bytes], question: bytes) -> tuple[dict, np.ndarray | None]:
    """Send a question to the process, and return its answer as `ask` does.

    Raises:
        MediaError: The answer is an error.
        EOFError: The process ended before it answered.
    """
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
    """Return the next line of the process that is an answer, without the mark ANSWER. Skip what Blender itself prints.

    Raises:
        EOFError: The process has ended.
    """
    while line := stream.readline():
        if line.startswith(ANSWER.encode()):
            return line.removeprefix(ANSWER.encode())
    raise EOFError


def _started() -> subprocess.Popen[bytes]:
    """Start the second Blender, which decodes movies, and return its process.

    Raises:
        MediaError: It cannot be started.
    """
    if BlenderMovie.decoder.command is None:
        raise MediaError("no Blender decodes it any more")
    try:
        BlenderMovie.decoder.process = subprocess.Popen(
            [*BlenderMovie.decoder.command, ANSWER],
            stdin=subprocess.PIPE,  # ends with this process, which ends the other one
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # Ctrl+C must not stop the other process, or a frame would be cut off.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except OSError as error:
        raise MediaError(f"the Blender that decodes it cannot be started: {error.strerror or error}") from None
    with suppress(ImportError, AttributeError, OSError):
        # Some systems cannot do this, and Linux refuses it to users with many large pipes.
        import fcntl

        fcntl.fcntl(BlenderMovie.decoder.process.stdout, fcntl.F_SETPIPE_SZ, _PIPE)  # type: ignore[arg-type]
    return BlenderMovie.decoder.process


def _end() -> None:
    """End the second Blender and wait until it is gone; kill it if that takes more than ENDING seconds."""
    process, BlenderMovie.decoder.process = BlenderMovie.decoder.process, None
    if process is not None:
        with _killed_after(ENDING, process), suppress(OSError), process:  # closes its pipes and waits for its end
            pass
