"""A small neural network that finds the subject of a picture (U²-Net: Qin et al. 2020, "U²-Net: Going deeper with
nested U-structure for salient object detection")."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core import stopping
from ..core.model import scribbles
from . import carrying, derived, flow, opencv
from .errors import MediaError
from .opencv import cv2

MODEL = Path(__file__).resolve().parents[2] / "models" / "u2netp.onnx"
MEAN, DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of the colors that such networks are trained with
MULTIPLE, LEAST = 32, 5  # the network halves its picture five times: sides are multiples of that, five at least
QUICK = 0.8  # share of the network's own size that is enough where it is known how the subject looked a frame before
INSIDE = 0.5
ROOM = 0.4  # share of its size by which the box around a subject is enlarged
TOUCHED = 0.5  # share of a stroke that a subject has to cover
LARGEST = 0.9  # share of the picture from which on a mask is no subject
SOFT = 3  # pixels of the working picture by which soft edges go beyond the contour of a part
WIDTH = 0.01  # of a stroke, in parts of the picture's height
SHARED = 0.2  # share of a part that the carried matte has to cover
# How far the network and the carried matte agree: below that the network is not believed, and above it is.
DOUBTED, BELIEVED, MOST = 0.5, 0.7, 0.7
ASTRAY = 1.0  # pixels of the working picture by which flow there and back may miss
_INPUT = re.compile(r"// <Input> CV_32FC1 \[1 x 3 x (\d+) x (\d+)\]")  # of OpenCV's description

Box = tuple[slice, slice]  # rows and columns


@dataclass(frozen=True)
class Found:
    """A subject in a picture.

    Attributes:
        share: (h, w) float32, 0 to 1, how sure a pixel belongs to it.
        excluded: (h, w) float32, 0 to 1, what strokes have said that does not.
        confidence: 0 to 1.
    """

    share: np.ndarray
    excluded: np.ndarray
    confidence: float


def model_path(preference: str = "") -> Path:
    """Return the file of the network: that of the preference, or the one that Virtual Shutter brings."""
    return Path(preference).expanduser() if preference else MODEL


def digest(path: Path) -> str:
    """Return what tells the file of a network from others. MediaError: it cannot be read."""
    try:
        return derived.content_digest(path, whole=1 << 40).hex()
    except MediaError:
        raise MediaError(f"{path}: the model that finds subjects cannot be read") from None


class Network:
    """A network with one picture in and one mask out. One thread at a time may use it."""

    def __init__(self, path: Path) -> None:
        """Read a network from an ONNX file.

        Raises:
            MediaError: The file is missing, damaged, or another kind of network, or OpenCV is missing.
        """
        opencv.check("subjects are found by", "ximgproc")
        self._name = path.name
        try:
            content = path.read_bytes()
        except OSError:
            raise MediaError(f"{path}: the model that finds subjects cannot be read") from None
        try:
            self._net = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
            sizes = _INPUT.findall(self._net.dump())
        except cv2.error:
            raise MediaError(f"{path.name}: is damaged, or no ONNX model that OpenCV can run") from None
        if not sizes:
            raise self._foreign()
        self._height, self._width = map(int, sizes[0])

    def answer(self, picture: np.ndarray, share: float = 1.0) -> np.ndarray:
        """Return how sure the network is (h, w) float32, 0 to 1, that a pixel of a picture (h, w, 3) uint8 belongs to
        the subject.

        Args:
            share: Of the sides of the picture that the network looks at; the smaller, the quicker and coarser.

        Raises:
            MediaError: The network is of another kind.
        """
        stopping.check()
        size = self._size(picture, share)
        small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        values = (small / max(float(small.max()), 1.0) - np.float32(MEAN)) / np.float32(DEVIATION)
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

    def _size(self, picture: np.ndarray, share: float) -> tuple[int, int]:
        """Return the width and height of what the network looks at, as wide or high as the picture is."""
        height, width = picture.shape[:2]
        longest = max(height, width)
        sides = zip((width, height), (self._width, self._height), strict=True)
        w, h = (max(round(share * own * side / longest / MULTIPLE), LEAST) * MULTIPLE for side, own in sides)
        return w, h

    def within(self, picture: np.ndarray, box: Box, share: float = 1.0) -> np.ndarray:
        """Return its answer on a part of a picture; nothing elsewhere."""
        found = np.zeros(picture.shape[:2], np.float32)
        found[box] = self.answer(np.ascontiguousarray(picture[box]), share)
        return found

    def _foreign(self) -> MediaError:
        return MediaError(f"{self._name}: is no model with one picture in and one mask out")


def found_under(network: Network, frame_rgba: np.ndarray, stroke: np.ndarray) -> np.ndarray | None:
    """Return the matte (H, W) float32, 0 to 1, of the subject that lies under a stroke; None if there is none.

    Args:
        frame_rgba: (H, W, 3 or 4) uint8, as it is displayed.
        stroke: (n, 2) in fractions of the picture, y up.

    Raises:
        MediaError: The network is of another kind.
    """
    picture = np.ascontiguousarray(frame_rgba[..., :3])
    small = flow.resized(picture, carrying.working_size(*picture.shape[1::-1]))
    subject = found(network, small, covered([stroke], WIDTH, small), np.zeros(small.shape[:2], bool))
    return None if subject is None else refined(picture, subject.share)


def refined(picture: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Return the matte (H, W) float32 of a picture (H, W, 3) uint8, from how sure (h, w) its pixels are inside."""
    # Votes have less of what is thin than answers of the network have.
    return carrying.refined(picture, np.maximum(share - np.float32(INSIDE - carrying.INSIDE), 0))


