"""Curves around what a matte covers."""

from __future__ import annotations

import numpy as np

from ..core.model.outlines import Curves, curves
from . import opencv
from .opencv import cv2

FINE = 4  # contours are followed in mattes so many times as large
SPOT = 6.0  # pixels: what covers no more of them is no part of a subject


def traced(matte: np.ndarray, off: float = 0.5) -> Curves:
    """Curves (core.model.outlines) around what a matte covers by more than half, the largest first; holes have their
    own.

    matte: (height, width) float32, 0 to 1; off: how far curves may be from its contours, in pixels
    MediaError: OpenCV is missing."""
    opencv.check("outlines are traced by")
    rows, columns = (np.flatnonzero(matte.max(axis=axis) > 0.5) for axis in (1, 0))
    if not rows.size:
        return ()
    top, left = max(rows[0] - 1, 0), max(columns[0] - 1, 0)
    part = np.pad(matte[top : rows[-1] + 2, left : columns[-1] + 2], 1)  # it is closed at the picture's edges
    height, width = part.shape
    fine = cv2.resize(part, (width * FINE, height * FINE), interpolation=cv2.INTER_LINEAR)
    contours, _ = cv2.findContours((fine > 0.5).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    found = [cv2.approxPolyDP(contour, off * FINE, True)[:, 0] for contour in contours if _area(contour) > SPOT]
    found = sorted((each for each in found if len(each) > 2), key=cv2.contourArea, reverse=True)
    size = np.array(matte.shape[::-1])
    placed = [(points + 0.5) / FINE + (left - 1, top - 1) for points in found]
    return curves([np.clip(points / size, 0, 1) * (1, -1) + (0, 1) for points in placed])


def _area(contour: np.ndarray) -> float:
    """In pixels of the matte."""
    return cv2.contourArea(contour) / FINE**2
