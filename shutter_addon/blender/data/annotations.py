"""Scribbles: Blender's annotation layers and strokes, and where they lie on an effect's picture."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_

from ...core import limits
from . import geometry, validation
from .validation import EffectError

# Pixels of a strip's side on the image, below which nobody sees where its scribbles are.
_SMALLEST = 4


def picture_size(effect) -> tuple[int, int]:
    """Width and height of the effect's picture, which are its source's."""
    return effect.scene.render.resolution_x, effect.scene.render.resolution_y


def image_to_picture(effect, strip) -> np.ndarray | None:
    """Matrix (3, 3) from the sequencer's image to fractions of the strip's picture; None where the strip is scaled to
    nothing that can be seen. EffectError: its transform is none."""
    matrix = geometry.picture_to_image(strip, picture_size(effect))
    if not np.isfinite(matrix).all():
        raise EffectError(rpt_('strip "{strip}": a number of its transform is not finite').format(strip=strip.name))
    if np.hypot(*matrix[:2, :2]).min() < _SMALLEST:
        return None
    return np.linalg.inv(matrix)


def points(region, drawing, to_picture) -> list[np.ndarray]:
    """The strokes (n, 2) of an annotation's frame that belongs to a region, on the picture. EffectError: they lie too
    far from it."""
    result = []
    for stroke in drawing.strokes:
        flat = np.empty(len(stroke.points) * 3, dtype=np.float32)
        stroke.points.foreach_get("co", flat)
        if len(flat):
            result.append(geometry.mapped(to_picture, flat.reshape(-1, 3)[:, :2].astype(np.float64)))
            if not (np.abs(result[-1]) <= limits.MAX_DISTANCE).all():
                raise EffectError(
                    rpt_("{place}: a point of its strokes is nowhere near the picture").format(
                        place=validation.place(region)
                    )
                )
    return result


def layer_of(effect, region):
    """The annotation layer of a region, or None."""
    annotation = effect.scene and effect.scene.annotation
    return annotation.layers.get(region.layer) if annotation else None


def annotation(effect):
    """What the effect's scribbles are drawn on; made where somebody has removed it."""
    if effect.scene.annotation is None:
        effect.scene.annotation = bpy.data.annotations.new(data_("Scribbles {effect}").format(effect=effect.name))
    return effect.scene.annotation
