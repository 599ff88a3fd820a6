"""Conversions between linear light and sRGB code values, and between straight and premultiplied alpha.

Arrays may have any shape; results have the precision of the argument.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

REC709 = np.array([0.2126, 0.7152, 0.0722], np.float32)  # luminance of linear light


def to_linear(encoded: ArrayLike) -> np.ndarray:
    """Convert sRGB code values (1.0 is white) to linear light. Negative values use the curve's linear foot."""
    encoded = np.asarray(encoded)
    curve = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curve).astype(encoded.dtype)


def to_encoded(linear: ArrayLike) -> np.ndarray:
    """Convert linear light (1.0 is white) to sRGB code values; the inverse of `to_linear`."""
    linear = np.asarray(linear)
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, linear * 12.92, curve).astype(linear.dtype)


def premultiplied(rgba: np.ndarray, convert: Callable[[np.ndarray], np.ndarray] | None = None) -> np.ndarray:
    """Convert straight RGBA (…, 4) to premultiplied. First apply `convert` to the colors (…, 3), not to alpha."""
    rgb = rgba[..., :3] if convert is None else convert(rgba[..., :3])
    return np.concatenate([rgb * rgba[..., 3:], rgba[..., 3:]], axis=-1)


def over_black(frame: np.ndarray, alpha: str) -> np.ndarray:
    """Return a source's frame as it looks over black: straight alpha is multiplied into the colors.

    The encoding stays: values are not converted to linear light first.

    Args:
        frame: RGBA (…, 4) as from FrameSource.read.
        alpha: FrameSource.alpha: "opaque", "straight" or "premultiplied".

    Returns:
        RGBA (…, 4). Floats become float32, clipped to 0 … 1, with 0 for NaN. Integers with straight alpha become
        float32, 0 … 1. Other integers are returned as they are.
    """
    if frame.dtype.kind == "f":
        frame = np.nan_to_num(frame.astype(np.float32), copy=False).clip(0, 1)
    if alpha != "straight":
        return frame
    white = np.float32(np.iinfo(frame.dtype).max if frame.dtype.kind == "u" else 1)
    return premultiplied(frame / white)


def straight(rgba: np.ndarray) -> np.ndarray:
    """Convert premultiplied RGBA (…, 4) to straight. Transparent pixels keep their colors: they may emit light."""
    return np.concatenate([rgba[..., :3] / _cover(rgba), rgba[..., 3:]], axis=-1)


def linearised(rgba: np.ndarray) -> np.ndarray:
    """Convert premultiplied RGBA (…, 4) from sRGB code values to linear light. Transparent pixels may emit light."""
    cover = _cover(rgba)
    return np.concatenate([to_linear(rgba[..., :3] / cover) * cover, rgba[..., 3:]], axis=-1)


def _cover(rgba: np.ndarray) -> np.ndarray:
    """Return the factor (…, 1) that premultiplied colors contain: alpha, or 1 where alpha is 0 within rounding."""
    alpha = rgba[..., 3:]
    return np.where(alpha > 1e-6, alpha, 1)  # a smaller alpha is rounding and counts as transparent
