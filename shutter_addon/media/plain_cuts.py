"""What PySceneDetect's detectors say of pictures, by NumPy alone, without OpenCV, which PySceneDetect needs. The sums
are the same but for pictures of fewer rows than HashDetector has bits. Pictures are RGB (H, W, 3) in levels, which are
rounded."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

_GREY = np.array([9798, 19235, 3735])  # OpenCV's, in 1 / 32768


def change(before: np.ndarray, after: np.ndarray) -> float:
    """ContentDetector's score of luma alone: by how many levels the largest colour differs on average."""
    return float(np.abs(_whole(before).max(axis=-1).astype(int) - _whole(after).max(axis=-1)).mean())


def unlike(before: np.ndarray, after: np.ndarray, bits: int) -> float:
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
