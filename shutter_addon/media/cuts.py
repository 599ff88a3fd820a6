"""Cuts within a source, and frames that repeat the one before: decisions about few neighbouring frames, made of a small
picture of each; and a source that knows where its shots end."""

from itertools import pairwise

import numpy as np

from ..core import light
from .errors import MediaError

# The frames on each side of two neighbours that have a say in whether there is a cut between them: films animated on
# threes, or with a 3:2 pulldown, move twice in so many, and a flash is mostly shorter.
NEIGHBOURS = 4
# What must change of the picture's own contrast. Within a shot that does not move fast it is 0.07 at most (the films in
# assets), between different pictures 0.3 and more. In between are jumps within the shot of a camera that stands still.
CHANGE = 0.12
# Across a cut frames differ by so much more than beside it. The fastest pans and shakes, dissolves and fades stay below
# 1.3; a cut into a pan of 8 % of the width a frame may be as low.
CONTRAST = 1.4
# Levels of 255 that are no structure: noise in flat or dark pictures.
NOISE = 3.0
# Levels by which blocks of repeated frames differ: 0.6 to 2.8 after H.264 and MPEG-4 of several qualities, mostly below
# 2. Slow motion may be as small; but beside a repeated frame there is more, on the two films eight times as much.
REPEATED, STILLER = 2.0, 4.0

_ROWS, _COLUMNS = 18, 32  # of a signature; each block is a mean of some 5 × 10 samples
_KEPT = 4 * 256  # signatures that are remembered: more than the longest window
_HANDED_BYTES = 256 << 20

Signature = np.ndarray