def covered(strokes: Sequence[Any], width: float, picture: np.ndarray) -> np.ndarray:
    """Return which pixels (h, w) bool of a picture strokes cover.

    Args:
        width: Of the strokes, in parts of the picture's height.
    """
    points = tuple(np.asarray(stroke, np.float64) for stroke in strokes)
    height, breadth = picture.shape[:2]
    return scribbles.rasterise([scribbles.Shape(0, "line", width, points)], breadth, height) > 0


def found(network: Network, picture: np.ndarray, on: np.ndarray, off: np.ndarray) -> Found | None:
    """Return the subject under strokes; None if there is none.

    Args:
        picture: (h, w, 3) uint8.
        on, off: (h, w) bool, what strokes on the subject cover, and strokes on what it is not.
    """
    whole = _parts_on(network.answer(picture, QUICK), on)
    start = whole if _fits(whole, on) else on.astype(np.float32)
    near = _parts_on(network.within(picture, roomy(start)), on)
    if not _fits(near, on):
        if not _fits(whole, on):
            return None
        near = whole
    return without(Found(near, np.zeros_like(near), _agreed(near, whole)), picture, on, off)


def _fits(share: np.ndarray, on: np.ndarray) -> bool:
    inside = share > INSIDE
    return bool(inside[on].mean() >= TOUCHED and inside.mean() < LARGEST)


def without(subject: Found, picture: np.ndarray, on: np.ndarray, off: np.ndarray) -> Found:
    """Return a subject without what strokes say that it is not: all of a part that is smaller than the rest, or what
    lies on their side of the edges between them and the strokes on the subject.

    Args:
        on, off: See `found`; where no stroke is on the subject, what is far from the others is.
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
    """Return what lies in an area (h, w), or beside it."""
    return cv2.dilate(where.astype(np.uint8), np.ones((2 * SOFT + 1,) * 2, np.uint8)) > 0


def _parts_on(answer: np.ndarray, on: np.ndarray) -> np.ndarray:
    """Return the parts of an answer that lie under strokes."""
    _, parts = cv2.connectedComponents((answer > INSIDE).astype(np.uint8))
    return _alone(answer, np.isin(parts, np.setdiff1d(parts[on], [0])))


def _alone(answer: np.ndarray, keep: np.ndarray) -> np.ndarray:
    """Return an answer (h, w) with some of its parts alone, (h, w) bool, and their soft edges."""
    return np.where(keep | (_near(keep) & (answer <= INSIDE)), answer, np.float32(0))


def _agreed(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.minimum(one, other).sum() / max(np.maximum(one, other).sum(), 1e-6))


def followed(
    network: Network, before: np.ndarray, picture: np.ndarray, subject: Found
) -> tuple[Found, np.ndarray | float]:
    """Return a subject in the frame behind one, carried there by motion and corrected by the network; and the share
    (h, w) of the matte before that it keeps.

    Args:
        before, picture: (h, w, 3) uint8, the one frame, and the frame behind it.
        subject: What it is in the one.
    """
    greys = [cv2.cvtColor(each, cv2.COLOR_RGB2GRAY) for each in (before, picture)]
    grid = flow.grid(*subject.share.shape)
    back = flow.fine_vectors(greys[1], greys[0])
    carried, excluded = (flow.look(each, grid + back) for each in (subject.share, subject.excluded))
    if not (carried > INSIDE).any():
        return Found(carried, excluded, 0.0), 0.0
    answer = network.within(picture, roomy(carried), QUICK) * (1 - excluded)
    _, parts = cv2.connectedComponents((answer > INSIDE).astype(np.uint8))
    sizes = np.bincount(parts.ravel())
    keep = np.bincount(parts.ravel(), weights=(carried > INSIDE).ravel()) >= SHARED * sizes
    keep[0] = False
    others = sizes[1:][~keep[1:]].sum()
    answer = _alone(answer, keep[parts])
    agrees = _agreed(answer, carried)
    LOG.append((agrees, others / max((answer > INSIDE).sum(), 1), (carried > INSIDE).sum(), carried.max()))
    trust = MOST * min(max((agrees - DOUBTED) / (BELIEVED - DOUBTED), 0.0), 1.0)
    share = carried + np.float32(trust) * (answer - carried)
    still = carrying.stillness(np.hypot(back[..., 0], back[..., 1]), carrying.lab(picture), carrying.lab(before))
    return Found(share, excluded, agrees), still


LOG = []


def roomy(share: np.ndarray) -> Box:
    """Return the box around what is covered by more than half, with room around it."""
    tight = carrying.box_around((share > INSIDE).astype(np.float32), reach=0)
    if tight is None:
        return slice(0, share.shape[0]), slice(0, share.shape[1])
    reach = round(ROOM / 2 * max(part.stop - part.start for part in tight))
    box = carrying.box_around((share > INSIDE).astype(np.float32), reach)
    assert box is not None
    return box
