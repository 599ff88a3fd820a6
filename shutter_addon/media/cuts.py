"""Find cuts as PySceneDetect does, from small pictures of neighboring frames. And a source that finds its own cuts.

A shot is the frames between two cuts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache
from itertools import pairwise, product, takewhile

import numpy as np

from ..core.caches import RecentValues
from ..core.frames import light
from ..core.frames.frame_source import Decoded, FrameSource, Moment, Planes, SourceWrapper, as_rgba
from ..core.messages import MediaError

# Frames on each side that decide about a cut. A film animated on threes has as many pictures there as PySceneDetect
# compares.
NEIGHBOURS = 9
# A picture that returns within as many frames was interrupted by a flash or by a passing object, not by a cut.
PASSING = 3
# The bits of a hash to each side, and the share of all bits that differs at a cut. With 64 bits in all, a jump of the
# camera by a twentieth of the picture changes fewer bits than a cut; with PySceneDetect's 256 it changes as many.
BITS, APART = 8, 0.27
# The share that differs at a cut in the common part of the pictures, if the camera jumped by up to 1 / REACH of the
# picture to any side. Without a cut it is up to 0.16 (mostly 0.1), at cuts 0.19 or more.
REACH, MOVED = 4, 0.16
# Neighbors on each side, and the ratio by which a cut must exceed their mean change. PySceneDetect has 3; a little less
# finds cuts between pans and around short shots.
WINDOW, RATIO = 2, 2.8
# Levels of 255 by which a cut changes brightness, as in ContentDetector for pictures with a mean of GREY. Darker ones
# need proportionally less, but more than NOISE. A title that appears changes about 5, a large object that jumps 25.
CHANGE, GREY, NOISE = 27.0, 90.0, 2.0
# The share of CHANGE by which a cut changes each of PARTS × PARTS parts: 0.36 or more. If an object jumps or leaves,
# one part hardly changes.
PARTS, PART = 4, 0.2
# Levels by which blocks of repeated frames differ: 0.6 to 2.8 after H.264 and MPEG-4, mostly below 2.
REPEATED = 2.0

_ROWS, _COLUMNS = 18, 32  # blocks of a signature; each is a mean of about 5 × 10 samples
_KEPT = 4 * 256  # cached signatures, more than the longest window needs
_HANDED_BYTES = 256 << 20
_GREY = np.array([9798, 19235, 3735])  # OpenCV's weights in 1 / 32768

Signature = np.ndarray


def signature(frame: np.ndarray | Planes, transfer: str, alpha: str = "opaque") -> Signature:
    """Return a small picture of a frame, from which cuts are found.

    Args:
        frame: RGBA (H, W, 4), or planes of luma and chroma.
        transfer: How samples are encoded, as in FrameSource.
        alpha: The alpha mode, as in FrameSource.

    Returns:
        Encoded levels 0 … 255, float32 (18, 32, 3), or smaller if the frame is.
    """
    height, width = (frame.luma if isinstance(frame, Planes) else frame).shape[:2]
    down, right = max(1, height // (5 * _ROWS)), max(1, width // (10 * _COLUMNS))
    chosen = slice(down // 2, None, down), slice(right // 2, None, right)
    samples = frame.samples(*chosen) if isinstance(frame, Planes) else frame[chosen]
    whole = samples.dtype.kind == "u"
    most = np.float32(np.iinfo(samples.dtype).max if whole else 1)
    samples = np.moveaxis(samples, -1, 1)  # NumPy sums rows of one color fastest
    # Sums of whole numbers are exact: in the largest block, 10 × 20 samples of 16 bits, they stay below 2²⁴.
    colours = np.array(samples[:, :3], np.float32, order="C")
    if not whole:
        colours = np.nan_to_num(colours, copy=False).clip(0, most)  # the sun would outweigh the rest of the picture
    if alpha == "straight":
        colours *= samples[:, 3:] / most
    (rows, heights), (columns, widths) = _blocks(len(colours), _ROWS), _blocks(colours.shape[2], _COLUMNS)
    colours = np.stack([colours[row : row + height].sum(axis=0) for row, height in zip(rows, heights, strict=True)])
    colours = np.add.reduceat(colours, columns, axis=2) / (most * np.outer(heights, widths).astype(np.float32)[:, None])
    colours = np.ascontiguousarray(np.moveaxis(colours, 1, -1))
    return 255 * (light.to_encoded(colours) if transfer == "linear" else colours)


@lru_cache(8)
def _blocks(length: int, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Divide `length` samples into at most `most` blocks of nearly equal size, and return their starts and lengths."""
    edges = np.linspace(0, length, min(most, length) + 1).astype(int)
    return edges[:-1], np.diff(edges)


