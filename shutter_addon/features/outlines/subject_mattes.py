"""The mattes of a subject in all frames of its footage: found by a network under strokes, carried from there by the
footage's motion, and corrected by the network again. Drawings overrule both.

Frames with strokes or drawings are keyframes. From each of them a chain of mattes goes forth and back, as far as the
next keyframe or cut. A matte is made of the one before it in its chain, and a file keeps it; so it is the same wherever
a process begins. Between two keyframes, both chains are mixed in the middle.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ...core import stopping
from ...core.frames.frame_source import FrameSource
from ...core.model import outlines
from ...media import derived, flow, opencv
from ...media.files import MODEL
from ...media.image_writing import write_levels
from ...media.opencv import cv2
from . import carrying
from .carried_mattes import CONFIDENCE, CarriedMattes, Drawings, nearest
from .subject import WIDTH, Found, Network, covered, followed, found, refined, without

VERSION = 1  # raise it when mattes of the same strokes change
EXCLUDED = 1  # the level of what strokes say that the subject is not
MIDDLE = 3.0  # the part of a span between two keyframes in which both of their chains count is a third
STEEPER = 3.0
_LEAST = 1e-3
GONE = -1.0  # the confidence of a chain behind a cut

Strokes = Mapping[int, Sequence[Any]]


@dataclass(frozen=True)
class MarkedSubject:
    """Strokes on a subject, and on what it is not.

    Attributes:
        strokes, nots: By source frame, arrays of points (n, 2) in fractions of the picture, y up.
    """

    strokes: Strokes = field(hash=False)
    nots: Strokes = field(hash=False)

    def __post_init__(self) -> None:
        for name in ("strokes", "nots"):  # as plain tuples, which can be compared
            drawn = {frame: outlines.curves(it) for frame, it in sorted(getattr(self, name).items()) if len(it)}
            object.__setattr__(self, name, drawn)


class Footage(Hashable, Protocol):
    """What opens the source; equal where it gives the same frames."""

    def open(self) -> FrameSource: ...


@dataclass(frozen=True)
class CarriedFile:
    """A core.model.mattes.MatteFile of an outline or a subject.

    Attributes:
        drawings: By ascending source frame, the curves of each (core.model.outlines).
        folder: Where mattes are kept. If it is None or cannot be written to, they are kept while this program runs.
        subject: The strokes of a subject; None: an outline.
        model: The file of the network that finds subjects.
    """

    footage: Footage
    # Each frame of a window asks for the hash; drawings may have thousands of points.
    drawings: Drawings = field(hash=False)
    folder: Path | None = None
    subject: MarkedSubject | None = None
    model: Path = MODEL

    def open(self) -> CarriedMattes:
        """MediaError: the footage or the network cannot be read, or OpenCV is missing."""
        opencv.check("subjects are found by" if self.subject else "outlines are tracked by", "ximgproc")
        if self.subject is None:
            return CarriedMattes(self.footage.open(), self.drawings, self.folder)
        return SubjectMattes(self.footage.open(), self.drawings, self.folder, self.subject, self.model)


class SubjectMattes(CarriedMattes):
    """The mattes of a subject; see CarriedMattes."""

    def __init__(
        self, source: FrameSource, drawings: Drawings, folder: Path | None, subject: MarkedSubject, model: Path
    ) -> None:
        super().__init__(source, drawings, folder)
        self._subject, self._model, self._digest = subject, model, derived.content_digest(model, whole=1 << 40).hex()
        drawn = set(self._keys)
        strokes, nots = subject.strokes, subject.nots
        for frame in {*strokes, *nots} - drawn:
            if 0 <= frame < self.count:
                made_of = [strokes.get(frame, ()), nots.get(frame, ()), WIDTH]
                self._keys[frame] = derived.key({"frame": frame, "strokes": made_of})
        # What a keyframe with nothing but strokes of what the subject is not shows depends on the others.
        self._showing = {frame: key for frame, key in self._keys.items() if frame in drawn or frame in strokes}
        for frame in self._keys.keys() - self._showing.keys():
            around = [self._keys[end] for end in nearest(frame, self._showing) if end is not None]
            self._keys[frame] = derived.key({"strokes": self._keys[frame], "around": around})
        self._before: tuple[int, np.ndarray, np.ndarray] | None = None

    def read(self, index: int) -> np.ndarray:
        """As CarriedMattes.read. MediaError: the network cannot be read, too."""
        index = min(max(index, 0), self.count - 1)
        sides = self._sides(index, makes=True) or []
        mattes = [(self._kept(path), share) for path, share, _sure in sides]
        shown = [(np.where(it == EXCLUDED, 0, it) / np.float32(255), share) for it, share in mattes if it is not None]
        return mixed(shown) if shown else self._nothing()

    def has(self, index: int) -> bool:
        return self._sides(index) is not None

    def confidence(self, index: int) -> float | None:
        sides = self._sides(index)
        if sides is None:
            return None
        if all(sure == GONE for _path, _share, sure in sides):  # nothing is there, surely
            return 1.0
        return sum(share * sure for _path, share, sure in sides)

    def _sides(self, index: int, *, makes: bool = False) -> list[tuple[Path, float, float]] | None:
        """Return the files that a matte is mixed of, with their shares and confidences; None if one is missing.

        Args:
            makes: Make what is missing.
        """
        ends = sorted({end for end in self._near(index) if end is not None}, key=lambda end: abs(end - index))
        span = sum(abs(end - index) for end in ends)
        sides: list[tuple[Path, float, float]] = []
        for end in ends:
            share = min(max(MIDDLE * (0.5 - abs(end - index) / span) + 0.5, 0.0), 1.0) if len(ends) > 1 else 1.0
            if share == 0 and sides[0][2] != GONE:
                break  # the nearest keyframe alone counts
            if makes and self._sure(index, end) is None:
                with self._claimed(index, end, None) as kept:
                    if kept is None:
                        self._make(index, end)
            if (sure := self._sure(index, end)) is None:
                return None
            weight = 0.0 if sure == GONE else max(share, _LEAST) * max(sure, _LEAST)
            sides.append((self._path(index, end, None), weight, sure))
        total = sum(weight for _path, weight, _sure in sides) or 1.0
        return [(path, weight / total, sure) for path, weight, sure in sides]

    def _sure(self, index: int, end: int) -> float | None:
        """Return the confidence of a frame's matte in the chain of a keyframe; None if it is not kept."""
        return self._described(self._path(index, end, None))

    def _make(self, index: int, end: int) -> None:
        """Make the mattes of a chain from the last one on that is kept."""
        step = 1 if index > end else -1
        start = index
        while start != end and self._sure(start, end) is None:
            start -= step
        if start == end and self._sure(end, end) is None:
            self._write(end, end, *self._first(end))
        for frame in range(start, index, step):
            stopping.check()
            self._write(frame + step, end, *self._next(frame, frame + step, end))
        self._shots.release()

    def _write(self, frame: int, end: int, matte: np.ndarray, excluded: np.ndarray, sure: float) -> None:
        levels = flow.levels(matte)
        levels[levels == EXCLUDED] = EXCLUDED + 1
        levels[(levels < EXCLUDED) & (_fitted(excluded, levels) > 0.5)] = EXCLUDED
        write_levels(self._path(frame, end, None), levels, f"{CONFIDENCE}{sure:.3f}")

    def _first(self, frame: int) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the matte (H, W) of a keyframe, what is excluded from it (h, w), and its confidence."""
        picture, small = self._pictures(frame)
        nothing = np.zeros(small.shape[:2], np.float32)
        if frame in self._drawings:
            return carrying.drawn(picture, self._drawing(frame).cover) / np.float32(255), nothing, 1.0
        strokes = (each.get(frame, ()) for each in (self._subject.strokes, self._subject.nots))
        on, off = (covered(each, small) for each in strokes)
        if frame in self._showing:
            what = found(self._network, small, on, off) or Found(on.astype(np.float32), nothing, 0.0)
        else:
            what = without(self._carried_to(frame), small, on, off)
        return refined(picture, what.share), what.excluded, what.confidence

    def _next(self, before: int, frame: int, end: int) -> tuple[np.ndarray, np.ndarray, float]:
        """As `_first`, of the frame behind one in a chain."""
        path = self._path(before, end, None)
        matte, sure = self._kept(path), self._described(path)
        low, high = sorted((before, frame))
        if matte is None or sure is None or sure == GONE or before not in self._shots.around(frame, low, high):
            return self._nothing(), self._nothing(), GONE
        (_, old), (picture, small) = (self._pictures(each) for each in (before, frame))
        size = small.shape[1::-1]
        excluded = flow.resized((matte == EXCLUDED).astype(np.float32), size)
        share = flow.resized(matte, size).astype(np.float32) / 255
        what, still = followed(self._network, old, small, Found(share, excluded, sure))
        found_there = refined(picture, what.share)
        found_there += _fitted(still, matte) * (matte / np.float32(255) - found_there)
        return found_there, what.excluded, what.confidence

    def _pictures(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Return a frame's picture, and a smaller one. That of the frame before is remembered."""
        if self._before is None or self._before[0] != frame:
            picture = self._picture(frame)
            small = flow.resized(picture, carrying.working_size(self.width, self.height))
            self._before = frame, picture, small
        return self._before[1:]

    def _carried_to(self, frame: int) -> Found:
        """Return the subject in a frame as it is without the strokes there."""
        nots = {each: strokes for each, strokes in self._subject.nots.items() if each in self._showing}
        drawings, subject = tuple(self._drawings.items()), replace(self._subject, nots=nots)
        mattes = SubjectMattes(self._source, drawings, self._parent, subject, self._model)
        share = flow.resized(mattes.read(frame), carrying.working_size(self.width, self.height))
        return Found(share, np.zeros_like(share), mattes.confidence(frame) or 0.0)

    @cached_property
    def _network(self) -> Network:
        return Network(self._model)

    def _near(self, index: int) -> tuple[int | None, int | None]:
        return nearest(index, self._keys)

    def _drawn(self, first: int | None, last: int | None) -> list[str]:
        return [*super()._drawn(first, last), f"subject {VERSION}", self._digest]


def mixed(mattes: list[tuple[np.ndarray, float]]) -> np.ndarray:
    """Return the mean (H, W) of one or two mattes by their shares, less soft where they differ."""
    if len(mattes) == 1:
        return mattes[0][0] * np.float32(mattes[0][1] > 0)
    (one, share), (other, rest) = mattes
    mean = np.float32(share) * one + np.float32(rest) * other
    steep = 1 + STEEPER * np.abs(one - other)
    return np.clip((mean - 0.5) * steep + 0.5, 0, 1) if share + rest else mean


def _fitted(values: np.ndarray, matte: np.ndarray) -> np.ndarray:
    """Return values (h, w) for each pixel of a matte (H, W)."""
    return cv2.resize(values, matte.shape[::-1])
