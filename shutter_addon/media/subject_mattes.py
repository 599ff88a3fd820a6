"""The mattes of a subject in all frames of its footage: found by a network under strokes, carried from there by the
footage's motion, and corrected by the network again. Drawings overrule both.

Frames with strokes or drawings are keyframes. From each of them a chain of mattes goes forth and back, as far as the
next keyframe or cut. A matte is made of the one before it in its chain, and a file keeps it; so it is the same wherever
a process begins. Between two keyframes, both chains are mixed in the middle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..core.frames.frame_source import FrameSource
from ..core.model import outlines
from . import carrying, derived, flow, opencv
from .carried_mattes import CONFIDENCE, CarriedMattes, Footage
from .image_writing import write_levels
from .opencv import cv2
from .outlining import traced
from .subject import Network, chosen, covered, found, model_path, roomy

VERSION = 1  # raise it when mattes of the same strokes change
GONE = -1.0  # the confidence of a chain behind a cut

Strokes = Mapping[int, Sequence[Any]]


@dataclass(frozen=True)
class Subject:
    """Strokes on a subject, and on what it is not.

    Attributes:
        strokes, nots: By source frame, arrays of points (n, 2) in fractions of the picture, y up.
        width: Of the strokes, in parts of the picture's height.
    """

    strokes: Strokes = field(hash=False)
    nots: Strokes = field(hash=False)
    width: float

    def __post_init__(self) -> None:
        for name in ("strokes", "nots"):  # as plain tuples, which can be compared
            drawn = {frame: outlines.curves(it) for frame, it in sorted(getattr(self, name).items()) if len(it)}
            object.__setattr__(self, name, drawn)


@dataclass(frozen=True)
class SubjectFile:
    """A core.model.mattes.MatteFile of a subject; see carried_mattes.CarriedFile.

    Attributes:
        model: The file of the network.
    """

    footage: Footage
    subject: Subject
    drawings: tuple[tuple[int, outlines.Curves], ...] = field(default=(), hash=False)
    folder: Path | None = None
    model: Path = model_path()

    def open(self) -> SubjectMattes:
        """MediaError: the footage or the network cannot be read, or OpenCV is missing."""
        opencv.check("subjects are found by", "ximgproc")
        return SubjectMattes(self.footage.open(), self.subject, self.drawings, self.folder, self.model)


class SubjectMattes(CarriedMattes):
    """The mattes of a subject; see CarriedMattes."""

    def __init__(
        self,
        source: FrameSource,
        subject: Subject,
        drawings: tuple[tuple[int, outlines.Curves], ...] = (),
        folder: Path | None = None,
        model: Path | None = None,
    ) -> None:
        super().__init__(source, drawings, folder)
        self._subject, self._model = subject, model or model_path()
        drawn = self._keys
        whole = derived.content_digest(self._model, whole=1 << 40).hex()
        for frame in {*subject.strokes, *subject.nots} - set(drawn):
            if 0 <= frame < self.count:
                made_of = [subject.strokes.get(frame, ()), subject.nots.get(frame, ()), subject.width, whole]
                self._keys[frame] = derived.key({"frame": frame, "strokes": made_of})
        # A frame that has nothing but strokes on what the subject is not depends on the keyframes around it.
        self._real = {frame for frame in self._keys if frame in drawn or frame in subject.strokes}
        for frame in set(self._keys) - self._real:
            around = [self._keys[end] for end in self._around(frame, self._real) if end is not None]
            self._keys[frame] = derived.key({"frame": frame, "without": self._keys[frame], "around": around})
        self._digest = whole

    def read(self, index: int) -> np.ndarray:
        """As CarriedMattes.read. MediaError: the network cannot be read, too."""
        index = min(max(index, 0), self.count - 1)
        sides = self._sides(index, self._made) or []
        mattes = [self._kept(path) for path, _share, _sure in sides]
        shares = [share for _path, share, _sure in sides]
        if not sides or any(matte is None for matte in mattes):
            return self._nothing()
        return mixed([matte / np.float32(255) for matte in mattes if matte is not None], shares)

    def has(self, index: int) -> bool:
        return self._sides(index, self._sure) is not None

    def confidence(self, index: int) -> float | None:
        sides = self._sides(index, self._sure)
        if sides is None:
            return None
        return sum(share * max(sure, 0.0) for _path, share, sure in sides) if sides else 1.0

    def curves(self, index: int) -> outlines.Curves:
        if index in self._drawings:
            return self._drawings[index]
        return traced(self.read(index)) if self.has(index) else outlines.curves(self._straight(index))

    def _sides(self, index: int, get: Any) -> list[tuple[Path, float, float]] | None:
        """Return of which files a matte is mixed, with their shares and confidences; None if `get` has none of one.

        Args:
            get: Gives the confidence of a frame's matte in the chain of a keyframe.
        """
        ends = [end for end in self._near(index) if end is not None]
        if not ends:
            return []
        ends = sorted(dict.fromkeys(ends), key=lambda end: abs(end - index))
        span = sum(abs(end - index) for end in ends)
        sides = []
        for end in ends:
            share = 1 - abs(end - index) / span if len(ends) > 1 else 1.0
            share = min(max(3 * share - 1, 0.0), 1.0)
            if share == 0 and sides[0][2] > GONE:
                break
            if (sure := get(index, end)) is None:
                return None
            sides.append((self._path(index, end, None), share, sure))
        weights = [max(share, 1e-3) * max(sure, 1e-3) * (sure > GONE) for _path, share, sure in sides]
        total = sum(weights) or 1.0
        return [(path, weight / total, sure) for (path, _share, sure), weight in zip(sides, weights, strict=True)]

    def _sure(self, index: int, end: int) -> float | None:
        """Return the confidence of a frame's matte in the chain of a keyframe; None if it is not kept."""
        if (image := derived.opened(self._path(index, end, None), self._spec)) is None:
            return None
        with closing(image):
            said = image.spec().get_string_attribute("ImageDescription")
        try:
            return float(said.removeprefix(CONFIDENCE))
        except ValueError:
            return None

    def _made(self, index: int, end: int) -> float | None:
        """As `_sure`; makes what is missing of the chain."""
        if (sure := self._sure(index, end)) is not None:
            return sure
        with self._claimed(index, end, None) as kept:
            if kept is None:
                way = 1 if index > end else -1
                start = index
                while start != end and self._sure(start, end) is None:
                    start -= way
                if start == end:
                    self._keep(end, end, *self._first(end))
                for frame in range(start, index, way):
                    self._keep(frame + way, end, *self._next(frame, frame + way, end))
        return self._sure(index, end)

    def _keep(self, frame: int, end: int, matte: np.ndarray, sure: float) -> None:
        write_levels(self._path(frame, end, None), matte, f"{CONFIDENCE}{sure:.3f}")

    def _first(self, frame: int) -> tuple[np.ndarray, float]:
        """Return the matte (H, W) uint8 of a keyframe, and its confidence."""
        picture = self._picture(frame)
        if frame in self._drawings:
            return carrying.drawn(picture, self._drawing(frame).cover), 1.0
        small = flow.resized(picture, carrying.working_size(self.width, self.height))
        subject = self._subject
        on = covered(subject.strokes.get(frame, ()), subject.width, small)
        off = covered(subject.nots.get(frame, ()), subject.width, small)
        if frame in self._real:
            share = found(self._network, small, on, off)
            sure = 0.9
            if share is None:
                share, sure = on.astype(np.float32), 0.1
        else:
            share, sure = chosen(self._carried_to(frame), on, off, small), 0.5
        return carrying._levels(carrying.refined(picture, share)), sure

    def _next(self, before: int, frame: int, end: int) -> tuple[np.ndarray, float]:
        """Return the matte (H, W) uint8 of the frame behind one in a chain, and its confidence."""
        sure, matte = self._sure(before, end), self._kept(self._path(before, end, None))
        low, high = sorted((before, frame))
        if sure is None or matte is None or sure == GONE or before not in self._shots.around(frame, low, high):
            return np.zeros((self.height, self.width), np.uint8), GONE
        size = carrying.working_size(self.width, self.height)
        pictures = [self._picture(each) for each in (before, frame)]
        smalls = [flow.resized(each, size) for each in pictures]
        cover = flow.resized(matte, size).astype(np.float32) / 255
        greys = [cv2.cvtColor(each, cv2.COLOR_RGB2GRAY) for each in smalls]
        way = flow.fine_vectors(greys[1], greys[0])
        carried = flow.look(cover, flow.grid(*cover.shape) + way)
        share = carried
        if (carried > 0.5).any():
            answer = self._network.within(smalls[1], roomy(carried, 0.4))
            mine = chosen(answer, carried > 0.5, np.zeros(carried.shape, bool), smalls[1])
            both = np.minimum(mine, carried).sum() / np.maximum(mine, carried).sum()
            sure = float(both)
            if both > 0.6:
                share = 0.3 * carried + 0.7 * mine
        return carrying._levels(carrying.refined(pictures[1], share)), sure

    def _carried_to(self, frame: int) -> np.ndarray:
        """Return the matte (h, w) float32, as wide as working pictures, of a frame without its own strokes."""
        nots = {each: strokes for each, strokes in self._subject.nots.items() if each in self._real}
        drawings, subject = tuple(self._drawings.items()), replace(self._subject, nots=nots)
        without = SubjectMattes(self._source, subject, drawings, self._parent, self._model)
        return flow.resized(without.read(frame), carrying.working_size(self.width, self.height))

    @cached_property
    def _network(self) -> Network:
        return Network(self._model)

    def _near(self, index: int) -> tuple[int | None, int | None]:
        return self._around(index, self._keys)

    @staticmethod
    def _around(index: int, frames: Any) -> tuple[int | None, int | None]:
        """Return the frames before and behind a frame that are nearest; twice its own."""
        return max((f for f in frames if f <= index), default=None), min(
            (f for f in frames if f >= index), default=None
        )

    def _drawn(self, first: int | None, last: int | None) -> list[str]:
        return [*super()._drawn(first, last), f"subject {VERSION}", self._digest]

    def _straight(self, index: int) -> list[np.ndarray]:
        """Strokes that go straight from drawing to drawing, as far as there are any."""
        first, last = self._around(index, self._drawings)
        keys, self._keys = self._keys, {f: self._keys[f] for f in self._drawings}
        try:
            return super()._straight(index) if (first, last) != (None, None) else []
        finally:
            self._keys = keys


def mixed(mattes: list[np.ndarray], shares: list[float]) -> np.ndarray:
    """Return the mean (H, W) of one or two mattes, less soft where they differ."""
    if len(mattes) == 1:
        return mattes[0]
    mean = shares[0] * mattes[0] + shares[1] * mattes[1]
    steep = 1 + 3 * np.abs(mattes[0] - mattes[1])
    return np.clip((mean - 0.5) * steep + 0.5, 0, 1).astype(np.float32)
