"""A process that decodes movies where PyAV is missing. Whoever has Blender says how it is started (`lend`); it answers
as blender/data/decoding_process.py says, and ends with this one, or some time after its last movie was closed."""

from __future__ import annotations

import itertools
import json
import subprocess
import threading
from contextlib import suppress
from pathlib import Path
from typing import IO

import numpy as np

from ..core import threads
from .errors import MediaError

READY = "Virtual Shutter decodes"  # a line, before which a Blender prints what it likes
STARTING = 60  # seconds after which a process that is not ready is killed
ANSWERING = 120  # seconds after which one that does not answer is: no frame takes as long
ENDING = 5  # seconds after which one that does not end is
_PIPE = 1 << 20  # bytes, where a pipe's size can be chosen: of 64 KB, a frame takes twice as long

_command: list[str] | None = None
_process: subprocess.Popen[bytes] | None = None
_numbers = itertools.count()
_asking = threading.Lock()  # one question at a time, from any thread


class _EndedError(Exception):
    """The process ended before it answered."""


def lend(command: list[str] | None) -> None:
    """Says what starts the process, whose last argument will be READY; None: nothing does. One that runs is ended,
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


class Movie:
    """A movie that can be asked for. The process opens it when it is, for itself and no other one of the same file."""

    def __init__(self, path: Path, deinterlace: bool) -> None:
        self._known = {"number": next(_numbers), "path": str(path.absolute()), "deinterlace": deinterlace}

    def about(self) -> dict:
        """What decoding_process.Movie.about has. MediaError: why it cannot be read, without its name."""
        return _ask(self._known | {"wanted": "about"})[0]

    def frame(self, index: int) -> np.ndarray | None:
        """A frame, of new memory. MediaError: why it cannot be decoded."""
        return _ask(self._known | {"wanted": index})[1]

    def close(self) -> None:
        """Where no process runs, it is open nowhere."""
        with _asking, suppress(MediaError):
            if _process is not None:
                _answer(self._known | {"wanted": "close"})


def _ask(wanted: dict) -> tuple[dict, np.ndarray | None]:
    with _asking:
        for _ in range(2):  # it may have ended for want of work, or with another movie
            if (answer := _answer(wanted)) is not None:
                return answer
    raise MediaError("the Blender that decodes it has ended")


def _answer(wanted: dict) -> tuple[dict, np.ndarray | None] | None:
    """None: the process has ended, or was killed as it did not answer."""
    try:
        question = json.dumps(wanted).encode() + b"\n"
        return threads.start(_asked, _process or _started(), question).result(ANSWERING)
    except TimeoutError:  # it was stopped, say
        _kill()
        return None
    except (_EndedError, OSError, ValueError):
        _end()
        return None
    except MediaError:
        raise
    except BaseException:  # an interrupt, say: what is still to come would be taken for the next answer
        _kill()
        raise


def _asked(process: subprocess.Popen[bytes], question: bytes) -> tuple[dict, np.ndarray | None]:
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
        raise _EndedError
    return said, frame


def _line(stream: IO[bytes]) -> bytes:
    line = stream.readline()
    if not line.endswith(b"\n"):
        raise _EndedError
    return line


def _started() -> subprocess.Popen[bytes]:
    """MediaError: it cannot be. _EndedError: it ended before it was ready."""
    global _process
    if _command is None:
        raise MediaError("no Blender decodes it any more")
    try:
        _process = subprocess.Popen(
            [*_command, READY],
            stdin=subprocess.PIPE,  # which ends with this process, and with that the other one
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # What stops this process by the keyboard is not for the other one: a frame that is read comes whole.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except OSError as error:
        raise MediaError(f"the Blender that decodes it cannot be started: {error.strerror or error}") from None
    assert _process.stdout is not None
    _enlarge(_process.stdout)
    try:  # by a thread, as Windows waits for no pipe for some time only
        threads.start(_wait, _process.stdout).result(STARTING)
    except TimeoutError:
        _kill()
        raise MediaError(f"the Blender that decodes it is not ready after {STARTING} seconds") from None
    return _process


def _enlarge(pipe: IO[bytes]) -> None:
    """Not every system can, and Linux refuses it to a user who has many large pipes."""
    with suppress(ImportError, AttributeError, OSError):
        import fcntl

        fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _PIPE)


def _wait(stream: IO[bytes]) -> None:
    while _line(stream).strip() != READY.encode():
        pass


def _kill() -> None:
    if _process is not None:
        _process.kill()
    _end()


def _end() -> None:
    global _process
    process, _process = _process, None
    if process is None:
        return
    for stream in (process.stdin, process.stdout):
        with suppress(OSError):  # what was still to be written cannot be
            assert stream is not None
            stream.close()
    try:
        process.wait(ENDING)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
