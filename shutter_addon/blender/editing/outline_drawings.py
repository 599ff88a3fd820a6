"""Drawings of an outline that are made of what is carried: to mend it, and where one is needed next.

Annotations have no key types in Blender 5.2: a drawing that was made and one's own look alike in the Dope Sheet.
"""

from contextlib import closing
from typing import Any, NamedTuple

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_

from ...core import revision
from ...core.messages import EffectError
from ...core.model import outlines
from ...core.model.scribbles import mapped
from ..data import annotations, geometry, snapshot, strips
from ..data.annotations import layer_of
from . import region_edits

AGREED = 0.9  # agreement of the two sides from which on no drawing is needed


class Needed(NamedTuple):
    """Where a drawing is needed most.

    frame: of the timeline; agreement: 0 to 1, of what both sides make of it; lacking: how many frames are not carried
    yet, of which nobody knows"""

    frame: int | None
    agreement: float
    lacking: int


_shown = revision.UntilChange()


def is_outline(region) -> bool:
    return region is not None and region.kind == "OUTLINE"


def curves_now(scene, effect, strip, index: int) -> outlines.Curves:
    """The curves of an outline at the current frame, in fractions of the picture: drawn, carried, or straight where
    nothing is carried yet. EffectError, MediaError: there are none."""
    frame = scene.frame_current
    if not strips.is_carried(effect.regions[index]):
        return outlines.curves(snapshot.strokes_at(scene, effect, strip, index, frame))
    file, shown = snapshot.carried_outline(scene, effect, strip, index, (frame,))
    with closing(file.open()) as mattes:
        return mattes.curves(min(shown[frame], mattes.count - 1))


def shown_curves(scene, effect, strip, index: int) -> outlines.Curves:
    """As curves_now, read once until something changes: for what is drawn."""
    key = effect.scene.session_uid, strip.name, index, scene.frame_current
    return _shown.get(key, lambda: curves_now(scene, effect, strip, index))


def carried() -> None:
    """Mattes have been carried, of which Blender does not tell."""
    _shown.clear()


def draw(effect, strip, region, curves: outlines.Curves, frame: int) -> None:
    """Makes curves the drawing of a region at a timeline frame, in place of one that is there. EffectError: the strip
    is scaled to nothing."""
    to_image = geometry.picture_to_image(strip, annotations.picture_size(effect))
    if not geometry.is_invertible(to_image):
        raise EffectError(rpt_('strip "{strip}" is scaled to nothing').format(strip=strip.name))
    layer = layer_of(effect, region) or region_edits.new_layer(effect, region)
    for drawing in [drawing for drawing in layer.frames if drawing.frame_number == frame]:
        layer.frames.remove(drawing)
    drawing = layer.frames.new(frame)
    revision.changed()  # Blender tells of no strokes
    for points in curves:
        annotations.add_stroke(drawing, mapped(to_image, np.asarray(points)))


def carried_frames(scene, effect, strip, index: int) -> tuple[Any, dict[int, int]]:
    """What gives the mattes of an outline (media.carried_mattes.CarriedFile), and which frames of the source the frames
    of its strip show, by timeline frame. EffectError, MediaError: nothing is carried."""
    frames = range(strip.left_handle, strip.right_handle)
    file, shown = snapshot.carried_outline(scene, effect, strip, index, frames)
    return file, {int(frame): number for frame, number in shown.items()}


def next_needed(scene, effect, strip, index: int) -> Needed:
    """The frame of the strip on which the drawings before and behind it disagree most. EffectError, MediaError: nothing
    is carried."""
    file, shown = carried_frames(scene, effect, strip, index)
    if len(file.drawings) < 2:
        raise EffectError(rpt_("Draw the outline at two frames first"))
    first, last = file.drawings[0][0], file.drawings[-1][0]
    drawn = {frame for frame, _curves in file.drawings}
    worst, lacking = Needed(frame=None, agreement=AGREED, lacking=0), 0
    with closing(file.open()) as mattes:
        for frame, number in shown.items():
            if number in drawn or not first < number < last:
                continue
            agreement = mattes.agreement(number)
            lacking += agreement is None
            if agreement is not None and agreement < worst.agreement:
                worst = Needed(frame=frame, agreement=agreement, lacking=0)
    return worst._replace(lacking=lacking)
