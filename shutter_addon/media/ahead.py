"""Frames of a source before they are asked for, decoded by a thread of their own; smaller ones for previews."""

import threading

import numpy as np

from .errors import MediaError

_SUMS = {np.uint8: np.uint16, np.uint16: np.uint32}


class Ahead:
    """A source's frames, decoded ahead: a source itself, whose decoder belongs to one thread.

    What is wanted is kept until other frames are wanted: the last `want` bounds the memory. Its frames are read-only.
    """

    def __init__(self, source, shrink: int = 1):
        """shrink: 1 … 16; above 1 a frame's pixels are the means of so many × so many of the source's pixels."""
        self._source, self._shrink = source, shrink
        self.width, self.height = -(-source.width // shrink), -(-source.height // shrink)
        self._wanted: list[int] = []  # in the order of decoding
        self._asked: list[int] = []  # by reads that wait
        self._done: dict[int, np.ndarray | Exception] = {}
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None

    def __getattr__(self, name):
        return getattr(self._source, name)

    def want(self, indices) -> None:
        """Decodes these frames, in this order, and drops all others."""
        with self._changed:
            self._wanted = list(dict.fromkeys(indices))
            self._drop()
            self._wake()

    def ready(self, indices) -> bool:
        """Whether `read` would wait for none of these frames."""
        with self._changed:
            return self._done.keys() >= set(indices)

    def read(self, index: int) -> np.ndarray:
        """The frame as the source gives it, but read-only; waits for it, ahead of all that is wanted.

        Raises what the source raises, and MediaError if it is closed meanwhile."""
        with self._changed:
            self._asked.append(index)
            self._wake()
            self._changed.wait_for(lambda: index in self._done or self._thread is None)
            self._asked.remove(index)
            frame = self._done.get(index)
            self._drop()
        if frame is None:
            raise MediaError(f"{self._source.path.name}: closed while a frame was read")
        if isinstance(frame, Exception):
            raise frame
        return frame

    def close(self) -> None:
        """Ends the thread and lets go of the file and of all frames; a later read starts anew."""
        with self._changed:
            thread, self._thread = self._thread, None
            self._wanted, self._done = [], {}
            self._changed.notify_all()
        if thread is not None:
            thread.join()
        self._source.close()

    def _wake(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._decode, name="Virtual Shutter", daemon=True)
            self._thread.start()
        self._changed.notify_all()

    def _drop(self) -> None:
        kept = {*self._wanted, *self._asked}
        self._done = {index: frame for index, frame in self._done.items() if index in kept}

    def _next(self) -> int | None:
        return next((index for index in (*self._asked, *self._wanted) if index not in self._done), None)

    def _decode(self) -> None:
        mine = threading.current_thread()
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._thread is not mine or self._next() is not None)
                if self._thread is not mine:
                    return
                index = self._next()
            frame = self._frame(index)
            with self._changed:
                if self._thread is mine:
                    self._done[index] = frame
                    self._drop()
                    self._changed.notify_all()

    def _frame(self, index: int) -> np.ndarray | Exception:
        try:
            frame = self._source.read(index)
            if self._shrink > 1:
                frame = shrunk(frame, self._shrink, self._source.alpha == "straight")
            frame.flags.writeable = False
            return frame
        except Exception as error:  # whoever reads the frame learns of it
            return error

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def shrunk(frame: np.ndarray, factor: int, straight: bool) -> np.ndarray:
    """Means of each factor × factor pixels (H, W, 4), of fewer at the right and lower edges, in the frame's type.

    straight: colours count by their alpha, which they are not multiplied with."""
    if not straight:
        return _means(frame, factor)
    values = frame.astype(np.float32)
    values[..., :3] *= values[..., 3:]
    values = _means(values, factor)
    values[..., :3] /= np.where(values[..., 3:] > 0, values[..., 3:], 1)
    return (np.rint(values) if frame.dtype.kind == "u" else values).astype(frame.dtype)


def _means(values: np.ndarray, factor: int) -> np.ndarray:
    height, width = values.shape[:2]
    sums = _SUMS.get(values.dtype.type, np.float32)
    # Whole rows first, then pixels of the sums: five times faster than by blocks.
    total = _strided_sum(_strided_sum(values, factor, sums).swapaxes(0, 1), factor, sums).swapaxes(0, 1)
    rows, columns = (np.minimum(factor, n - np.arange(0, n, factor)) for n in (height, width))
    means = total * (1 / np.outer(rows, columns)[..., None]).astype(np.float32)
    return (np.rint(means) if values.dtype.kind == "u" else means).astype(values.dtype)


def _strided_sum(values: np.ndarray, factor: int, sums) -> np.ndarray:
    """Sums, of that type, of each `factor` entries along the first axis, of fewer at its end."""
    total = values[::factor].astype(sums)  # in memory as `values`, even where its axes are swapped
    for start in range(1, factor):
        part = values[start::factor]
        total[: len(part)] += part
    return total
