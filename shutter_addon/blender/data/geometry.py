"""Where a strip's picture lies on the sequencer's image."""

from __future__ import annotations

import numpy as np
from bpy.types import Region, Strip

# The numbers of a strip's transform that can be keyed.
TRANSFORM = ("offset_x", "offset_y", "scale_x", "scale_y", "rotation")


@np.errstate(invalid="ignore")  # the result is then not finite, which annotations.image_to_picture reports
def picture_to_image(strip: Strip, size: tuple[int, int], **moved: float) -> np.ndarray:
    """Matrix (3, 3) from fractions of the strip's picture to the sequencer's image space.

    Image space, as annotations have it: pixels, origin at the image's centre, y up. size: the picture's, in pixels;
    moved: numbers of the strip's transform, in place of its own.
    Blender scales and turns a strip about its transform's origin, and mirrors the whole image after that.
    """
    width, height = size
    x, y, scale_x, scale_y, rotation = (moved.get(name, getattr(strip.transform, name)) for name in TRANSFORM)
    cos, sin = np.cos(rotation), np.sin(rotation)
    pivot = (np.array(strip.transform.origin) - 0.5) * (width, height)
    linear = np.array([[cos, -sin], [sin, cos]]) * (scale_x, scale_y)
    corner = -(pivot + np.array([width, height]) / 2)
    offset = np.array([x, y]) + pivot + linear @ corner
    matrix = np.eye(3)
    matrix[:2, :2], matrix[:2, 2] = linear * (width, height), offset
    return np.diag([-1.0 if strip.use_flip_x else 1.0, -1.0 if strip.use_flip_y else 1.0, 1.0]) @ matrix


def is_invertible(matrix: np.ndarray) -> bool:
    """Whether a matrix (3, 3) leads back: a strip may be scaled to nothing, and a file may hold what is no number."""
    with np.errstate(all="ignore"):
        return bool(np.isfinite(matrix).all() and np.isfinite(1 / np.linalg.det(matrix)))


def picture_to_region(strip: Strip, size: tuple[int, int], region: Region) -> np.ndarray:
    """Matrix (3, 3) from fractions of the strip's picture to pixels of a preview's region."""
    return image_to_region(region) @ picture_to_image(strip, size)


def image_to_region(region: Region) -> np.ndarray:
    """Matrix (3, 3) from the sequencer's image space to pixels of a preview's region."""
    # view_to_region rounds to whole pixels, region_to_view does not; and its last pixel is what is drawn at the edge.
    (left, bottom), (right, top) = (
        region.view2d.region_to_view(x, y) for x, y in ((0, 0), (region.width - 1, region.height - 1))
    )
    scale = np.array([region.width, region.height]) / (right - left, top - bottom)
    to_region = np.diag([*scale, 1.0])
    to_region[:2, 2] = -scale * (left, bottom)
    return to_region
