"""A small neural network that finds the subject of a picture (U²-Net: Qin et al. 2020, "U²-Net: Going deeper with
nested U-structure for salient object detection")."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..core import stopping
from ..core.model import scribbles
from . import opencv
from .carrying import box_around, refined, working_size
from .errors import MediaError
from .flow import resized
from .opencv import cv2

MODEL = Path(__file__).resolve().parents[2] / "models" / "u2netp.onnx"
MEAN, DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of the colors that such networks are trained with
INSIDE = 0.5
ROOM = 0.4  # share of its size by which the box around a subject is enlarged
TOUCHED = 0.5  # share of a stroke that a subject has to cover
LARGEST = 0.9  # share of the picture from which on a mask is no subject
WIDTH = 0.01  # of a stroke, in parts of the picture's height
_INPUT = re.compile(r"// <Input> CV_32FC1 \[1 x 3 x (\d+) x (\d+)\]")  # of OpenCV's description

Box = tuple[slice, slice]  # rows and columns


def model_path(preference: str = "") -> Path:
    """Return the file of the network: that of the preference, or the one that Virtual Shutter brings."""
    return Path(preference).expanduser() if preference else MODEL


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
        except OSError as error:
            raise MediaError(f"{path}: the model that finds subjects cannot be read ({error.strerror})") from None
        self.digest = hashlib.sha256(content).hexdigest()
        try:
            self._net = cv2.dnn.readNetFromONNX(np.frombuffer(content, np.uint8))
            sizes = _INPUT.findall(self._net.dump())
        except cv2.error:
            raise MediaError(f"{path.name}: is damaged, or no ONNX model that OpenCV can run") from None
        if not sizes:
            raise self._foreign()
        self._height, self._width = map(int, sizes[0])

    def answer(self, picture: np.ndarray) -> np.ndarray:
        """Return how sure the network is (h, w) float32, 0 to 1, that a pixel of a picture (h, w, 3) uint8 belongs to
        the subject.

        Raises:
            MediaError: The network is of another kind.
        """
        stopping.check()
        small = cv2.resize(picture, (self._width, self._height), interpolation=cv2.INTER_AREA).astype(np.float32)
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

    def within(self, picture: np.ndarray, box: Box) -> np.ndarray:
        """Return its answer on a part of a picture; nothing elsewhere."""
        found = np.zeros(picture.shape[:2], np.float32)
        found[box] = self.answer(np.ascontiguousarray(picture[box]))
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
    small = resized(picture, working_size(*picture.shape[1::-1]))
    share = found(network, small, covered([stroke], WIDTH, small), np.zeros(small.shape[:2], bool))
    return None if share is None else refined(picture, share)


def covered(strokes: Sequence[np.ndarray], width: float, picture: np.ndarray) -> np.ndarray:
    """Return which pixels (h, w) bool of a picture strokes cover.

    Args:
        width: Of the strokes, in parts of the picture's height.
    """
    points = tuple(np.asarray(stroke, np.float64) for stroke in strokes)
    height, breadth = picture.shape[:2]
    return scribbles.rasterise([scribbles.Shape(0, "line", width, points)], breadth, height) > 0


def found(network: Network, picture: np.ndarray, on: np.ndarray, off: np.ndarray) -> np.ndarray | None:
    """Return how sure (h, w) float32 pixels belong to the subject under strokes; None if there is none.

    Args:
        picture: (h, w, 3) uint8.
        on, off: (h, w) bool, what strokes on the subject cover, and strokes on what it is not.
    """
    if not on.any():
        return None
    best, most = None, 0.0
    share = chosen(network.answer(picture), on, off, picture)
    for _round in range(2):  # closer and closer
        box = roomy(share if share.max() > INSIDE else on.astype(np.float32), ROOM)
        near = chosen(network.within(picture, box), on, off, picture)
        for each in (share, near):
            covers = float((each[on] > INSIDE).mean())
            if covers >= TOUCHED and covers > most and (each > INSIDE).mean() < LARGEST:
                best, most = each, covers
        if best is not None:
            break
        share = near
    return best


def chosen(answer: np.ndarray, on: np.ndarray, off: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """Return what an answer (h, w) has of the parts that lie under strokes on the subject, without what other strokes
    lie on; see `found`."""
    inside = (answer > INSIDE).astype(np.uint8)
    _, parts = cv2.connectedComponents(inside)
    keep = np.isin(parts, np.setdiff1d(parts[on], [0]))
    if (keep & off).any():
        markers = np.where(keep, 0, 3).astype(np.int32)
        markers[on], markers[off] = 1, 2
        keep &= cv2.watershed(picture, markers) == 1
    soft = cv2.dilate(keep.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    soft &= keep | (inside == 0)
    return np.where(soft & ~off, answer, np.float32(0))


def roomy(share: np.ndarray, room: float) -> Box:
    """Return the box around what is covered by more than half, enlarged by a share of its size."""
    tight = box_around((share > INSIDE).astype(np.float32), reach=0)
    if tight is None:
        return slice(0, share.shape[0]), slice(0, share.shape[1])
    reach = round(room / 2 * max(part.stop - part.start for part in tight))
    box = box_around((share > INSIDE).astype(np.float32), reach)
    assert box is not None
    return box
