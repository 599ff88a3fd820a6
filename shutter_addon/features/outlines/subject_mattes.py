"""The mattes of a subject in all frames of its footage.

A neural network finds the subject under strokes. From there its matte is carried through the frames by the footage's
motion, and corrected by the network again. Outlines that the user draws overrule both. The network is U²-Net (Qin et
al. 2020, "U²-Net: Going deeper with nested U-structure for salient object detection").

Frames with strokes or drawings are keyframes. From each of them a chain of mattes goes forward and backward, as far as
the next keyframe or cut. A matte is made of the footage and the one before it in its chain, and a file keeps it; so it
is the same wherever a process begins. Between two keyframes, both chains are mixed in the middle.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...core import stopping
from ...core.caches import RecentValues
from ...core.frames.frame_source import FrameSource, SourceFile
from ...core.messages import MediaError, of_file
from ...core.model import outlines, scribbles
from ...core.pixels.matte_grid import Box, box_around
from ...media import derived, flow, opencv
from ...media.files import MODEL
from ...media.image_writing import write_levels
from ...media.opencv import cv2
from . import carrying, still_background
from .carried_mattes import CONFIDENCE, CarriedMattes, Drawings, displayed_frame, nearest

MEAN, DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of the colors that such networks are trained with
MULTIPLE, LEAST = 32, 5  # the network halves its picture five times: sides are multiples of that, five at least
QUICK = 0.8  # share of the network's own size that is enough where it is known how the subject looked a frame before
INSIDE = 0.5
# Shares of their size: the room on each side of a subject that the network sees, and of strokes; and pixels at least.
ROOM, TIGHT, CLOSE, LEAST_ROOM = 0.2, 1.0, 1.5, 8
ALONE = 0.95  # share of how sure the network is of more that is enough for a part near the stroke
SURE = 0.9  # how sure the network has to be of what lies near strokes: else it looks at the whole picture
TOUCHED = 0.5  # share of a stroke that a subject has to cover
LARGEST = 0.9  # share of the picture from which on a mask is no subject
SOFT = 3  # pixels of the working picture by which soft edges go beyond the contour of a part
WIDTH = 0.01  # of a stroke, in parts of the picture's height
SHARED = 0.2  # share of a part that the carried matte has to cover
# How far the network has to agree with the carried matte: up to the first it is not believed, from the second on fully.
# And how much of its answer counts then: in the picture as it is, and in one without the background.
BELIEVED, MOST, MOST_CLEARED = (0.5, 0.7), 0.7, 0.9
# Of the confidence: how sure the network is, how far it agrees, from none to full; the pixels of the working picture
# below which a subject is small; and how much it may rise from frame to frame, as what was lost seldom comes back.
UNSURE, UNLIKE, SMALL, RISES = (0.85, 0.95), (0.5, 0.8), 3600, 0.05
CERTAIN = 0.8  # how certain a subject has to be, or else the network looks again
# By how many pixels of the working picture a place moves rather with the ground than with the subject, and how far its
# colors may differ from before, in units of CIE Lab.
WITH, SAME = 0.25, 8.0
REST = 1.25  # how much more a pixel may differ from its place before than from where flow leads, to count as at rest
_INPUT = re.compile(r"// <Input> CV_32FC1 \[1 x 3 x (\d+) x (\d+)\]")  # of OpenCV's description


@dataclass(frozen=True)
class Found:
    """A subject that was found in a working picture of h × w pixels.

    Attributes:
        share: How sure it is that each pixel belongs to the subject, (h, w) float32, 0 to 1.
        excluded: How far strokes have marked each pixel as not belonging to the subject, (h, w) float32, 0 to 1.
        confidence: How sure the find as a whole is, 0 to 1.
    """

    share: np.ndarray
    excluded: np.ndarray
    confidence: float


class Network:
    """A neural network that takes one picture and gives one mask. One thread at a time may use it."""

    def __init__(self, path: Path) -> None:
        """Read a network from an ONNX file.

        Raises:
            MediaError: The file is missing or damaged, or its network takes no RGB picture of a fixed size.
        """
        self._name = path.name
        try:
            self._net = cv2.dnn.readNetFromONNX(np.fromfile(path, np.uint8))
            sizes = _INPUT.findall(self._net.dump())
        except OSError as error:
            raise MediaError(of_file(error)) from None
        except cv2.error:
            raise MediaError(f"{path.name}: is damaged, or no ONNX model that OpenCV can run") from None
        if not sizes:
            raise self._foreign()
        self._height, self._width = map(int, sizes[0])

    def answer(self, picture: np.ndarray, share: float = 1.0) -> np.ndarray:
        """Return how sure the network is that each pixel belongs to the picture's subject, (h, w) float32.

        Answers are scaled so that the least is 0 and the largest 1, even in a picture without a subject.

        Args:
            picture: The picture, (h, w, 3) uint8.
            share: The size to which the picture is scaled for the network, as a fraction of the network's usual size. A
                smaller one is quicker, and gives a coarser answer.

        Raises:
            MediaError: The network does not take one picture and return one mask.
        """
        stopping.check()
        height, width = picture.shape[:2]
        # As wide or high as the picture is.
        sides = zip((width, height), (self._width, self._height), strict=True)
        size = [max(round(share * own * side / max(height, width) / MULTIPLE), LEAST) * MULTIPLE for side, own in sides]
        small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        values = (small / max(float(small.max()), 1.0) - np.array(MEAN, np.float32)) / np.array(DEVIATION, np.float32)
        try:
            self._net.setInput(np.ascontiguousarray(values.transpose(2, 0, 1)[None]))
            mask = self._net.forward(self._net.getUnconnectedOutLayersNames()[0])
        except cv2.error:
            raise self._foreign() from None
        if mask.size != mask.shape[-1] * mask.shape[-2] or not np.isfinite(mask).all():
            raise self._foreign()
        mask = mask.reshape(mask.shape[-2:])
        mask = (mask - mask.min()) / max(float(np.ptp(mask)), 1e-6)
        return np.clip(cv2.resize(mask, picture.shape[1::-1], interpolation=cv2.INTER_LINEAR), 0, 1)

    def within(self, picture: np.ndarray, box: Box, share: float = 1.0) -> np.ndarray:
        """Return the network's answer for the part of a picture inside a box; 0 outside. Arguments as in `answer`."""
        found = np.zeros(picture.shape[:2], np.float32)
        found[box] = self.answer(np.ascontiguousarray(picture[box]), share)
        return found

    def _foreign(self) -> MediaError:
        return MediaError(f"{self._name}: is no model with one picture in and one mask out")


