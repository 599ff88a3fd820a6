"""A source that decodes frames ahead of time, on a thread, in the order in which they will be read."""

import threading
from collections.abc import Iterable
from functools import partial

import numpy as np

from ..core import stopping, threads
from ..core.frames.frame_source import Decoded, FrameSource, SourceWrapper, as_rgba
from ..core.messages import MediaError

_PATIENCE = 0.1  # seconds between two looks at whether a frame is still wanted


class PrefetchSource(SourceWrapper):
    """A wrapper around a source that decodes the frames announced by `want` ahead of time, on a thread of its own.

    An announced frame stays in memory until a call of `want` no longer names it, any other only until it is read.
    Arrays of frames are read-only.
    """

    def __init__(self, source: FrameSource, *, planes: bool = False) -> None:
        """Prepare to decode a source's frames ahead of time.

        Args:
            planes: Whether the thread calls the source's `decoded` in place of `read`. Frames may then be Planes or
                Moments (frame_source), which `decoded` returns and `read` converts to RGBA.
        """
        super().__init__(source)
        self._fetch = source.decoded if planes else source.read
        self._wanted: list[int] = []  # in the order of decoding
        self._asked: list[int] = []  # frames that reads wait for
        self._due: int | None = None  # the frame of the last read, which did not wait
        self._done: dict[int, Decoded | Exception] = {}
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None

    def want(self, indices: Iterable[int]) -> None:
        """Announce which frames will be read next: they are decoded in this order. All others are freed."""
        with self._changed:
            self._wanted = list(dict.fromkeys(indices))
            self._due = self._due if self._wanted else None
            self._drop()
            self._wake()

    def read(self, index: int) -> np.ndarray:
        """Return the source's frame (height, width, 4), read-only. Wait for it if it is not decoded yet.

        A frame that is waited for is decoded before those announced by `want`. If the source fails to decode a frame,
        the error is raised here, and a later call tries again.

        Raises:
            MediaError: The source cannot read the frame, or `close` was called while this waited.
            core.stopping.StoppedError: The caller's work was cancelled (stopping.once). Or the frame is not decoded
                yet, and the caller must not wait for it (stopping.waits): it is then decoded for the next call.
        """
        picture = as_rgba(self.decoded(index))
        picture.flags.writeable = False
        return picture

    def decoded(self, index: int) -> Decoded:
        """Return the source's frame as the thread decoded it, which may be planes. Errors as for `read`."""
        stopping.check()
        with self._changed:
            self._due = None if stopping.waits() or index in self._done else index
            if self._due is not None:
                self._wake()
                raise stopping.StoppedError
            self._asked.append(index)
            self._wake()
            try:
                while not self._changed.wait_for(lambda: index in self._done or self._thread is None, _PATIENCE):
                    stopping.check()
            finally:
                self._asked.remove(index)
            frame = self._done.get(index)
            if isinstance(frame, Exception):
                self._done.pop(index)
                self._wanted = [i for i in self._wanted if i != index]
                self._changed.notify_all()  # another read may wait for the same frame
            self._drop()
        if frame is None:
            raise MediaError(f"{self._source.path.name}: closed while a frame was read")
        if isinstance(frame, Exception):
            raise frame
        return frame

    def close(self) -> None:
        """End the thread, close the source and free all frames. A later read starts again."""
        with self._changed:
            thread, self._thread = self._thread, None
            self._wanted, self._due, self._done = [], None, {}
            self._changed.notify_all()
        if thread is not None:
            thread.join()
        self._source.close()

    def _wake(self) -> None:
        """Start the decoding thread if it does not run, and tell it that something has changed."""
        if self._thread is None:
            self._thread = threads.daemon(self._decode)
        self._changed.notify_all()

    def _drop(self) -> None:
        """Free decoded frames that are neither announced nor waited for."""
        self._done = {index: frame for index, frame in self._done.items() if not self._is_unwanted(index)}

    def _is_unwanted(self, index: int) -> bool:
        """Return whether a frame is neither announced nor waited for."""
        return index != self._due and index not in self._asked and index not in self._wanted

    def _next(self) -> int | None:
        """Return the frame to decode next, or None. Those that reads wait for come first."""
        due = () if self._due is None else (self._due,)
        return next((index for index in (*self._asked, *due, *self._wanted) if index not in self._done), None)

    def _decode(self) -> None:
        """Decode frames until the source is closed. This runs on the thread."""
        mine = threading.current_thread()
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._thread is not mine or self._next() is not None)
                if self._thread is not mine or (index := self._next()) is None:
                    return
            frame: Decoded | Exception
            try:
                with stopping.once(partial(self._is_unwanted, index)):
                    frame = self._fetch(index)
                if isinstance(frame, np.ndarray):
                    frame.flags.writeable = False
            except stopping.StoppedError:  # it is no longer wanted
                continue
            except Exception as error:  # raised by the read
                frame = error
            with self._changed:
                if self._thread is mine:
                    self._done[index] = frame
                    self._drop()
                    self._changed.notify_all()