def is_cut(before: list[Signature], after: list[Signature]) -> bool:
    """Return whether there is a cut between the frames before[-1] and after[0].

    There is one if, by PySceneDetect's detectors, the pictures have nothing in common (HashDetector), brightness
    changes (ContentDetector), and it changes by far more than between neighbors (AdaptiveDetector). The first two must
    also hold for frames a little earlier and later, because a passing object is no cut. Then brightness must change in
    each part, and the pictures must have nothing in common even if the camera jumped.

    Not found are cuts between similar pictures, and some cuts to shots of one or two frames. Found by mistake are
    lasting changes of a whole still picture, and jumps of the camera by more than 1 / REACH of the picture.

    Args:
        before: Signatures of up to NEIGHBOURS successive frames, fewer only at the clip's start.
        after: The same for the frames after the possible cut, fewer only at the clip's end.
    """
    if not may_be_cut(before[-1], after[0]):
        return False
    passing = [(earlier, after[0]) for earlier in before[-PASSING - 1 : -1]]
    passing += [(before[-1], later) for later in after[1 : PASSING + 1]]
    if not all(may_be_cut(*pair) for pair in passing) or not _stands_out(_moving(before[::-1]), _moving(after)):
        return False
    last, first = before[-1], after[0]
    jumps = product(*(range(-(length // REACH), length // REACH + 1) for length in first.shape[:2]))
    # Parts that are black do not count.
    return all(_differ(*parts, 0.0, PART) for parts in zip(_parts(last), _parts(first), strict=True)) and all(
        _unlike(_shared(last, y, x), _shared(first, -y, -x)) >= MOVED for y, x in jumps
    )


def may_be_cut(before: Signature, after: Signature) -> bool:
    """Return whether two frames differ enough for a cut between them, by their signatures (small pictures).

    This is a quick test. `is_cut` also needs the frames around them.
    """
    return _differ(before, after, NOISE) and _unlike(before, after) >= APART


def _parts(picture: Signature) -> list[Signature]:
    """Divide a frame's small picture into PARTS × PARTS parts, without empty ones."""
    split = (np.array_split(rows, PARTS, axis=1) for rows in np.array_split(picture, PARTS))
    return [part for parts in split for part in parts if part.size]


def _shared(picture: Signature, down: int, right: int) -> Signature:
    """Return the part of a frame's small picture that another frame also shows if the camera jumped.

    Args:
        down, right: The jump of the camera from this frame to the other one, in pixels of the small picture; may be
            negative.
    """
    height, width = picture.shape[:2]
    return picture[max(down, 0) : height + min(down, 0), max(right, 0) : width + min(right, 0)]


def _differ(before: Signature, after: Signature, least: float, share: float = 1.0) -> bool:
    """Return whether brightness changes enough between the small pictures of two frames, or between parts of them.

    Enough is `share` · CHANGE (in pictures darker than GREY, proportionally less), but at least `least`, in levels of
    255.
    """
    threshold = max(share * CHANGE * min(max(before.mean(), after.mean()) / GREY, 1.0), least)
    return _change(before, after) >= threshold


def _stands_out(before: list[Signature], after: list[Signature]) -> bool:
    """Return whether brightness changes far more across the possible cut than between its neighbors (AdaptiveDetector).

    Args:
        before: Signatures of the frames before the cut, the nearest one first.
        after: Signatures of the frames after the cut, the nearest one first.
    """
    sides = before[: WINDOW + 1], after[: WINDOW + 1]
    beside = [_change(*pair) for side in sides for pair in pairwise(side)]
    here = _change(before[0], after[0])
    return here >= NOISE and here * len(beside) >= RATIO * sum(beside)


def _moving(pictures: list[Signature]) -> list[Signature]:
    """Return the small pictures of successive frames without those that repeat the one kept before."""
    kept = pictures[:1]
    for picture in pictures[1:]:
        if np.abs(kept[-1] - picture).max() > REPEATED:
            kept.append(picture)
    return kept


# PySceneDetect's detectors in NumPy, since OpenCV may be missing. Results are equal, except for pictures with fewer
# rows than HashDetector has bits. Levels are rounded.


def _change(before: np.ndarray, after: np.ndarray) -> float:
    """Return the mean change of brightness (maximum of R, G, B) between two frames' small pictures, in levels of 255.

    This is the score of PySceneDetect's ContentDetector for luma.
    """
    return float(np.abs(_whole(before).max(axis=-1).astype(int) - _whole(after).max(axis=-1)).mean())


def _unlike(before: np.ndarray, after: np.ndarray) -> float:
    """Return the share, 0 to 1, of bits in which the hashes of two frames' small pictures differ (HashDetector)."""
    return np.count_nonzero(_hash(before) != _hash(after)) / BITS**2


def _whole(picture: np.ndarray) -> np.ndarray:
    """Return a frame's small picture, rounded and clipped to uint8."""
    return np.rint(picture).clip(0, 255).astype(np.uint8)


# The lowest frequencies of the orthonormal discrete cosine transform, a row for each.
_WAVES = np.cos(np.pi / (2 * BITS) * np.outer(np.arange(BITS), np.arange(2 * BITS) + 0.5)) * np.sqrt(1 / BITS)
_WAVES[0] /= np.sqrt(2)


def _hash(picture: np.ndarray) -> np.ndarray:
    """Return the hash of a frame's small picture: which of its low frequencies exceed their median.

    Returns:
        bool (BITS, BITS), as by PySceneDetect's HashDetector.
    """
    grey = (_whole(picture) @ _GREY + (1 << 14)) >> 15
    down, right = (_means(length, 2 * BITS) for length in grey.shape)
    small = np.rint(down @ grey @ right.T)  # like OpenCV's INTER_AREA except for rounding
    low = np.float32(_WAVES @ np.float32(small / max(small.max(), 1)) @ _WAVES.T)
    return np.greater(low, np.median(low))


@lru_cache(16)
def _means(length: int, size: int) -> np.ndarray:
    """Return a matrix (size, length) that averages `length` samples in `size` equal parts of an axis."""
    scale = length / size
    edges = np.clip(np.arange(length + 1), *(np.arange(size)[:, None] * scale + end for end in (0, scale)))
    return np.diff(edges) / scale


class ShotSource(SourceWrapper):
    """A source that finds its own cuts: the ShotFinder of another source, and a wrapper around it.

    Cuts lie between filmed frames; the moments between two of them belong to the nearer one, the middle one to the
    first. Frames that are read to find cuts wait for the next `read`, within a limit, so that none is decoded twice.
    Cuts are cached, unless a frame could not be read.

    Attributes:
        step: Frames 0, step, 2 · step … were filmed. Those between them are moments: computed.
        filmed: How many frames were filmed.
    """

    def __init__(self, source: FrameSource, step: int = 1) -> None:
        super().__init__(source)
        self.step = step
        self.filmed = (source.count - 1) // step + 1
        self._cuts: dict[int, bool] = {}  # {filmed frame: whether there is a cut before it}
        self._signatures: RecentValues[int, Signature] = RecentValues()  # by filmed frame
        self._handed: dict[int, Decoded] = {}

    @property  # an attribute would be a cycle, which keeps frames in memory until Python collects it
    def shots(self) -> ShotSource:  # type: ignore[override]  # nobody sets a source's shots
        return self

    def read(self, index: int) -> np.ndarray:
        """Return a frame (height, width, 4). One that was read to find cuts is not decoded again."""
        return as_rgba(self.decoded(index))

    def decoded(self, index: int) -> Decoded:
        """Return a frame in its fastest form (FrameSource.decoded). One read to find cuts is not decoded again."""
        frame = self._handed.pop(index, None)
        return self._source.decoded(index) if frame is None else frame

    def around(self, index: int, low: int, high: int, *, known: bool = False) -> range:
        """Return the frames of the shot around a frame, between the cuts found in `low` … `high` (ShotFinder.around).

        On a side without a cut, the shot extends to the clip's start or end. With `known`, only cuts that earlier calls
        found count, and nothing is read. Otherwise, this reads filmed frames that have no signature yet: in ascending
        order those from `low` to the first cut after `index`, or to `high`; and NEIGHBOURS frames on each side of a
        possible cut, some of which may be before `low` or after `high`.
        """
        if known:
            return self._shot(index, low, high, self._cuts.get)
        shot = self._shot(index, low, high, self._is_cut)
        beyond = NEIGHBOURS * self.step  # frames further away are not needed soon
        self._handed = {i: frame for i, frame in self._handed.items() if low - beyond <= i <= high + beyond}
        return shot

    def _shot(self, index: int, low: int, high: int, is_cut: Callable[[int], bool | None]) -> range:
        """Return the frames of the shot around `index`, between the cuts in `low` … `high`.

        `is_cut` tells whether there is a cut before a filmed frame, given by its number among filmed frames. None
        (unknown) counts as no.
        """
        first = 0
        for i in self._after(low, high):
            if is_cut(i):
                if self._start(i) > index:
                    return range(first, self._start(i))
                first = self._start(i)
        return range(first, self.count)

    def lacking(self, index: int, low: int, high: int) -> set[int]:
        """Return the frames that `around` would read for the same arguments if no new cut seemed possible there."""
        stop = min(high + 1, self.around(index, low, high, known=True).stop)
        unknown = [i for i in self._after(low, stop - 1) if i not in self._cuts]
        return {j * self.step for i in unknown for j in (i - 1, i) if j not in self._signatures}

    def handed(self) -> set[int]:
        """Return the numbers of the frames that were read to find cuts and are kept for the next `read`."""
        return set(self._handed)

    def release(self) -> None:
        """Free the frames that were read to find cuts and wait for `read`."""
        self._handed = {}

    def close(self) -> None:
        """Close the footage's source, and free the frames that wait for `read`. A later read opens it again."""
        self.release()
        self._source.close()

    def _after(self, low: int, high: int) -> range:
        """Return the numbers of the filmed frames before which a cut between the frames `low` and `high` can lie."""
        first, last = (self._filmed(min(max(i, 0), self.count - 1)) for i in (low, high))
        return range(first + 1, last + 1)

    def _filmed(self, index: int) -> int:
        """Return the number of the filmed frame nearest to a frame, which may be a moment between two."""
        return (index + (self.step - 1) // 2) // self.step

    def _start(self, filmed: int) -> int:
        """Return the first of the frames (moments, too) that are nearest to a filmed frame, given by its number."""
        return filmed * self.step - (self.step - 1) // 2

    def _is_cut(self, index: int) -> bool:
        """Return whether there is a cut before a filmed frame, given by its number. A certain answer is cached."""
        if index in self._cuts:
            return self._cuts[index]
        cut, certain = self._decide(index)
        if certain:
            self._cuts[index] = cut
        return cut

    def _decide(self, index: int) -> tuple[bool, bool]:
        """Return whether there is a cut before a filmed frame, and whether all frames that decide it could be read."""
        last, next_ = self._signature(index - 1), self._signature(index)
        if last is None or next_ is None:
            return False, False
        if not may_be_cut(last, next_):
            return False, True
        start, stop = max(index - NEIGHBOURS, 0), min(index + NEIGHBOURS, self.filmed)
        beside = [self._signature(i) for i in range(start, stop)]
        before, after = _known(reversed(beside[: index - start]))[::-1], _known(beside[index - start :])
        return is_cut(before, after), len(before) + len(after) == len(beside)

    def _signature(self, index: int) -> Signature | None:
        """Return the signature (the small picture) of a filmed frame, or None if the frame cannot be read.

        The error is not lost: reading the frame itself raises it again.
        """
        if index in self._signatures:
            return self._signatures[index]
        try:
            frame = self.decoded(index * self.step)
        except MediaError:
            return None
        shown = frame.ends[0] if isinstance(frame, Moment) else frame  # a repeated frame may be a moment of equal ends
        made = self._signatures.keep(index, signature(shown, self.transfer, self.alpha), _KEPT)
        self._handed[index * self.step] = frame
        while len(self._handed) > 1 and len(self._handed) * frame.nbytes > _HANDED_BYTES:
            del self._handed[next(iter(self._handed))]
        return made


def _known(signatures: Iterable[Signature | None]) -> list[Signature]:
    """Return the signatures (small pictures) before the first one that is None, whose frame could not be read."""
    return [each for each in takewhile(lambda each: each is not None, signatures) if each is not None]
