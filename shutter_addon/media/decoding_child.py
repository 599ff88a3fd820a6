"""A process that decodes movies where PyAV is missing. Whoever has Blender says how it is started (`lend`); it answers
as blender/data/decoding_process.py says, and ends with this one, or some time after its last movie was closed."""

from __future__ import annotations

import itertools
import json
import subprocess
import threading
from contextlib import suppress
from pathlib import Path
from typing import IO, NoReturn

import numpy as np

from .errors import MediaError

READY = "Virtual Shutter decodes"  # a line, before which a Blender prints what it likes
_PIPE = 1 << 20  # bytes, where a pipe's size can be chosen: of 64 KB, a frame takes twice as long
_ENDING = 5  # seconds after which a process that does not end is killed

_command: list[str] | None = None
_process: subprocess.Popen[bytes] | None = None
_numbers = itertools.count()
_asking = threading.Lock()  # one question at a time, from any thread


class _EndedError(Exception):
    """The process ended before it answered."""


def lend(command: list[str] | None) -> None:
    """Says what starts the process, whose last argument will be READY; None: nothing does. One that runs is ended."""
    global _command
    with _asking:
        _end()
        _command = command


def is_lent() -> bool:
    """Whether movies can be decoded so."""
    return _command is not None


class Movie:
    """A movie that can be asked for. The process opens it when it is, for itself and no other one of the same file."""

    def __init__(self, path: Path, deinterlace: bool):
        self._known = {"number": next(_numbers), "path": str(path.absolute()), "deinterlace": deinterlace}

    def about(self) -> dict:
        """What decoding_process.Movie.about has. MediaError: why it cannot be read, without its name."""
        return _ask(self._known | {"wanted": "about"})[0]

    def frame(self, index: int) -> np.ndarray | None:
        """A frame, of new memory. MediaError: why it cannot be decoded."""
        return _ask(self._known | {"wanted": index})[1]

    def close(self) -> None:
        _ask(self._known | {"wanted": "close"})


def _ask(wanted: dict) -> tuple[dict, np.ndarray | None]:
    question = json.dumps(wanted).encode() + b"\n"
    with _asking:
        if wanted["wanted"] == "close" and (_process is None or _process.poll() is not None):
            return {}, None
        for _ in range(2):  # it may have ended for want of work, or with another movie
            try:
                return _answer(question)
            except (_EndedError, OSError, ValueError):
                _end()
    _fail("the Blender that decodes it has ended")


def _answer(question: bytes) -> tuple[dict, np.ndarray | None]:
    process = _process or _started()
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(question)
    process.stdin.flush()
    said = json.loads(_line(process.stdout))
    if "error" in said:
        _fail(said["error"])
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
    """MediaError: it cannot be."""
    global _process
    if _command is None:
        _fail("no Blender decodes it any more")
    try:
        _process = subprocess.Popen(
            [*_command, READY],
            stdin=subprocess.PIPE,  # which ends with this process, and with that the other one
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            pipesize=_PIPE,
            # What stops this process by the keyboard is not for the other one: a frame that is read comes whole.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except OSError as error:
        _fail(f"the Blender that decodes it cannot be started: {error.strerror or error}")
    assert _process.stdout is not None
    while _line(_process.stdout).strip() != READY.encode():
        pass
    return _process


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
        process.wait(_ENDING)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _fail(reason: str) -> NoReturn:
    raise MediaError(reason)
