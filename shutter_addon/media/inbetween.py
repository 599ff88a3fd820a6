"""In-between frames of a source, by optical flow, built once and kept in files: full exposure from ordinary footage
(appendix B).

factor-1 of them lie between two neighbouring source frames. Pair i is source frames i and i+1; its in-between frames
are built together."""

import os
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, as_completed, wait
from contextlib import closing, suppress
from functools import partial
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import stopping, threads
from ..core.farm.claims import Claims
from ..core.frames.frame_source import FrameSource
from ..core.frames.source_wrapper import SourceWrapper
from . import cuts, flow
from .completeness import why_short
from .errors import MediaError, NotBuiltError
from .files import check_index
from .inbetween_cache import InbetweenCache, State, write_picture
from .prefetch import PrefetchSource

MEMORY = 4 << 30  # bytes of all pairs that are built at the same time, and of the frames that are read ahead
AHEAD = 640 << 20  # bytes of frames that are read ahead, held twice at most; enough to read none of 16 bits in 4K twice
# Memory for building a pair, in RGBA frames of float32. Measured: 9 to 17 for "quick", 15 to 24.3 for "good".
LAYERS = 26
_PAUSE = 1.0  # seconds between two looks at what other processes have built

Pictures = Iterator[np.ndarray]  # the frames of a pair


class InbetweenSource(SourceWrapper):
    """A source with its in-between frames, at `factor` times its rate.

    Frame i·factor is the source's frame i. Those between come from the cache in `folder`; where the pair is a cut, they
    are the nearer source frame, and where it is two equal frames, the first."""

    def __init__(self, source: FrameSource, folder: str | Path, factor: int, method: str) -> None:
        super().__init__(source)
        self.factor = factor
        self._cache = InbetweenCache(source, folder, factor, method)
        self._cache.load()
        self.count = (source.count - 1) * factor + 1
        self.fps = None if source.fps is None else source.fps * factor
        self.options = {**source.options, "inbetween": [factor, method]}

    def has(self, index: int) -> bool:
        """Whether the frame exists; one built since the last call counts. Its file is not opened."""
        if not self._is_there(index):
            self._cache.load()
        return self._is_there(index)

    def check(self, index: int) -> None:
        """NotBuiltError: the frame is not built."""
        if not self.has(index):
            sentence = (
                f"{self.path.name}: in-between frames of frame {index // self.factor + 1} are missing; "
                f"build them first (in {self._cache.folder})"
            )
            raise NotBuiltError(sentence, self.factor)

    def read(self, index: int) -> np.ndarray:
        """MediaError: an in-between frame is not built, or damaged; or what the source's `read` raises."""
        check_index(self, index)
        self.check(index)
        real = self._real(index)
        return self._cache.read(index) if real is None else self._source.read(real)

    def _is_there(self, index: int) -> bool:
        return index in self._cache.listed.frames or self._real(index) is not None

    def _real(self, index: int) -> int | None:
        """The source frame that is shown at a frame; None: an in-between frame is."""
        pair, step = divmod(index, self.factor)
        kind = "same" if step == 0 else self._cache.listed.kinds.get(pair)
        if kind is None:
            return None
        return pair + (kind == "cut" and 2 * step > self.factor)


def build(
    source: FrameSource,
    folder: str | Path,
    factor: int,
    method: str,
    update: Callable[[int, int], None] = lambda done, total: None,
    cancelled: Callable[[], bool] = lambda: False,
    pairs: Sequence[int] | None = None,
) -> State:
    """Builds in-between frames in `folder`. Pictures that are there are checked, and damaged ones are built again.

    factor: 2 or more; method: one of flow.METHODS
    update: called with the number of finished pairs and that of all
    cancelled: called often, from several threads; True ends the build, and finished pairs are kept
    pairs: those to build, each by its first source frame, ascending (default: all)

    After a build that was killed, the next one goes on where that was. Several processes may build in the same folder,
    and share the pairs: one that another is building is waited for, and built here if that one is killed. The files are
    the same for any chunks and any interruptions. The source must not be used elsewhere meanwhile. Returns how far the
    build came. MediaError: a package that is needed is missing, or a frame cannot be read or written, and finished
    pairs are kept; or the source was written to meanwhile."""
    cache = InbetweenCache(source, folder, factor, method)
    pairs = range(source.count - 1) if pairs is None else pairs
    cache.load()
    if not cache.listed.pairs.issuperset(pairs):
        flow.check()
    try:
        cache.prepare()
        done = _build(cache, pairs, update, cancelled)
    except OSError as error:
        reason = error.strerror or error
        raise MediaError(f"{cache.folder}: in-between frames cannot be written there ({reason})") from None
    cache.confirm()
    return State("ready" if done == len(pairs) else "partial", done, len(pairs))


def _build(
    cache: InbetweenCache, pairs: Sequence[int], update: Callable[[int, int], None], cancelled: Callable[[], bool]
) -> int:
    """As `build`; how many pairs are finished."""
    done, left, source = 0, list(pairs), cache.source
    with Claims(cache.folder) as claims, closing(cuts.ShotSource(PrefetchSource(source))) as shots:
        while left:
            others: list[int] = []  # pairs that other processes are building
            tasks = _tasks(cache, shots, left, claims, others, cancelled)
            for finished in _in_parallel(tasks, _workers(source)):
                done += finished
                update(done, len(pairs))
            if len(others) == len(left):
                time.sleep(_PAUSE)
            left = others
        claims.clear(map(_claim, pairs))
    return done


