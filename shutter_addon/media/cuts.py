"""Cuts within a source, found as PySceneDetect finds them: decisions about few neighbouring frames, made of a small
picture of each; and a source that knows where its shots end."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache
from itertools import pairwise, product, takewhile

import numpy as np

from ..core.frames import light
from ..core.frames.frame_source import FrameSource, SourceWrapper
from ..core.frames.planes import Decoded, Moment, Planes, as_rgba
from ..core.memo import Kept
from .errors import MediaError

# The frames on each side of two neighbours that have a say in whether there is a cut between them: in so many, a film
# animated on threes shows as many pictures as PySceneDetect compares.
NEIGHBOURS = 9
# What is back after so many frames, or was there so many before, was a flash, or something that passed.
PASSING = 3
# The bits of a hash in each direction, and the share of all that differs at a cut. The fewer, the coarser is what they
# stand for: of 64, a jump of the camera by a twentieth of the picture mostly changes less, of
# PySceneDetect's 256 as many as a cut.
BITS, APART = 8, 0.27
# The share that differs at a cut wherever the camera may have jumped, by up to 1 / REACH of the picture to any side:
# where it has, what the pictures share differs by up to 0.16 (mostly 0.1), at cuts by 0.19 or more.
REACH, MOVED = 4, 0.16
# Neighbours on each side whose mean change a cut must exceed, PySceneDetect's own, and by how much: a little less than
# its own 3, for cuts between pans and around short shots.
WINDOW, RATIO = 2, 2.8
# Levels of 255 by which a cut changes brightness, ContentDetector's own for pictures that are GREY on average; darker
# ones need less, in proportion, but for noise. A title that appears changes about 5, a large object that jumps 25.
CHANGE, GREY, NOISE = 27.0, 90.0, 2.0
# The share of it by which a cut changes each part of the picture, of so many across and down: 0.36 or more. Where an
# object jumps or leaves, one part hardly changes.
PARTS, PART = 4, 0.2
# Levels by which blocks of repeated frames differ: 0.6 to 2.8 after H.264 and MPEG-4 of several qualities, mostly below
# 2.
REPEATED = 2.0

_ROWS, _COLUMNS = 18, 32  # of a signature; each block is a mean of some 5 × 10 samples
_KEPT = 4 * 256  # signatures that are remembered: more than the longest window
_HANDED_BYTES = 256 << 20
_GREY = np.array([9798, 19235, 3735])  # OpenCV's, in 1 / 32768

Signature = np.ndarray


def signature(frame: np.ndarray | Planes, transfer: str, alpha: str = "opaque") -> Signature:
    """A small picture (18, 32, 3) float32 of a frame (H, W, 4) or of its planes, in encoded levels from 0 to 255; of
    one that is smaller, as small. transfer, alpha: the source's."""
    height, width = (frame.luma if isinstance(frame, Planes) else frame).shape[:2]
    down, right = max(1, height // (5 * _ROWS)), max(1, width // (10 * _COLUMNS))
    chosen = slice(down // 2, None, down), slice(right // 2, None, right)
    samples = frame.samples(*chosen) if isinstance(frame, Planes) else frame[chosen]
    whole = samples.dtype.kind == "u"
    most = np.float32(np.iinfo(samples.dtype).max if whole else 1)
    samples = np.moveaxis(samples, -1, 1)  # a row for each colour: NumPy sums those fastest
    # Sums of whole numbers are exact: those of the largest block, 10 × 20 samples of 16 bits, are below 2²⁴.
    colours = np.array(samples[:, :3], np.float32, order="C")
    if not whole:
        colours = np.nan_to_num(colours, copy=False).clip(0, most)  # one sun would outweigh the rest of the picture
    if alpha == "straight":
        colours *= samples[:, 3:] / most
    (rows, heights), (columns, widths) = _blocks(len(colours), _ROWS), _blocks(colours.shape[2], _COLUMNS)
    colours = np.stack([colours[row : row + height].sum(axis=0) for row, height in zip(rows, heights, strict=True)])
    colours = np.add.reduceat(colours, columns, axis=2) / (most * np.outer(heights, widths).astype(np.float32)[:, None])
    colours = np.ascontiguousarray(np.moveaxis(colours, 1, -1))
    return 255 * (light.to_encoded(colours) if transfer == "linear" else colours)


@lru_cache(8)
def _blocks(length: int, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Where blocks of so many samples begin, and how long they are: as many as there are samples, `most` at most."""
    edges = np.linspace(0, length, min(most, length) + 1).astype(int)
    return edges[:-1], np.diff(edges)


def is_cut(before: list[Signature], after: list[Signature]) -> bool:
    """Whether there is a cut between the frames before[-1] and after[0].

    before, after: signatures of up to NEIGHBOURS successive frames on each side, fewer at the clip's ends alone.
    There is one where HashDetector finds that the pictures have nothing in common, its ContentDetector
    that brightness changes, and its AdaptiveDetector that it changes by far more than between neighbours. The first
    two are asked as well about what comes a little later or came a little earlier, for what passes is no cut; then
    ContentDetector about each part, and HashDetector about what the pictures share if the camera has jumped. Not
    found are cuts between much the same pictures, and some of those to shots of one or two frames; taken for one is
    what changes all of a still picture at once, and stays, and a jump of the camera by more than 1 / REACH."""
    if not may_be_cut(before[-1], after[0]):
        return False
    passing = [(earlier, after[0]) for earlier in before[-PASSING - 1 : -1]]
    passing += [(before[-1], later) for later in after[1 : PASSING + 1]]
    stands_out = all(may_be_cut(*pair) for pair in passing) and _stands_out(_moving(before[::-1]), _moving(after))
    return stands_out and _all_changes(before[-1], after[0])


def may_be_cut(before: Signature, after: Signature) -> bool:
    """Whether `is_cut` can be true of these two neighbours, as far as they alone tell."""
    return _differ(before, after, NOISE) and _unlike(before, after, BITS) >= APART


def _all_changes(before: Signature, after: Signature) -> bool:
    """Whether brightness changes in every part of the picture, but where both are black, and the pictures have nothing
    in common wherever the camera may have jumped."""
    jumps = product(*(range(-(length // REACH), length // REACH + 1) for length in before.shape[:2]))
    return all(_differ(*parts, 0.0, PART) for parts in zip(_parts(before), _parts(after), strict=True)) and all(
        _unlike(_shared(before, y, x), _shared(after, -y, -x), BITS) >= MOVED for y, x in jumps
    )


def _parts(picture: Signature) -> list[Signature]:
    split = (np.array_split(rows, PARTS, axis=1) for rows in np.array_split(picture, PARTS))
    return [part for parts in split for part in parts if part.size]


def _shared(picture: Signature, down: int, right: int) -> Signature:
    """The part of a picture that lies in its frame moved by so many blocks as well."""
    height, width = picture.shape[:2]
    return picture[max(down, 0) : height + min(down, 0), max(right, 0) : width + min(right, 0)]


def _differ(before: Signature, after: Signature, least: float, share: float = 1.0) -> bool:
    """Whether brightness changes by that share of what a cut changes, and by no fewer levels than `least`."""
    threshold = max(share * CHANGE * min(max(before.mean(), after.mean()) / GREY, 1.0), least)
    return _change(before, after) >= threshold


def _stands_out(before: list[Signature], after: list[Signature]) -> bool:
    """Whether AdaptiveDetector finds that from before[0] to after[0] more changes than between neighbours; both lists
    lead away from there."""
    sides = before[: WINDOW + 1], after[: WINDOW + 1]
    beside = [_change(*pair) for side in sides for pair in pairwise(side)]
    here = _change(before[0], after[0])
    return here >= NOISE and here * len(beside) >= RATIO * sum(beside)


def _moving(pictures: list[Signature]) -> list[Signature]:
    """Those that do not repeat the one before."""
    kept = pictures[:1]
    for picture in pictures[1:]:
        if np.abs(kept[-1] - picture).max() > REPEATED:
            kept.append(picture)
    return kept


# What PySceneDetect's detectors say of pictures, by NumPy alone, as OpenCV may be missing. The sums are the same, but
# for pictures of fewer rows than HashDetector has bits. Levels are rounded.


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """ContentDetector's score of luma alone: by how many levels the largest colour differs on average."""
    return float(np.abs(_whole(before).max(axis=-1).astype(int) - _whole(after).max(axis=-1)).mean())


def _unlike(before: np.ndarray, after: np.ndarray, bits: int) -> float:
    """Which share of HashDetector's bits differs, of so many in each direction."""
    return np.count_nonzero(_hash(before, bits) != _hash(after, bits)) / bits**2


def _whole(picture: np.ndarray) -> np.ndarray:
    return np.rint(picture).clip(0, 255).astype(np.uint8)


def _hash(picture: np.ndarray, bits: int) -> np.ndarray:
    """Which of the lowest frequencies are above their median."""
    size = 2 * bits
    small = _resized((_whole(picture) @ _GREY + (1 << 14)) >> 15, size)
    waves = _waves(size)[:bits]
    low = np.float32(waves @ np.float32(small / max(small.max(), 1)) @ waves.T)
    return np.greater(low, np.median(low))


def _resized(grey: np.ndarray, size: int) -> np.ndarray:
    """A square of a picture, by means, as OpenCV's INTER_AREA makes it but for rounding."""
    down, right = (_means(length, size) for length in grey.shape)
    return np.rint(down @ grey @ right.T)


@lru_cache(16)
def _means(length: int, size: int) -> np.ndarray:
    """Which shares so many samples along an axis have in `size` even parts of it."""
    scale = length / size
    edges = np.clip(np.arange(length + 1), *(np.arange(size)[:, None] * scale + end for end in (0, scale)))
    return np.diff(edges) / scale


@lru_cache(2)
def _waves(size: int) -> np.ndarray:
    """The orthonormal discrete cosine transform of so many samples, a row for each frequency."""
    waves = np.cos(np.pi / size * np.outer(np.arange(size), np.arange(size) + 0.5)) * np.sqrt(2 / size)
    waves[0] /= np.sqrt(2)
    return waves


class ShotSource(SourceWrapper):
    """A source that knows where its shots end: a source itself.

    step: every step-th frame is one that was filmed. Cuts are looked for in these alone; those between two of them
    belong to the nearer, the middle one to the first.
    Filmed frames get their signatures when a cut is first looked for, and wait for the next `read` then, as far as
    there is room for them, so that none is decoded twice. Cuts are remembered, and depend on the frames alone;
    what is decided without a frame that cannot be read is decided again.
    """

    def __init__(self, source: FrameSource, step: int = 1) -> None:
        super().__init__(source)
        self.step = step
        self.filmed = (source.count - 1) // step + 1  # how many frames are
        self._cuts: dict[int, bool] = {}  # by filmed frame: whether there is a cut before it
        self._signatures: Kept[int, Signature] = Kept()  # likewise
        self._handed: dict[int, Decoded] = {}

    @property  # an attribute would keep its frames until Python looks for cycles
    def shots(self) -> ShotSource:  # type: ignore[override]  # nobody sets a source's shots
        return self

    def read(self, index: int) -> np.ndarray:
        """The frame as the source gives it."""
        return as_rgba(self.decoded(index))

    def decoded(self, index: int) -> Decoded:
        """The frame as the source has it decoded."""
        frame = self._handed.pop(index, None)
        return self._source.decoded(index) if frame is None else frame

    def around(self, index: int, low: int, high: int, *, known: bool = False) -> range:
        """As ShotFinder has it. It reads what has no signature yet, upwards, as decoders like it: the window's frames
        up to the first cut behind `index`, and where there may be a cut up to NEIGHBOURS frames on each side."""
        if known:
            return self._shot(index, low, high, self._cuts.get)
        shot = self._shot(index, low, high, self._is_cut)
        beyond = NEIGHBOURS * self.step  # what was read there will be asked for soon, or never
        self._handed = {i: frame for i, frame in self._handed.items() if low - beyond <= i <= high + beyond}
        return shot

    def _shot(self, index: int, low: int, high: int, is_cut: Callable[[int], bool | None]) -> range:
        first = 0
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
        if index in self._cuts:
            return self._cuts[index]
        cut, certain = self._decide(index)
        if certain:
            self._cuts[index] = cut
        return cut

    def _decide(self, index: int) -> tuple[bool, bool]:
        """Whether there is a cut before that filmed frame, and whether all that has a say in it could be read."""
        last, next_ = self._readable(index - 1), self._readable(index)
        if last is None or next_ is None:
            return False, False
        if not may_be_cut(last, next_):
            return False, True
        start, stop = max(index - NEIGHBOURS, 0), min(index + NEIGHBOURS, self.filmed)
        beside = [self._readable(i) for i in range(start, stop)]
        before, after = _known(reversed(beside[: index - start]))[::-1], _known(beside[index - start :])
        return is_cut(before, after), len(before) + len(after) == len(beside)

    def _readable(self, index: int) -> Signature | None:
        """None: the frame cannot be read now. Whoever needs the frame itself will hear why."""
        try:
            return self._signature(index)
        except MediaError:
            return None

    def _signature(self, index: int) -> Signature:
        if index in self._signatures:
            return self._signatures[index]
        frame = self.decoded(index * self.step)
        shown = frame.ends[0] if isinstance(frame, Moment) else frame  # which a repeated frame repeats
        made = self._signatures.keep(index, signature(shown, self.transfer, self.alpha), _KEPT)
        self._handed[index * self.step] = frame
        while len(self._handed) > 1 and len(self._handed) * frame.nbytes > _HANDED_BYTES:
            del self._handed[next(iter(self._handed))]
        return made


def _known(signatures: Iterable[Signature | None]) -> list[Signature]:
    """Those before the first that is missing."""
    return [each for each in takewhile(lambda each: each is not None, signatures) if each is not None]
