"""Find the background of footage from a camera that stands still, and what is in front of it.

At most times, nothing is in front of a given pixel of the background. So the median of frames that are some time apart
shows the background alone.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core import stopping
from ...core.caches import RecentValues
from ...core.messages import MediaError
from ...media import flow
from ...media.opencv import cv2
from . import carrying

SAMPLES, APART = 16, 8  # frames that are sampled, and how many frames they are apart at most
THIN = 4  # every so many pixels tell whether the camera stands still
# Levels of 255 by which noise changes a pixel at most; the least share of pixels that change no more if the camera
# stands still; and how many samples have to show the view of the frame.
NOISE, SAME, ENOUGH = 4, 0.7, SAMPLES // 2
# How far colors differ from the background, in units of CIE Lab, its L halved: at most where it is visible, and at
# least where something is surely in front of it. The third is a factor for darker pixels, which may be mere shadows.
FAINT, CLEAR, DARKER = 2.0, 5.0, 0.25
# If so large a share of a subject is at rest and looks like the background, the background may show the subject.
AT_REST = 0.25
GAPS = 9  # pixels: gaps in a subject that look like the background are filled if they are less broad
BESIDE = 4  # pixels beside a subject's edge that may belong to it


class StillBackground:
    """Finds the background behind what moves in footage, where the camera stands still."""

    def __init__(self, picture: Callable[[int], np.ndarray], count: int) -> None:
        """Prepare to find the background.

        Args:
            picture: Reads a frame of the footage as working picture, (h, w, 3) uint8.
            count: How many frames the footage has.
        """
        self._picture, self._count = picture, count
        self._samples: RecentValues[int, np.ndarray] = RecentValues()
        self._found: RecentValues[tuple[int, ...], np.ndarray] = RecentValues()

    def behind(self, frame: int, picture: np.ndarray) -> np.ndarray | None:
        """Find the background of a frame. Earlier calls have no influence on it.

        Args:
            frame: The frame.
            picture: Its working picture, (h, w, 3) uint8.

        Returns:
            The background, (h, w, 3) uint8. None: fewer than ENOUGH of the sampled frames around it can be read and
            show the same view.
        """
        step = max(min(self._count // SAMPLES, APART), 1)
        half = SAMPLES // 2 * step
        last = max(self._count - 2 * half, 0) // step * step
        start = min(max(frame // half * half - half // 2, 0), last)
        sampled = range(start, min(start + 2 * half, self._count), step)
        if len(sampled) < ENOUGH:
            return None
        samples = {each: it for each in sampled if (it := self._sample(each)) is not None and same_view(it, picture)}
        if len(samples) < ENOUGH:
            return None
        return self._found.ask(tuple(samples), lambda: _median(list(samples.values())), 2)

    def _sample(self, frame: int) -> np.ndarray | None:
        stopping.check()
        try:
            return self._samples.ask(frame, lambda: self._picture(frame), 2 * SAMPLES)
        except MediaError:  # a damaged frame far away is no fault of this one
            return None


def _median(pictures: list[np.ndarray]) -> np.ndarray:
    stopping.check()
    return np.partition(np.stack(pictures, axis=-1), len(pictures) // 2)[..., len(pictures) // 2]


def same_view(one: np.ndarray, other: np.ndarray) -> bool:
    """Tell whether two pictures (h, w, 3) uint8 show the same scene, and the camera stands still between them."""
    thin = [each[::THIN, ::THIN].astype(np.int16) for each in (one, other)]
    return bool(np.mean(np.abs(thin[0] - thin[1]).max(axis=2) <= NOISE) >= SAME)


def cleared(
    picture: np.ndarray,
    background: np.ndarray,
    share: np.ndarray,
    carried: np.ndarray,
    colors: np.ndarray,
    old: np.ndarray,
    places: carrying.Places,
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Paint over what is no part of a subject: the background, and other things in front of it.

    Args:
        picture: The working picture of the next frame, (h, w, 3) uint8.
        background: The background there, (h, w, 3) uint8.
        share: How sure it is that each pixel of the frame where the subject is known belongs to it, (h, w), 0 to 1.
        carried: The same as motion has carried it to `picture`.
        colors: The colors of `picture`, (3, h, w), from carrying.lab.
        old: The colors of the frame where the subject is known.
        places: For each pixel of `picture`, its place in that frame, (h, w, 2), x and y in pixels.

    Returns:
        The picture, (h, w, 3) uint8. One color hides the background, shadows on it, and other things.
        The subject's share of each pixel, as motion has carried it here, (h, w), less where the background is visible.
        How sure it is that each pixel shows another thing, which the known frame shows as well, (h, w), 0 to 1.
        None: AT_REST of the subject or more looks like the background and is at rest.
    """
    ground = carrying.lab(background)
    front = _in_front(colors, ground, DARKER)
    still = np.clip(1.5 - carrying.apart(colors, old) / np.float32(carrying.CHANGED), 0, 1)
    if float(((1 - front) * still)[carried > 0.5].mean()) >= AT_REST:
        return None
    beside = cv2.dilate((share > 0.1).astype(np.float32), np.ones((2 * BESIDE + 1,) * 2, np.uint8))
    others = flow.look(_in_front(old, ground, DARKER) * (1 - beside), places)
    front *= 1 - others * (1 - carried)
    flat = background.mean(axis=(0, 1)).astype(np.float32)
    faded = np.rint(flat + front[..., None] * (picture - flat)).astype(np.uint8)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (GAPS, GAPS))
    return faded, carried * cv2.morphologyEx(_in_front(colors, ground), cv2.MORPH_CLOSE, disc), others


def _in_front(colors: np.ndarray, ground: np.ndarray, darker: float = 1.0) -> np.ndarray:
    """Return how sure it is that something is in front of the background, (h, w), 0 to 1. Tiny holes are filled.

    Args:
        colors: The picture's colors, (3, h, w), from carrying.lab.
        ground: The background's colors, (3, h, w).
        darker: How much it counts that a pixel is darker than the background, 0 to 1.
    """
    differ = colors - ground
    differ[0] *= np.where(differ[0] < 0, np.float32(darker), np.float32(1))
    sure = np.clip((np.linalg.norm(differ, axis=0) - FAINT) / np.float32(CLEAR - FAINT), 0, 1)
    return cv2.morphologyEx(sure, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