def estimate(source: FrameSource) -> int:
    """About how many bytes one in-between frame of each pair takes, all together: as three source frames do on average.
    MediaError: these frames cannot be read or written."""
    sizes = [_bytes(source, source.read(source.count * part // 6)) for part in (1, 3, 5)]
    return (source.count - 1) * sum(sizes) // len(sizes)


def _bytes(source: FrameSource, picture: np.ndarray) -> int:
    """Of a picture that is written as a source's in-between frames are. MediaError: it cannot be."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "picture.png" if source.dtype.kind == "u" else "picture.exr")
        if not write_picture(path, picture, source.alpha):
            raise MediaError(f"{folder}: a picture could not be written whole ({why_short(path.parent)})")
        return path.stat().st_size


class Cost(NamedTuple):
    """What in-between frames of a source cost: seconds for each pair and for each of its frames, and bytes of these."""

    pair: float
    frame: float
    size: float

    def seconds(self, pairs: int, factor: int) -> float:
        return pairs * (self.pair + (factor - 1) * self.frame)

    def bytes(self, pairs: int, factor: int) -> float:
        return pairs * (factor - 1) * self.size


def cost(source: FrameSource, pair: int, method: str) -> Cost:
    """About what in-between frames of a source cost, by two that are made of one pair, and written: several pairs at a
    time take hardly less each, as one has all processors already. MediaError: they cannot be made."""
    first, second = source.read(pair), source.read(pair + 1)
    pictures = flow.between(first, second, 4, method, source.transfer, source.alpha)
    when, size = [time.perf_counter()], 0
    for picture in islice(pictures, 2):
        size = _bytes(source, picture)
        when.append(time.perf_counter())
    frame = when[2] - when[1]
    return Cost(max(when[1] - when[0] - frame, 0.0), frame, size)


def _tasks(
    cache: InbetweenCache,
    shots: cuts.ShotSource,
    pairs: list[int],
    claims: Claims,
    others: list[int],
    cancelled: Callable[[], bool],
) -> Iterator[Callable[[], bool]]:
    """Yields a function for each pair that builds it and returns whether it is finished; adds those to `others` that
    other processes have claimed. Frames are read here, in the caller's thread; the functions may run in any."""
    for pair in pairs:
        if cancelled():
            return
        if cache.is_sound(pair):
            yield lambda: True
        elif not claims.take(_claim(pair)):
            others.append(pair)
        elif cache.is_sound(pair):  # by another
            claims.release(_claim(pair))
            yield lambda: True
        else:
            # Those behind it decide what it is, and come next.
            shots.want(range(pair, min(pair + 2 + _ahead(shots), shots.count)))
            first, second = shots.read(pair), shots.read(pair + 1)
            kind = "same" if np.array_equal(first, second) else shots.kind(pair)
            shots.release()
            made = kind or flow.between(first, second, cache.factor, cache.method, shots.transfer, shots.alpha)
            yield partial(_make, cache, claims, pair, made, cancelled)


def _claim(pair: int) -> str:
    """The name of a pair's claim."""
    return f"{pair:08d}"


def _make(
    cache: InbetweenCache, claims: Claims, pair: int, made: str | Pictures, cancelled: Callable[[], bool]
) -> bool:
    """Builds a claimed pair: notes its kind, or writes its pictures. Whether it is finished."""
    try:
        if isinstance(made, str):
            cache.note(pair, made)
            return True
        with suppress(stopping.StoppedError), stopping.once(cancelled):
            for index, picture in zip(cache.steps(pair), made, strict=True):
                stopping.check()
                cache.write(index, picture)
            return True
        return False
    finally:
        claims.release(_claim(pair))


def _in_parallel(tasks: Iterable[Callable[[], bool]], workers: int) -> Iterator[bool]:
    """Runs tasks in threads, and yields their results. The next task is taken only when a thread is free, since a task
    holds its frames in memory."""
    with threads.pool(workers) as pool:
        running = set()
        for task in tasks:
            running.add(pool.submit(task))
            if len(running) == workers:
                ended, running = wait(running, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in ended)
        yield from (future.result() for future in as_completed(running))


def _workers(source: FrameSource) -> int:
    """How many pairs to build at the same time: one per processor, as far as MEMORY allows."""
    pair = source.width * source.height * 16 * LAYERS
    processors = getattr(os, "process_cpu_count", os.cpu_count)() or 1
    return max(1, min(processors, (MEMORY - 2 * _ahead(source) * _size(source)) // pair))


def _ahead(source: FrameSource) -> int:
    """How many frames beyond a pair may be kept: all that decide its kind, as far as AHEAD allows."""
    return min(cuts.NEIGHBOURS - 1, AHEAD // _size(source))


def _size(source: FrameSource) -> int:
    """Bytes of a frame."""
    return source.width * source.height * 4 * source.dtype.itemsize
