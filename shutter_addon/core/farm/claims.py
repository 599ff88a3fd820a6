"""Claims divide work, such as frames, among processes on machines that share a folder.

A claim is a file that only one process can create. Its holder touches it while it works. A process that sees no change
for a while, by its own clock, takes it over with a claim of the next generation, which again only one can create. No
clocks are compared and no locks are used, so this works on network drives. If the holder was only paused, both do the
same work. Nothing is lost, since results are written whole and are equal.
"""

import os
import secrets
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Self

from .. import threads

PATIENCE = 120.0  # seconds without a change after which a claim is abandoned
BEAT = 10.0  # seconds between touches; network drives can show them a minute late


class Claims:
    """The claims of this process: files in a shared folder, each of which reserves one piece of work, such as a frame.

    The end of a `with` block releases all of them. Any thread may use the object.

    Args:
        folder: The folder, which all machines share.
        patience: Seconds without a change after which another process's claim is abandoned. None: PATIENCE.
        beat: Seconds after which this process touches its claims again. None: BEAT.
    """

    def __init__(self, folder: Path, patience: float | None = None, beat: float | None = None) -> None:
        self._folder = folder
        self._patience = PATIENCE if patience is None else patience
        self._beat = BEAT if beat is None else beat
        self._held: dict[str, int] = {}  # generation of each claim
        self._seen: dict[Path, tuple] = {}  # state of others' claims, and since when
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._thread = threads.daemon(self._touch)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        for name in list(self._held):
            self.release(name)

    def take(self, name: str) -> bool:
        """Try to reserve a piece of work, and return whether this process has got it.

        It fails while the claim is held, also by this process. An abandoned claim is taken over, but only by a later
        call: this object must first have seen it unchanged for longer than `patience`.

        If this returns True, check whether the work has been done already: the last holder may have finished it.

        Args:
            name: A name for the piece of work, the same on all machines: letters, digits and underscores.

        Raises:
            OSError: The folder cannot be written to.
        """
        generation = 0
        while not _make(path := self._path(name, generation)):
            if not self._is_abandoned(path):
                return False
            generation += 1
        with self._lock:
            self._held[name] = generation
        return True

    def release(self, name: str) -> None:
        """Release a claim of this process: remove its file, and those of abandoned claims to the same work."""
        with self._lock:
            generation = self._held.pop(name)
        for each in range(generation, -1, -1):
            _remove(self._path(name, each))

    def _path(self, name: str, generation: int) -> Path:
        """Return the path of a claim's file. The generation counts how often the claim was taken over, from 0."""
        return self._folder / f".claim-{name}-{generation}"

    def _is_abandoned(self, path: Path) -> bool:
        """Return whether this process has seen no change in another's claim for more than `patience` seconds."""
        now, look = time.monotonic(), _look(path)
        if self._seen.get(path, (None,))[0] != look:
            self._seen[path] = look, now
        return look is not None and now - self._seen[path][1] > self._patience

    def _touch(self) -> None:
        """Touch the files of claims held here every `beat` seconds, until the `with` block ends, on its own thread."""
        while not self._ended.wait(self._beat):
            with self._lock:
                held = list(self._held.items())
            for name, generation in held:
                with suppress(OSError):  # taken over, or the drive is offline
                    os.utime(self._path(name, generation))


def _make(path: Path) -> bool:
    """Create the file of a claim, and return whether it was created: False if it exists already.

    Its content is a random number, which makes it differ from a later claim of the same name, and for people the
    machine and the process.

    Raises:
        OSError: The file cannot be written.
    """
    try:
        file = path.open("x", encoding="utf-8")
    except FileExistsError:
        return False
    try:
        with file:
            file.write(f"{secrets.token_hex(8)} {socket.gethostname()} {os.getpid()}\n")
    except OSError:
        _remove(path)
        raise
    return True


def _look(path: Path) -> tuple[bytes, int] | int | None:
    """Return the state of a claim's file, which differs once the file has been touched or replaced.

    The file is opened for this, since network drives may otherwise tell an old time.

    Returns:
        (content, time of change in ns). If the file cannot be read, the error number instead. None: the file is
        missing.
    """
    try:
        with path.open("rb") as file:
            return file.read(), os.fstat(file.fileno()).st_mtime_ns
    except FileNotFoundError:
        return None
    except OSError as error:  # a folder, or another user's: like a claim that nobody touches
        return error.errno


def _remove(path: Path) -> None:
    """Remove the file of a claim, and ignore errors, such as a missing file."""
    with suppress(OSError):  # removed by another process, or another user's
        path.unlink()
