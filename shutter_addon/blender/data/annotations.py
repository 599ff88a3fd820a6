"""Strokes as annotations: their layers, and the matrices between an effect's picture and the sequencer's preview.

Blender stores annotations in the sequencer's image space: pixels, origin at the image's center, y up.
"""

from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Annotation, AnnotationFrame, PropertyGroup, Region, Scene, Strip

from ...core.messages import EffectError
from .fcurves import numbers

_SMALLEST = 4  # pixels: smaller sides are too small for scribbles
USERS = "user"  # in place of an effect's identity: the annotation is the user's own
# Properties of a region with a layer's name: its strokes; for a subject, strokes on what it is not, and corrections.
LAYERS = "layer", "not_layer", "outline_layer"
NOT_THIS = (0.9, 0.1, 0.1)  # color of strokes on what a subject is not
# The properties of a strip's transform that can be keyed.
TRANSFORM = ("offset_x", "offset_y", "scale_x", "scale_y", "rotation")


def picture_size(effect: PropertyGroup) -> tuple[int, int]:
    """Return the width and height of an effect's picture in pixels, which its scene takes from the source."""
    return effect.scene.render.resolution_x, effect.scene.render.resolution_y


@np.errstate(invalid="ignore")  # image_to_picture reports a result that is not finite
def picture_to_image(strip: Strip, size: tuple[int, int], **moved: float) -> np.ndarray:
    """Return the matrix (3, 3) from a strip's picture to the sequencer's image space, by the strip's transform.

    A point of the picture is given in fractions 0 to 1 of its width and height. Image space has pixels, with the origin
    at the image's center and y up. Blender scales and turns a strip about the transform's origin, then mirrors the
    image.

    Args:
        strip: The strip whose transform and mirroring count.
        size: The picture's width and height in pixels.
        moved: Values to use in place of the transform's own, by property name (see TRANSFORM), such as keyed ones at
            some frame.
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
    """Tell whether a matrix (3, 3) has a finite inverse. It has none if a strip's scale is 0, or a file holds NaN."""
    with np.errstate(all="ignore"):
        return bool(np.isfinite(matrix).all() and np.isfinite(1 / np.linalg.det(matrix)))


def picture_to_region(strip: Strip, size: tuple[int, int], region: Region) -> np.ndarray:
    """Return the matrix (3, 3) from a strip's picture, in fractions 0 to 1, to pixels of the preview region."""
    return image_to_region(region) @ picture_to_image(strip, size)


def image_to_region(region: Region) -> np.ndarray:
    """Return the matrix (3, 3) from the sequencer's image space to pixels of the preview, at its zoom and pan."""
    # region_to_view does not round to whole pixels. The last pixel is at the edge of the drawn area.
    corners = (0, 0), (region.width - 1, region.height - 1)
    (left, bottom), (right, top) = (region.view2d.region_to_view(*corner) for corner in corners)
    scale = np.array([region.width, region.height]) / (right - left, top - bottom)
    to_region = np.diag([*scale, 1.0])
    to_region[:2, 2] = -scale * (left, bottom)
    return to_region


def image_to_picture(strip: Strip, size: tuple[int, int], **moved: float) -> np.ndarray | None:
    """Return the matrix (3, 3) from the sequencer's image space, in pixels, to fractions of a strip's picture.

    It is the inverse of what picture_to_image returns for the same arguments, which are explained there.

    Returns:
        The matrix. None if the strip is shown so small that a side of its picture has fewer than 4 pixels: strokes
        cannot be placed on it.

    Raises:
        EffectError: A number of the strip's transform is not finite.
    """
    matrix = picture_to_image(strip, size, **moved)
    if not np.isfinite(matrix).all():
        raise EffectError(rpt_('strip "{strip}": a number of its transform is not finite').format(strip=strip.name))
    if np.hypot(*matrix[:2, :2]).min() < _SMALLEST:
        return None
    return np.linalg.inv(matrix)


def strokes_of(drawing: AnnotationFrame) -> list[np.ndarray]:
    """Return the strokes of one drawing of an annotation layer, each as points (n, 2) float64 in image space.

    Strokes without points are left out.

    Args:
        drawing: What the layer shows from one frame on.
    """
    strokes = [numbers(stroke.points, "co", size=3)[:, :2].astype(np.float64) for stroke in drawing.strokes]
    return [points for points in strokes if len(points)]


def add_stroke(drawing: AnnotationFrame, points: np.ndarray) -> None:
    """Add a stroke of points (n, 2), in image space, to what an annotation layer has at one frame."""
    stroke = drawing.strokes.new()
    stroke.display_mode = "2DSPACE"
    stroke.points.add(len(points))
    stroke.points.foreach_set("co", np.pad(points, ((0, 0), (0, 1))).astype(np.float32).ravel())


def layer_of(effect: PropertyGroup, region: PropertyGroup, name: str = "layer") -> Any:
    """Return the annotation layer that a region names in its property `name`, one of LAYERS; None: there is none."""
    annotation = effect.scene and effect.scene.annotation
    return annotation.layers.get(getattr(region, name)) if annotation else None


def layers_of(effect: PropertyGroup, region: PropertyGroup) -> list:
    """Return all annotation layers of a region: of its strokes and, for a subject, of its other LAYERS."""
    return [layer for name in LAYERS if (layer := layer_of(effect, region, name)) is not None]


def annotation(effect: PropertyGroup) -> Annotation:
    """Return the annotation that holds an effect's scribbles. Make a new one if it was removed."""
    if effect.scene.annotation is None:
        new_annotation(effect.scene, data_("Scribbles {effect}").format(effect=effect.name))
    return effect.scene.annotation


def new_annotation(scene: Scene, name: str) -> None:
    """Give an effect scene a new, empty annotation, marked so that it is removed together with the effect."""
    scene.annotation = bpy.data.annotations.new(name)
    scene.annotation.virtual_shutter_made = scene.virtual_shutter.identity
