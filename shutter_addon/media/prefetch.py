"""Frames of a source, decoded ahead of time by a thread."""

import threading
from collections.abc import Iterable
from concurrent.futures import Executor, Future, wait

import numpy as np

from ..core import stopping, threads
from ..core.frames.frame_source import FrameSource
from ..core.frames.planes import Planes, as_rgba
from ..core.frames.source_wrapper import SourceWrapper
from .errors import MediaError

_PATIENCE = 0.1  # seconds between two looks at whether a frame is still wanted


class PrefetchSource(SourceWrapper):
    """A source whose wanted frames are decoded ahead, all by one thread. Its frames are read-only.

    The frames of the last `want` are kept until the next one: they are what it holds in memory.
    """

    def __init__(self, source: FrameSource, *, planes: bool = False) -> None:
        """planes: frames lie decoded as the source's `decoded` gives them, which `read` then has to convert"""
        super().__init__(source)
        self._fetch = source.decoded if planes else source.read
        self._wanted: list[int] = []  # in the order of decoding
        self._asked: list[int] = []  # by reads that wait
        self._frames: dict[int, Future[np.ndarray | Planes]] = {}
        self._changing = threading.Lock()
        self._pool: Executor | None = None

    def want(self, indices: Iterable[int]) -> None:
        """Decodes these frames, in this order, and frees all others."""
        with self._changing:
            self._wanted = list(dict.fromkeys(indices))
            self._arrange()

    def read(self, index: int) -> np.ndarray:
        """The source's frame, read-only. One that is not decoded yet is decoded next, before all wanted ones.

        An error of the source's `read` is raised here once; the next call decodes the frame again. MediaError as well
        if `close` is called meanwhile, and core.stopping.StoppedError."""
        picture = as_rgba(self.decoded(index))
        picture.flags.writeable = False
        return picture

    def decoded(self, index: int) -> np.ndarray | Planes:
        """As `read`, but for the conversion."""
        stopping.check()
        with self._changing:
            self._asked.append(index)
            self._arrange()
            frame, pool = self._frames[index], self._pool
        try:
            while not wait([frame], _PATIENCE).done:
                stopping.check()
        finally:
            with self._changing:
                self._asked.remove(index)
                self._drop()
        if self._pool is not pool:
            raise MediaError(f"{self._source.path.name}: closed while a frame was read")
        return frame.result()

    def close(self) -> None:
        """Ends the thread, closes the file and frees all frames; a later read starts again."""
        with self._changing:
            pool, self._pool = self._pool, None
            self._wanted, self._frames = [], {}
        if pool is not None:
            pool.shutdown(cancel_futures=True)
        self._source.close()

    def _arrange(self) -> None:
        """Has frames decoded in order: those that reads wait for before those that are wanted."""
        for index, frame in list(self._frames.items()):
            if index not in self._asked and frame.cancel():
                del self._frames[index]
        self._drop()
        for index in (*self._asked, *self._wanted):
            if index not in self._frames:
                self._pool = self._pool or threads.pool(1)
                self._frames[index] = self._pool.submit(self._frame, index)

    def _drop(self) -> None:
        for index in self._frames.keys() - {*self._wanted, *self._asked}:
            self._frames.pop(index).cancel()

    def _frame(self, index: int) -> np.ndarray | Planes:
        try:
            frame = self._fetch(index)
        except Exception:
            with self._changing:  # whoever reads it later has it decoded again
                self._wanted = [i for i in self._wanted if i != index]
            raise
        if not isinstance(frame, Planes):
            frame.flags.writeable = False
        return frame
