"""Find outlines: trace the curves around a matte, and propose the outline of a subject from a stroke or a lasso.

Proposals use GrabCut (Rother et al. 2004), which separates the colors of the subject from those around it along edges.
"""

import numpy as np

from ..core.model.outlines import Curves, curves
from . import opencv
from .opencv import cv2

ROUNDS = 6
# A stroke's subject lies within REACH of the stroke's size, probably within NEAR of that. Of a lasso's subject, pixels
# deeper than DEEP of the lasso's greatest depth are certain.
REACH, NEAR, DEEP = 1.0, 0.15, 0.6
MARGIN = 0.06  # of a lasso's size, by which it may have missed the subject

FINE = 4  # contours are followed in mattes so many times as large
SPOT = 6.0  # pixels: what covers no more of them is no part of a subject


def proposed(picture: np.ndarray, drawn: np.ndarray, *, encloses: bool) -> Curves:
    """Propose the outline of a subject in a picture, from strokes on it or from a lasso around it.

    Args:
        picture: (H, W, 3) uint8.
        drawn: (h, w) bool, smaller than the picture: the pixels that the strokes cover, or that the lasso encloses.
        encloses: True for a lasso, False for strokes.

    Returns:
        Closed curves around the subject (core.model.outlines): fractions of the picture, y up. Empty: no subject was
        found.

    Raises:
        MediaError: OpenCV is missing.
    """
    opencv.check("outlines are proposed by")
    if not drawn.any():
        return ()
    small = cv2.resize(picture, drawn.shape[::-1], interpolation=cv2.INTER_AREA)
    labels = _enclosed(drawn) if encloses else _along(drawn)
    cv2.setRNGSeed(0)  # the same proposal again
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(np.ascontiguousarray(small), labels, None, *models, ROUNDS, cv2.GC_INIT_WITH_MASK)
    inside = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD)).astype(np.uint8)
    _, parts = cv2.connectedComponents(inside)
    inside &= np.isin(parts, parts[drawn]).astype(np.uint8)  # what is apart from what is drawn is something else
    for way in (cv2.MORPH_OPEN, cv2.MORPH_CLOSE):
        inside = cv2.morphologyEx(inside, way, np.ones((3, 3), np.uint8))
    return traced(inside.astype(np.float32), off=0.75)


def _along(drawn: np.ndarray) -> np.ndarray:
    """Return GrabCut's initial labels (h, w) uint8 for a subject under a stroke.

    Pixels of the stroke are certainly the subject, those close to it probably. Those farther away are probably not the
    subject, and those beyond the stroke's reach certainly not.

    Args:
        drawn: The pixels that the stroke covers, (h, w) bool.
    """
    away = cv2.distanceTransform((~drawn).astype(np.uint8), cv2.DIST_L2, 3)
    reach = max(REACH * _extent(drawn), NEAR * len(drawn))
    labels = np.full(drawn.shape, cv2.GC_BGD, np.uint8)
    labels[away < reach] = cv2.GC_PR_BGD
    labels[away < NEAR * reach] = cv2.GC_PR_FGD
    labels[drawn] = cv2.GC_FGD
    return labels


def _enclosed(drawn: np.ndarray) -> np.ndarray:
    """Return GrabCut's initial labels (h, w) uint8 for a subject inside a lasso.

    Pixels deep inside the lasso are certainly the subject, and all others inside probably. Those in a narrow margin
    outside are probably not the subject, and those beyond it certainly not.

    Args:
        drawn: The pixels that the lasso encloses, (h, w) bool.
    """
    margin = max(3, round(MARGIN * _extent(drawn)))
    around = cv2.dilate(drawn.astype(np.uint8), np.ones((2 * margin + 1,) * 2, np.uint8)) > 0
    deep = cv2.distanceTransform(drawn.astype(np.uint8), cv2.DIST_L2, 3)
    labels = np.full(drawn.shape, cv2.GC_BGD, np.uint8)
    labels[around] = cv2.GC_PR_BGD
    labels[drawn] = cv2.GC_PR_FGD
    labels[deep > DEEP * deep.max()] = cv2.GC_FGD
    return labels


def _extent(drawn: np.ndarray) -> int:
    """Return the longer side of the box around drawn pixels (h, w) bool, in pixels."""
    return max(int(np.ptp(np.flatnonzero(drawn.any(axis=axis)))) + 1 for axis in (0, 1))


def traced(matte: np.ndarray, off: float = 0.5) -> Curves:
    """Trace closed curves around the pixels where a matte is above one half, but not spots or holes up to SPOT pixels.

    Args:
        matte: (height, width) float32, 0 to 1.
        off: The most pixels by which curves may differ from the exact contours, so that they need fewer points.

    Returns:
        Curves (core.model.outlines): fractions of the picture, y up, the one around the largest area first. Holes have
        curves of their own.

    Raises:
        MediaError: OpenCV is missing.
    """
    opencv.check("outlines are traced by")
    rows, columns = (np.flatnonzero(matte.max(axis=axis) > 0.5) for axis in (1, 0))
    if not rows.size:
        return ()
    top, left = max(rows[0] - 1, 0), max(columns[0] - 1, 0)
    part = np.pad(matte[top : rows[-1] + 2, left : columns[-1] + 2], 1)  # it is closed at the picture's edges
    height, width = part.shape
    fine = cv2.resize(part, (width * FINE, height * FINE), interpolation=cv2.INTER_LINEAR)
    contours, _ = cv2.findContours((fine > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    found = [
        cv2.approxPolyDP(contour, off * FINE, True)[:, 0]
        for contour in contours
        if cv2.contourArea(contour) > SPOT * FINE**2
    ]
    found = sorted((each for each in found if len(each) > 2), key=cv2.contourArea, reverse=True)
    size = np.array(matte.shape[::-1])
    placed = [(points + 0.5) / FINE + (left - 1, top - 1) for points in found]
    return curves([np.clip(points / size, 0, 1) * (1, -1) + (0, 1) for points in placed])
