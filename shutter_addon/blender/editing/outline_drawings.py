"""Draw outlines: correct a tracked outline, find where a drawing is needed, and convert between outlines and masks.

Annotations have no key types in Blender 5.2, so the Dope Sheet shows generated and hand-made drawings the same way.
"""

from contextlib import closing
from functools import lru_cache

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Mask, PropertyGroup, Scene, Strip

from ...core import revision
from ...core.messages import EffectError
from ...core.model import outlines, scribbles
from ...core.model.masks import MaskShape
from ...core.model.scribbles import mapped
from ...media import carrying, flow, outlining
from ...media.carried_mattes import CarriedMattes
from ...media.subject_mattes import CarriedFile
from ..data import annotations, mask_reading, snapshot, strips
from ..data.annotations import layer_of
from ..rendering import effect_source
from . import region_edits

Strokes = outlines.Curves | list[np.ndarray]  # each (n, 2), in fractions of the picture
SURE_SUBJECT = 0.5  # a more confident frame of a subject needs no correction
_EVEN = 1e-5  # what an even motion of a mask may change from frame to frame, in pictures
SURE = 0.75  # a more confident frame needs no drawing: its overlap is usually 90 %


def curves_now(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> outlines.Curves:
    """Return the curves of an outline at the current frame, in fractions of the picture.

    They are drawn or tracked, or interpolated linearly where nothing is tracked yet.

    Raises:
        EffectError, MediaError: there are none.
    """
    frame = scene.frame_current
    if not strips.is_carried(effect.regions[index]):
        return outlines.curves(snapshot.strokes_at(scene, effect, strip, index, frame))
    file, shown = snapshot.carried_outline(scene, effect, strip, index, (frame,))
    with closing(_opened(file)) as mattes:
        return mattes.curves(min(shown[frame], mattes.count - 1))


@lru_cache(1)  # opening a movie for each frame would be slow; reading opens it again
def _opened(file: CarriedFile) -> CarriedMattes:
    return file.open()


def shown_curves(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> outlines.Curves:
    """Return `curves_now` for drawing code. The result is kept until something changes."""
    key = effect.scene.session_uid, strip.name, index, scene.frame_current
    return revision.until_change("outline", key, lambda: curves_now(scene, effect, strip, index))


def draw(effect: PropertyGroup, strip: Strip, region: PropertyGroup, curves: Strokes, frame: int) -> None:
    """Make curves the drawing of a region at a timeline frame.

    Args:
        curves: in fractions of the picture.

    Raises:
        EffectError: the strip has a scale of 0.
    """
    to_image = annotations.picture_to_image(strip, annotations.picture_size(effect))
    if not annotations.is_invertible(to_image):
        raise EffectError(rpt_('strip "{strip}" has a scale of 0').format(strip=strip.name))
    name = "outline_layer" if region.kind == "SUBJECT" else "layer"
    layer = layer_of(effect, region, name) or region_edits.new_layer(effect, region, name)
    for drawing in [drawing for drawing in layer.frames if drawing.frame_number == frame]:
        layer.frames.remove(drawing)
    drawing = layer.frames.new(frame)
    for points in curves:
        annotations.add_stroke(drawing, mapped(to_image, np.asarray(points)))
    revision.changed()  # Blender does not report new strokes


def picture_now(scene: Scene, effect: PropertyGroup, strip: Strip) -> np.ndarray:
    """Return the source frame (H, W, 3) uint8 that the current frame shows.

    Raises:
        EffectError, MediaError: there is none.
    """
    shown = snapshot.take(scene, effect, strip, (scene.frame_current,))
    with effect_source.open_source(shown) as source:
        samples = source.read(effect_source.clip_of(shown, source).shown(scene.frame_current).source_frame)
        return flow.displayed(samples, source.transfer, source.alpha)


def nearest(effect: PropertyGroup, index: int, frame: int) -> int:
    """Return the timeline frame of a region's drawing that is nearest to `frame`, or `frame` if there is no drawing."""
    layer = layer_of(effect, effect.regions[index])
    drawn = [drawing.frame_number for drawing in layer.frames] if layer else []
    return min(drawn, key=lambda each: abs(each - frame), default=frame)


def outline_it(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Make a region the outline of the subject under or inside its strokes at the current frame.

    Drawings of an outline at other frames stay. Return whether a subject was found.

    Raises:
        EffectError, MediaError: there are no strokes, or no picture.
    """
    region, frame = effect.regions[index], scene.frame_current
    there = snapshot.region_at(scene, effect, strip, index, (frame,))
    strokes = there.drawings.at(frame) if region.kind == "OUTLINE" else there.at(frame).strokes
    if not len(strokes):
        raise EffectError(rpt_("The region has no strokes at the current frame"))
    picture = picture_now(scene, effect, strip)
    width, height = carrying.working_size(*picture.shape[1::-1])
    encloses = region.kind != "LINE"
    shape = scribbles.Shape(shutter=0, kind="line", width=region.width, strokes=tuple(strokes))
    drawn = outlines.coverage(strokes, width, height) > 0.5 if encloses else np.zeros((height, width), bool)
    if not drawn.any():
        drawn = scribbles.rasterise([shape], width, height) > 0
    curves = outlining.proposed(picture, drawn, encloses=encloses)
    if not curves:
        return False
    if region.kind != "OUTLINE":
        region.kind, region.motion = "OUTLINE", "LOCATION"
        layer = layer_of(effect, region)
        for drawing in list(layer.frames):
            layer.frames.remove(drawing)
    draw(effect, strip, region, curves, frame)
    return True


def carried_frames(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> tuple[CarriedFile, dict[int, int]]:
    """Return the mattes of an outline or subject, and the source frame for each timeline frame of its strip.

    Raises:
        EffectError, MediaError: nothing is tracked.
    """
    frames = range(strip.left_handle, strip.right_handle)
    file, shown = snapshot.carried_outline(scene, effect, strip, index, frames)
    return file, {int(frame): number for frame, number in shown.items()}


def next_needed(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> tuple[int | None, float]:
    """Return the least confident frame of a tracked outline or subject, the middle one of several, and its confidence.

    None: no frame needs a drawing, as all have this confidence.

    Raises:
        EffectError, MediaError: nothing is tracked.
    """
    file, shown = carried_frames(scene, effect, strip, index)
    is_subject = effect.regions[index].kind == "SUBJECT"
    drawn = [] if is_subject else [number for number, _curves in file.drawings]
    with closing(file.open()) as mattes:
        known = {frame: mattes.confidence(number) for frame, number in shown.items() if number not in drawn}
    # Not all mattes of a subject may be made. Frames of an outline without one are too far from any drawing.
    sure = {frame: share or 0.0 for frame, share in known.items() if not (is_subject and share is None)}
    enough = SURE_SUBJECT if is_subject else SURE
    least = min(sure.values(), default=enough)
    if least >= enough:
        return None, enough
    worst = sorted(frame for frame, share in sure.items() if share == least)
    return worst[len(worst) // 2], least


def from_mask(scene: Scene, effect: PropertyGroup, strip: Strip, shutter: PropertyGroup, mask: Mask) -> PropertyGroup:
    """Add a region: an outline with drawings where a mask's motion changes.

    Raises:
        EffectError, MediaError: the mask cannot be read, encloses nothing in the strip, or OpenCV is missing.
    """
    size = annotations.picture_size(effect)
    shown = snapshot.source_frames(scene, effect, strip, range(strip.left_handle, strip.right_handle))
    masks = mask_reading.at_frames(mask, [mask.frame_start + number for number in shown.values()])
    drawn = _where_motion_changes(dict(zip(map(int, shown), masks, strict=True)))
    shapes = {frame: outlining.traced(shape.values(*size)) for frame, shape in drawn.items()}
    if not any(shapes.values()):
        raise EffectError(rpt_('mask "{mask}" encloses nothing in the strip').format(mask=mask.name))
    region = region_edits.add_region(effect, shutter, "OUTLINE", mask.name)
    region.motion, region.between = "LOCATION", "STRAIGHT"
    ordered = outlines.in_order(shapes.values(), size[0] / size[1])
    for frame, curves in zip(shapes, ordered, strict=True):
        draw(effect, strip, region, curves, frame)
    return region


def _where_motion_changes(shapes: dict[int, MaskShape]) -> dict[int, MaskShape]:
    """Return those of a mask's shapes by frame between which it moves evenly."""
    steps = np.diff(np.array([_numbers(shape) for shape in shapes.values()]), axis=0)
    changes = np.abs(np.diff(steps, axis=0, prepend=1, append=0)).max(axis=1, initial=0)
    return {frame: shape for (frame, shape), change in zip(shapes.items(), changes, strict=True) if change > _EVEN}


def _numbers(shape: MaskShape) -> np.ndarray:
    """Return the numbers of a mask that may move."""
    splines = [spline for layer in shape.layers for spline in layer.splines]
    moving = [np.concatenate([np.ravel(spline.points), spline.weights]) for spline in splines]
    return np.concatenate([[layer.alpha for layer in shape.layers], *moving])