def signature(frame: np.ndarray, transfer: str, alpha: str = "opaque") -> Signature:
    """A small picture (18, 32, 3) float32 of a frame (H, W, 4), in encoded levels from 0 to 255; of a frame that is
    smaller, as small. transfer, alpha: the source's."""
    height, width = frame.shape[:2]
    down, right = max(1, height // (5 * _ROWS)), max(1, width // (10 * _COLUMNS))
    samples = frame[down // 2 :: down, right // 2 :: right]
    scale = np.float32(1 / np.iinfo(frame.dtype).max if frame.dtype.kind == "u" else 1)
    colours = samples[..., :3] * scale
    if frame.dtype.kind == "f":
        colours = np.nan_to_num(colours, copy=False).clip(0, 1)  # one sun would outweigh the rest of the picture
    if alpha == "straight":
        colours *= samples[..., 3:] * scale
    for axis, most in enumerate((_ROWS, _COLUMNS)):
        length = colours.shape[axis]
        edges = np.linspace(0, length, min(most, length) + 1).astype(int)
        sizes = np.diff(edges).astype(np.float32).reshape((-1,) + (1,) * (2 - axis))
        colours = np.add.reduceat(colours, edges[:-1], axis=axis) / sizes
    return 255 * (light.to_encoded(colours) if transfer == "linear" else colours)


def is_cut(before: list[Signature], after: list[Signature]) -> bool:
    """Whether there is a cut between the frames before[-1] and after[0].

    before, after: signatures of up to NEIGHBOURS successive frames on each side, fewer at the clip's ends alone.
    A cut parts frames that are alike from others that are alike: every frame before it differs from every one behind it
    in structure (brightness and contrast apart), and by more than neighbours on one side do. So a flash that passes, a
    fade, a dissolve, a pan or a shake is none. A change of side in the neighbourhood (the end of a very short shot) is
    allowed. Not found are cuts between much the same pictures, or into the midst of a fast pan; taken for one is what
    covers most of the picture at once, for NEIGHBOURS frames or longer."""
    before, after = [_levelled(s) for s in before], [_levelled(s) for s in after]
    if min(_change(a, b) for a in before for b in after) < CHANGE:
        return False
    beside = sorted(_difference(a, b) for side in (before, after) for a, b in pairwise(side))
    whole = len(beside) == 2 * (NEIGHBOURS - 1)
    usual = beside[-2] if whole else max(beside, default=0.0)
    return min(_difference(a, b) for a in before for b in after) >= CONTRAST * usual


def may_be_cut(before: Signature, after: Signature) -> bool:
    """Whether `is_cut` can be true of these two neighbours, as far as they alone tell."""
    return _change(_levelled(before), _levelled(after)) >= CHANGE


def is_duplicate(before: list[Signature], after: list[Signature]) -> bool:
    """Whether the frame after[0] repeats before[-1], but for the noise of a codec; arguments as for is_cut.

    Nothing in the picture may have moved, and something must have moved beside: a still scene has no duplicates."""
    here = _most(before[-1], after[0])
    beside = max((_most(a, b) for side in (before, after) for a, b in pairwise(side)), default=0.0)
    return here <= REPEATED and here * STILLER < beside


def neighbours(index: int, count: int) -> range:
    """The frames of a clip of `count` that have a say in whether there is a cut before frame `index`."""
    return range(max(index - NEIGHBOURS, 0), min(index + NEIGHBOURS, count))


def sides(signatures: dict[int, Signature | None], index: int) -> tuple[list[Signature], list[Signature]]:
    """Of the neighbours' signatures, those before frame `index` and those from it on, as is_cut and is_duplicate take
    them: on each side up to the first frame that has none."""
    return _run(signatures, index - 1, -1)[::-1], _run(signatures, index, 1)


def _levelled(picture: Signature) -> np.ndarray:
    return picture - picture.mean()


def _difference(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).mean())


def _change(a: np.ndarray, b: np.ndarray) -> float:
    """The difference in structure: 0, or about 1 for pictures that have nothing in common."""
    return _difference(a / (np.abs(a).mean() + NOISE), b / (np.abs(b).mean() + NOISE))


def _most(a: Signature, b: Signature) -> float:
    return float(np.abs(a - b).max())


class Shots:
    """A source that knows where its shots end: a source itself.

    step: every step-th frame is one that was filmed. Cuts are looked for in these alone; those between two of them
    belong to the nearer, the middle one to the first, as Inbetween has it.
    Filmed frames get their signatures when a cut is first looked for, and wait for the next `read` then, as far as
    there is room for them, so that none is decoded twice. Cuts are remembered, and depend on the frames alone.
    """

    def __init__(self, source, step: int = 1):
        self._source, self.step = source, step
        self.filmed = (source.count - 1) // step + 1  # how many frames are
        self._cuts: dict[int, bool] = {}  # by filmed frame: whether there is a cut before it
        self._signatures: dict[int, Signature | None] = {}  # likewise
        self._handed: dict[int, np.ndarray] = {}

    def __getattr__(self, name):
        return getattr(self._source, name)

    def read(self, index: int) -> np.ndarray:
        """The frame as the source gives it."""
        frame = self._handed.pop(index, None)
        return self._source.read(index) if frame is None else frame

    def around(self, index: int, low: int, high: int, *, known: bool = False) -> range:
        """The frames of the shot around frame `index`, for a window of the frames from `low` to `high`.

        Ends that lie beyond these are not looked for: the clip's take their place. It reads what has no signature yet,
        upwards, as decoders like it: the window's frames up to the first cut behind `index`, and where there may be a
        cut up to NEIGHBOURS frames on each side. known: it reads nothing, and where it does not know there is no cut.
        """
        first = 0
        is_cut = self._cuts.get if known else self._is_cut
        for i in self._after(low, high):
            if is_cut(i):
                if self._start(i) > index:
                    return range(first, self._start(i))
                first = self._start(i)
        return range(first, self.count)

    def lacking(self, index: int, low: int, high: int) -> set[int]:
        """The frames that `around` will read, unless what it reads shows more cuts."""
        stop = min(high + 1, self.around(index, low, high, known=True).stop)
        unknown = [i for i in self._after(low, stop - 1) if i not in self._cuts]
        return {j * self.step for i in unknown for j in (i - 1, i) if j not in self._signatures}

    def handed(self) -> set[int]:
        """The frames that wait for `read`."""
        return set(self._handed)

    def release(self) -> None:
        """Lets go of frames that wait for `read`."""
        self._handed = {}

    def close(self) -> None:
        """Lets go of the file; a later read opens it again."""
        self.release()
        self._source.close()

    def _after(self, low: int, high: int) -> range:
        """The filmed frames that begin between the frames from `low` to `high`."""
        first, last = (self._filmed(min(max(i, 0), self.count - 1)) for i in (low, high))
        return range(first + 1, last + 1)

    def _filmed(self, index: int) -> int:
        """The filmed frame that is nearest."""
        return (index + (self.step - 1) // 2) // self.step

    def _start(self, filmed: int) -> int:
        """The first frame that is nearest to that filmed one."""
        return filmed * self.step - (self.step - 1) // 2

    def _is_cut(self, index: int) -> bool:
        if index not in self._cuts:
            self._cuts[index] = self._decide(index)
        return self._cuts[index]

    def _decide(self, index: int) -> bool:
        last, next_ = self._signature(index - 1), self._signature(index)
        if last is None or next_ is None or not may_be_cut(last, next_):
            return False
        return is_cut(*sides({i: self._signature(i) for i in neighbours(index, self.filmed)}, index))

    def _signature(self, index: int) -> Signature | None:
        """None: the frame cannot be read. Whoever needs the frame itself will hear why."""
        if index not in self._signatures:
            try:
                frame = self.read(index * self.step)
            except MediaError:
                found = None
            else:
                found = signature(frame, self.transfer, self.alpha)
                self._hand_over(index * self.step, frame)
            self._signatures[index] = found
            while len(self._signatures) > _KEPT:
                del self._signatures[next(iter(self._signatures))]
        return self._signatures[index]

    def _hand_over(self, index: int, frame: np.ndarray) -> None:
        self._handed[index] = frame
        while len(self._handed) > 1 and len(self._handed) * frame.nbytes > _HANDED_BYTES:
            del self._handed[next(iter(self._handed))]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _run(signatures: dict, start: int, step: int) -> list[Signature]:
    """The signatures from a frame on, as far as there are any."""
    found = []
    while (picture := signatures.get(start)) is not None:
        found.append(picture)
        start += step
    return found