def refined(picture: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Make a matte of a subject, and fit it to the edges and colors of the picture in full size.

    Args:
        picture: The frame, (H, W, 3) uint8.
        share: How sure it is that each pixel of the working picture belongs to the subject, (h, w), 0 to 1.

    Returns:
        The matte, (H, W) float32, 0 to 1.
    """
    # Votes have less of what is thin than answers of the network have.
    return carrying.refined(picture, np.maximum(share - np.float32(INSIDE - carrying.INSIDE), 0))


def covered(strokes: Sequence[Any], picture: np.ndarray) -> np.ndarray:
    """Return which pixels of a picture are covered by strokes of the width WIDTH, (h, w) bool.

    Args:
        strokes: The points of each stroke, (n, 2), in fractions of the picture.
        picture: The picture, (h, w, 3), of which only the size counts.
    """
    points = tuple(np.asarray(stroke, np.float64) for stroke in strokes)
    height, breadth = picture.shape[:2]
    return scribbles.rasterise([scribbles.Shape(0, "line", WIDTH, points)], breadth, height) > 0


def found(network: Network, picture: np.ndarray, on: np.ndarray, off: np.ndarray) -> Found | None:
    """Find the subject under strokes with the network.

    It looks around the strokes first (CLOSE) and, if that is unsure, also nearer to them (TIGHT) and in the whole
    picture.

    Args:
        picture: The working picture, (h, w, 3) uint8.
        on: The pixels that strokes on the subject cover, (h, w) bool.
        off: The pixels that strokes on what does not belong to it cover, (h, w) bool. They are removed from the
            subject.

    Returns:
        The subject. None: the network finds none, or `on` is empty.
    """
    if not on.any():
        return None
    box = around(on, CLOSE)
    share = _parts_on(network.within(picture, box), on)
    if (sure := _sure(share, on, box)) < SURE:  # the subject is larger than it seemed or smaller, or there is none
        whole = slice(0, on.shape[0]), slice(0, on.shape[1])
        # What is alone near the stroke is rather the subject than more that is with it.
        for other, least in ((around(on, TIGHT), ALONE), (whole, 1)):
            seen = _parts_on(network.within(picture, other, QUICK), on)
            if (surer := _sure(seen, on, other)) > least * sure:
                near = around(seen > INSIDE, ROOM)
                seen = _parts_on(network.within(picture, near), on)
                if (surer := min(surer, _sure(seen, on, near))) > least * sure:
                    share, sure = seen, surer
    if sure <= 0:
        return None
    return without(Found(share, np.zeros_like(share), _confidence(share, sure)), picture, on, off)


def _sure(share: np.ndarray, on: np.ndarray, box: Box) -> float:
    """Return how sure the network is of the subject that it found under strokes, 0 to 1.

    This is 0 if the subject covers less than TOUCHED of the strokes, or more than LARGEST of the picture. It is less if
    an edge of the box cuts the subject off, which is then larger than what the network could see.

    Args:
        share: The network's answer for the whole picture, (h, w), 0 outside the box.
        on: The pixels that the strokes cover, (h, w) bool.
        box: The rows and columns of the picture that the network saw.
    """
    inside = share > INSIDE
    if inside[on].mean() < TOUCHED or inside.mean() > LARGEST:
        return 0.0
    part, (rows, columns) = inside[box], box
    ends = (rows.start > 0, part[0]), (rows.stop < len(share), part[-1])
    sides = (columns.start > 0, part[:, 0]), (columns.stop < share.shape[1], part[:, -1])
    cut = sum(int(edge.sum()) for is_cut, edge in (*ends, *sides) if is_cut)
    return max(float(share[inside].mean()) - cut / sum(part.shape), 0.0)


def _confidence(share: np.ndarray, sure: float, agrees: float = 1.0) -> float:
    """Return a subject's confidence, 0 to 1: less if the network is unsure, motion disagrees, or the subject is small.

    Args:
        share: How sure it is that each pixel belongs to the subject, (h, w), 0 to 1.
        sure: How sure the network is, 0 to 1.
        agrees: How far the network's answer overlaps with the subject as motion carried it from the frame before, 0 to
            1.
    """
    size = np.count_nonzero(share > INSIDE) / SMALL
    return _certain(sure, agrees) * min(size, 1.0) ** 0.5


def _certain(sure: float, agrees: float) -> float:
    """Return how certain a subject is, 0 to 1: how sure the network is, and how far it agrees with motion."""
    return _from(sure, UNSURE) * _from(agrees, UNLIKE)


def _from(value: float, ends: tuple[float, float]) -> float:
    """Return how far a value is on the way from the first of `ends` to the second, 0 to 1."""
    return min(max((value - ends[0]) / (ends[1] - ends[0]), 0.0), 1.0)


def without(subject: Found, picture: np.ndarray, on: np.ndarray, off: np.ndarray) -> Found:
    """Remove from a subject what strokes mark as not belonging to it, and return the rest.

    This concerns the connected parts of the subject that the strokes `off` touch. They are removed as a whole if they
    are at most half of the subject and no stroke of `on` touches them. Otherwise they are divided along the picture's
    edges, and the side of `off` is removed. If no part is touched, the subject is returned as it is.

    Args:
        picture: The working picture, (h, w, 3) uint8.
        on: The pixels that strokes on the subject cover, (h, w) bool. If none lies in the touched parts, pixels there
            that are far from `off` stand for it when the parts are divided.
        off: The pixels that strokes on what does not belong to the subject cover, (h, w) bool.

    Returns:
        The rest of the subject. What was removed is added to its `excluded`.
    """
    inside = subject.share > INSIDE
    _, parts = cv2.connectedComponents(inside.astype(np.uint8))
    touched = np.isin(parts, np.setdiff1d(parts[off & inside], [0]))
    if not touched.any():
        return subject
    gone = touched
    if (touched & on).any() or 2 * touched.sum() > inside.sum():
        away = cv2.distanceTransform((~off).astype(np.uint8), cv2.DIST_L2, 3)
        markers = np.where(touched, 0, 3).astype(np.int32)
        markers[on if (touched & on).any() else touched & (away > away[touched].max() / 2)] = 1
        markers[off] = 2
        gone = touched & (cv2.watershed(picture, markers) != 1)
    excluded = _near(gone | off) & ~(inside & ~gone)
    share = np.where(excluded, np.float32(0), subject.share)
    return Found(share, np.maximum(subject.excluded, excluded), subject.confidence)


def _near(where: np.ndarray) -> np.ndarray:
    """Widen an area (h, w) bool by SOFT pixels on all sides."""
    return cv2.dilate(where.astype(np.uint8), np.ones((2 * SOFT + 1,) * 2, np.uint8)) > 0


def _parts_on(answer: np.ndarray, on: np.ndarray) -> np.ndarray:
    """Return a network's answer (h, w) with only the connected parts that strokes touch; 0 elsewhere.

    Args:
        answer: How sure the network is of each pixel, (h, w), 0 to 1. A part is made of pixels above INSIDE, and keeps
            its soft edge.
        on: The pixels that the strokes cover, (h, w) bool.
    """
    _, parts = cv2.connectedComponents((answer > INSIDE).astype(np.uint8))
    return _alone(answer, np.isin(parts, np.setdiff1d(parts[on], [0])))


def _alone(answer: np.ndarray, keep: np.ndarray) -> np.ndarray:
    """Return a network's answer (h, w) with only the pixels in `keep` (h, w) bool and the soft edges around them."""
    return np.where(keep | (_near(keep) & (answer <= INSIDE)), answer, np.float32(0))


def followed(
    network: Network,
    before: np.ndarray,
    picture: np.ndarray,
    subject: Found,
    behind: Callable[[], np.ndarray | None],
) -> tuple[Found, np.ndarray]:
    """Follow a subject to the next frame: carry it there by optical flow, and correct it by the network.

    If the network is unsure or disagrees with motion, and the camera stands still, the network looks once more, at a
    picture without the background. That answer counts if the network is surer, or agrees more.

    Args:
        before: Working picture of the frame where the subject is known, (h, w, 3) uint8.
        picture: Working picture of the next frame (earlier in time if a chain goes backward), (h, w, 3) uint8.
        subject: The subject in the frame `before`.
        behind: Returns the background of the next frame, (h, w, 3) uint8, or None (StillBackground.behind). It is
            called only before a second look.

    Returns:
        The subject in the next frame. Its confidence is 0 if nothing of it is left in the picture.
        Which share of the matte of `before` to mix into the next frame's matte at each pixel, (h, w), 0 to
        carrying.QUIET, so that mattes do not flicker (carrying.stillness).
    """
    greys = [cv2.cvtColor(each, cv2.COLOR_RGB2GRAY) for each in (before, picture)]
    back = flow.fine_vectors(greys[1], greys[0])
    places = flow.grid(*subject.share.shape) + back
    carried, excluded = (flow.look(each, places) for each in (subject.share, subject.excluded))
    if not (carried > INSIDE).any():
        return Found(carried, excluded, 0.0), np.zeros_like(carried)
    colors, old = carrying.lab(picture), carrying.lab(before)
    differ, rest = (carrying.apart(colors, each) for each in (old, np.stack([flow.look(p, places) for p in old])))
    passes = _passing(places, carried, rest)
    answer, agrees, sure = _looked(network, picture, carried, excluded, passes)
    trust = MOST * _from(agrees, BELIEVED)
    looks_again = _certain(sure, agrees) < CERTAIN and still_background.same_view(before, picture)
    if looks_again and (background := behind()) is not None:
        clear = still_background.cleared(picture, background, subject.share, carried, colors, old, places)
        if clear is not None and (clear[1] > INSIDE).any():
            cleared, left, others = clear
            passes_now = np.maximum(passes, others)
            again, fits, surer = _looked(network, cleared, left, excluded, passes_now)
            # Against all of the subject, as what looks like the background may still belong to it.
            overlap = _overlap(again, carried)
            if fits > BELIEVED[0] and overlap * surer > agrees * sure:
                answer, agrees, sure, carried, passes = again, overlap, surer, left, passes_now
                trust = MOST_CLEARED * _from(fits, BELIEVED)
    # What passes does not stay a part either, if the network sees none there.
    share = carried + np.maximum(np.float32(trust), passes * (answer < carried)) * (answer - carried)
    moved = np.hypot(back[..., 0], back[..., 1])
    moved[differ <= REST * rest] = 0  # without structure, noise alone makes flow
    still = carrying.stillness(moved, colors, old)
    confidence = min(_confidence(share, sure, agrees), subject.confidence + RISES)
    return Found(share, excluded, confidence), still


def _looked(
    network: Network, picture: np.ndarray, carried: np.ndarray, excluded: np.ndarray, passes: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Let the network look where motion has carried a subject, and choose what belongs to it.

    Args:
        picture: What the network sees, a working picture (h, w, 3) uint8.
        carried: The subject's share of each pixel, as motion has carried it here from the frame before, (h, w), 0 to 1,
            above INSIDE somewhere.
        excluded: What strokes have marked as not belonging to it, (h, w), 0 to 1.
        passes: How sure it is that each pixel shows something else that passes, (h, w), 0 to 1.

    Returns:
        The network's answer, (h, w), 0 to 1, with only the parts that `carried` shares; how far the two overlap, 0 to
        1; and how sure the network is, 0 to 1.
    """
    answer = network.within(picture, around(carried > INSIDE, ROOM), QUICK) * (1 - excluded)
    # What passes does not become a part of the subject, except where its edge may lie a pixel off.
    answer -= passes * np.maximum(answer - cv2.dilate(carried, np.ones((3, 3), np.uint8)), 0)
    _, parts = cv2.connectedComponents((answer > INSIDE).astype(np.uint8))
    sizes = np.bincount(parts.ravel())
    keep = np.bincount(parts.ravel(), weights=(carried > INSIDE).ravel()) >= SHARED * sizes
    keep[0] = False
    answer = _alone(answer, keep[parts])
    return answer, _overlap(answer, carried), float(answer[answer > INSIDE].mean()) if (answer > INSIDE).any() else 0.0


def _overlap(one: np.ndarray, other: np.ndarray) -> float:
    """Return how far two areas (h, w), 0 to 1, overlap: their intersection over their union, 0 to 1."""
    return float(np.minimum(one, other).sum() / max(np.maximum(one, other).sum(), 1e-6))


def _passing(places: carrying.Places, carried: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Return how sure it is that each pixel moves with the background and not with the subject, (h, w), 0 to 1.

    Things that pass the subject are recognized by this, so that they do not become a part of it. If too little of the
    background or of the subject is visible to tell its motion, all values are 0.

    Args:
        places: For each pixel, its place in the frame before, (h, w, 2), x and y in pixels.
        carried: The subject's share at each pixel, (h, w), as motion has carried it here from the frame before.
        rest: How much the colors around each pixel differ from those around its place in the frame before, (h, w), in
            units of CIE Lab.
    """
    fits = [carrying.affine(places, it) for it in (carried < INSIDE, carried >= INSIDE)]
    if fits[0] is places:  # too little of the ground is seen
        return np.zeros_like(carried)
    ground, own = (np.hypot(*np.moveaxis(places - fit, 2, 0)) for fit in fits)
    return np.clip((own - ground) / WITH - 0.5, 0, 1) * np.exp(-np.square(rest / np.float32(SAME)))


def around(where: np.ndarray, room: float) -> Box:
    """Return the box (rows and columns) around an area, with room on each side, but within the picture.

    Args:
        where: The area, (h, w) bool, with at least one pixel.
        room: The room as a fraction of the longer side of the area's box. It is at least LEAST_ROOM pixels.
    """
    area = where.astype(np.float32)
    tight = box_around(area, reach=0)
    assert tight is not None
    reach = max(round(room * max(part.stop - part.start for part in tight)), LEAST_ROOM)
    return box_around(area, reach) or tight


VERSION = 4  # raise it when mattes of the same strokes change
EXCLUDED = 1  # the level of what strokes say that the subject is not
MIDDLE = 3.0  # the part of a span between two keyframes in which both of their chains count is a third
STEEPER = 3.0
_LEAST = 1e-3
GONE = -1.0  # the confidence of a chain behind a cut

Strokes = Mapping[int, Sequence[Any]]


@dataclass(frozen=True)
class MarkedSubject:
    """The user's strokes that tell what belongs to a subject and what does not.

    Both attributes are made from sequences of arrays (n, 2), in fractions of the picture, which are converted to
    outlines.Curves. Frames without strokes are dropped.

    Attributes:
        strokes: Strokes on the subject, by frame of the footage.
        nots: Strokes on what does not belong to it, by frame of the footage.
    """

    strokes: Strokes = field(hash=False)
    nots: Strokes = field(hash=False)

    def __post_init__(self) -> None:
        for name in ("strokes", "nots"):  # as plain tuples, which can be compared
            drawn = {frame: outlines.curves(it) for frame, it in sorted(getattr(self, name).items()) if len(it)}
            object.__setattr__(self, name, drawn)


@dataclass(frozen=True)
class CarriedFile:
    """Everything that the mattes of a tracked outline or a subject are made from, as plain data.

    Attributes:
        footage: The footage, not opened yet.
        drawings: Pairs of a frame of the footage and the curves drawn there (core.model.outlines), frames ascending.
        folder: Where mattes are kept. If it is None or cannot be written to, they are in a temporary folder, which is
            removed when this program ends.
        subject: The strokes of a subject; None: it is an outline.
        model: The file of the network that finds subjects. It is used only for a subject.
    """

    footage: SourceFile
    # Each frame of a window asks for the hash; drawings may have thousands of points.
    drawings: Drawings = field(hash=False)
    folder: Path | None = None
    subject: MarkedSubject | None = None
    model: Path = MODEL

    def open(self) -> CarriedMattes:
        """Open the footage, and return the source that makes and reads the mattes.

        Raises:
            MediaError: The footage or the network cannot be read, or OpenCV is missing.
        """
        opencv.check("subjects are found by" if self.subject else "outlines are tracked by", "ximgproc")
        if self.subject is None:
            return CarriedMattes(self.footage.open(), self.drawings, self.folder)
        return SubjectMattes(self.footage.open(), self.drawings, self.folder, self.subject, self.model)


class SubjectMattes(CarriedMattes):
    """The mattes of a subject, one for each frame of the footage, made when they are first read (CarriedMattes)."""

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
        self._recent: RecentValues[Path, np.ndarray] = RecentValues()  # mattes that were read or written, (H, W) uint8

    def read(self, index: int) -> np.ndarray:
        """Return a frame's matte, (height, width) float32, 0 to 1. Without any keyframes, it is empty.

        If no file keeps the matte yet, this makes it and the missing ones on the way to it from its keyframe, which is
        a frame with strokes or a drawing. Between two keyframes where both count, it does so from each.

        Args:
            index: The frame of the footage, from 0. Beyond the ends, the first or last frame counts.

        Raises:
            MediaError: A frame or the network cannot be read, or the folder cannot be written to.
        """
        index = min(max(index, 0), self.count - 1)
        sides = self._sides(index, makes=True) or []
        mattes = [(self._levels(path), share) for path, share, _sure in sides]
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
        """Return the files from which a frame's matte is mixed, one for the chain of each keyframe next to it.

        Near a keyframe, only its chain counts. In the middle third between two keyframes, both chains do. The result is
        empty if there are no keyframes.

        Args:
            index: The frame of the footage.
            makes: Whether to make missing and damaged files.

        Returns:
            For each chain, that of the nearer keyframe first: the file; its share of the matte (shares add up to 1, or
            are all 0 if no chain shows the subject); and its confidence, 0 to 1, or GONE if a cut lies between keyframe
            and frame. None: a file is missing.
        """
        ends = sorted({end for end in self._near(index) if end is not None}, key=lambda end: abs(end - index))
        span = sum(abs(end - index) for end in ends)
        sides: list[tuple[Path, float, float]] = []
        for end in ends:
            share = min(max(MIDDLE * (0.5 - abs(end - index) / span) + 0.5, 0.0), 1.0) if len(ends) > 1 else 1.0
            if share == 0 and sides[0][2] != GONE:
                break  # the nearest keyframe alone counts
            if makes and self._known(index, end) is None:
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
        """Return the confidence of a frame's matte in the chain from keyframe `end`, or GONE; None: no file has it."""
        return self._described(self._path(index, end, None))

    def _make(self, index: int, end: int) -> None:
        """Make and write a chain's mattes up to a frame, from its keyframe `end` or the last that a file keeps."""
        step = 1 if index > end else -1
        if (most := self._sure(end, end)) is None:
            _, most = self._write(end, end, *self._first(end))
        start, known = index, self._known(index, end)
        while known is None and start != end:
            start -= step
            known = self._known(start, end)
        known = known or self._write(end, end, *self._first(end))
        for frame in range(start, index, step):
            stopping.check()
            known = self._write(frame + step, end, *self._next(known, frame, frame + step, most))
        self._shots.release()

    def _known(self, frame: int, end: int) -> tuple[np.ndarray, float] | None:
        """Return a chain's matte (H, W) uint8 and its confidence; None: its file is missing or damaged."""
        path = self._path(frame, end, None)
        if (sure := self._described(path)) is None or (matte := self._levels(path)) is None:
            return None
        return matte, sure

    def _levels(self, path: Path) -> np.ndarray | None:
        """Return the matte (H, W) uint8 in a file; None: it is missing or damaged."""
        if (matte := self._recent.get(path)) is None and (matte := self._kept(path)) is not None:
            self._recent.keep(path, matte, 2)
        return matte

    def _write(
        self, frame: int, end: int, matte: np.ndarray, excluded: np.ndarray, sure: float
    ) -> tuple[np.ndarray, float]:
        """Write a chain's matte to a file, and return it (H, W) uint8 with its confidence as the file keeps them."""
        levels = flow.levels(matte)
        levels[levels == EXCLUDED] = EXCLUDED + 1
        if excluded.any():
            levels[(levels < EXCLUDED) & (_fitted(excluded, levels) > 0.5)] = EXCLUDED
        path = self._path(frame, end, None)
        write_levels(path, levels, f"{CONFIDENCE}{sure:.3f}")
        return self._recent.keep(path, levels, 2), round(float(sure), 3)

    def _first(self, frame: int) -> tuple[np.ndarray, np.ndarray, float]:
        """Make the matte of a keyframe (with strokes or a drawing), at which a chain of mattes begins.

        A drawing is fitted to the picture's edges, and has confidence 1. Under strokes, the network looks for the
        subject; if it finds none, the strokes themselves become the matte, with confidence 0. In a frame that has only
        strokes on what the subject is not, these are removed from the matte that other keyframes give.

        Returns:
            The matte, (H, W) float32, 0 to 1; what strokes exclude from it, (h, w) float32 in the working picture, 0 to
            1; and the confidence, 0 to 1.
        """
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

    def _next(
        self, known: tuple[np.ndarray, float], before: int, frame: int, most: float
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Make the matte of the next frame in a chain from the one of the frame before.

        Args:
            known: The matte of the frame before, (H, W) uint8, and its confidence.
            before: The frame before.
            frame: The next frame of the chain, one later or earlier in time.
            most: The confidence at the keyframe where the chain begins, 0 to 1. A chain is no surer of what it follows.

        Returns:
            The matte, (H, W) float32, 0 to 1; what strokes exclude from it, carried along, (h, w) float32 in the
            working picture, 0 to 1; and the confidence, 0 to 1. If a cut lies in between or earlier in the chain,
            the matte is empty, nothing is excluded, and the confidence is GONE.
        """
        matte, sure = known
        low, high = sorted((before, frame))
        if sure == GONE or before not in self._shots.around(frame, low, high):
            return self._nothing(), self._nothing(), GONE
        (_, old), (picture, small) = (self._pictures(each) for each in (before, frame))
        size = small.shape[1::-1]
        hidden = matte == EXCLUDED
        excluded = np.zeros(small.shape[:2], np.float32)
        if hidden.any():
            excluded = flow.resized(hidden.astype(np.float32), size)
        share = flow.resized(matte, size).astype(np.float32) / 255
        found_before = Found(share, excluded, sure)
        what, still = followed(self._network, old, small, found_before, lambda: self._background.behind(frame, small))
        found_there = refined(picture, what.share)
        found_there += _fitted(still, matte) * (matte / np.float32(255) - found_there)
        return found_there, what.excluded, min(what.confidence, most)

    def _pictures(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Return a frame as displayed, (H, W, 3) uint8, and reduced as working picture (h, w, 3)."""
        if self._before is None or self._before[0] != frame:
            picture = self._picture(frame)
            self._before = frame, picture, flow.resized(picture, carrying.working_size(self.width, self.height))
        return self._before[1:]

    def _carried_to(self, frame: int) -> Found:
        """Return the subject in a frame with only strokes on what it is not, as if there were no such frames."""
        nots = {each: strokes for each, strokes in self._subject.nots.items() if each in self._showing}
        drawings, subject = tuple(self._drawings.items()), replace(self._subject, nots=nots)
        mattes = SubjectMattes(self._source, drawings, self._parent, subject, self._model)
        share = flow.resized(mattes.read(frame), carrying.working_size(self.width, self.height))
        return Found(share, np.zeros_like(share), mattes.confidence(frame) or 0.0)

    @cached_property
    def _background(self) -> still_background.StillBackground:
        shots, size = self._shots, carrying.working_size(self.width, self.height)
        # Without `self`, as a cycle would keep frames in memory.
        return still_background.StillBackground(
            lambda frame: flow.resized(displayed_frame(shots, frame), size), self.count
        )

    @cached_property
    def _network(self) -> Network:
        return Network(self._model)

    def _near(self, index: int) -> tuple[int | None, int | None]:
        return nearest(index, self._keys)

    def _drawn(self, first: int | None, last: int | None) -> list[str]:
        return [*super()._drawn(first, last), f"subject {VERSION}", self._digest]


def mixed(mattes: list[tuple[np.ndarray, float]]) -> np.ndarray:
    """Mix one or two mattes by a weighted mean, (H, W), 0 to 1.

    Where the two differ, contrast around one half is raised, so that their mean does not look half transparent.

    Args:
        mattes: Each matte, (H, W), 0 to 1, with its weight. Weights add up to 1, or are all 0, for an empty result.
    """
    if len(mattes) == 1:
        return mattes[0][0] * np.float32(mattes[0][1] > 0)
    (one, share), (other, rest) = mattes
    mean = np.float32(share) * one + np.float32(rest) * other
    steep = 1 + STEEPER * np.abs(one - other)
    return np.clip((mean - 0.5) * steep + 0.5, 0, 1) if share + rest else mean


def _fitted(values: np.ndarray, matte: np.ndarray) -> np.ndarray:
    """Return values (h, w) enlarged to the size of a matte (H, W)."""
    return cv2.resize(values, matte.shape[::-1])
