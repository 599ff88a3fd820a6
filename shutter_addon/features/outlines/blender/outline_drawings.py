"""Draw outlines: correct a tracked outline, find where a drawing is needed, and convert regions to subjects and back.

Annotations have no key types in Blender 5.2, so the Dope Sheet shows generated and hand-made drawings the same way.
"""

from contextlib import closing
from functools import lru_cache

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ....blender.data import snapshot, strips
from ....blender.data.annotations import layer_of
from ....blender.editing import region_edits
from ....blender.rendering import effect_source
from ....core import revision
from ....core.messages import EffectError
from ....core.model import outlines, scribbles
from ....media import flow, outlining
from .. import carrying
from ..carried_mattes import CarriedMattes
from ..subject_mattes import CarriedFile

SURE_SUBJECT = 0.5  # a more confident frame of a subject needs no correction
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
    taken = snapshot.take(scene, effect, strip, (frame,))
    with effect_source.open_source(taken) as source:
        samples = source.read(effect_source.clip_of(taken, source).shown(frame).source_frame)
        picture = flow.displayed(samples, source.transfer, source.alpha)
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
    region_edits.draw_curves(effect, strip, region, curves, frame)
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


def find_subject(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Make a region a subject if the model finds one under the strokes that are nearest to the current frame; an
    outline becomes one by its drawings, which stay.

    Returns:
        Whether it has found one.

    Raises:
        EffectError: There are no strokes.
        MediaError: There is no picture or no model.
    """
    region, before = effect.regions[index], effect.regions[index].kind
    if before == "OUTLINE":
        region.kind, region.layer, region.outline_layer = "SUBJECT", "", region.layer
        return True
    layer, frame = layer_of(effect, region), scene.frame_current
    drawn = [drawing.frame_number for drawing in layer.frames] if layer else []
    frame = min(drawn, key=lambda each: abs(each - frame), default=frame)
    if not snapshot.strokes_at(scene, effect, strip, index, frame):
        raise EffectError(rpt_("The region has no strokes at the current frame"))
    region.kind, is_found = "SUBJECT", False
    try:
        file, shown = snapshot.carried_outline(scene, effect, strip, index, (frame,))
        with closing(file.open()) as mattes:  # its first matte is kept, and shown at once
            mattes.read(shown[frame])
            is_found = bool(mattes.confidence(shown[frame]))
    finally:
        if not is_found:
            region.kind = before
    if is_found:
        region.motion = "LOCATION"
    return is_found


def to_outline(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Make a subject an outline, which is drawn where the subject has strokes or drawings.

    Returns:
        Whether it encloses anything.

    Raises:
        EffectError, MediaError: Its mattes cannot be made.
    """
    region = effect.regions[index]
    layers = [layer_of(effect, region, name) for name in ("layer", "outline_layer")]
    frames = sorted({drawing.frame_number for layer in layers if layer for drawing in layer.frames})
    file, shown = snapshot.carried_outline(scene, effect, strip, index, frames)
    with closing(file.open()) as mattes:
        for frame in frames:
            mattes.read(shown[frame])
        curves = {frame: mattes.curves(shown[frame]) for frame in frames}
    if not any(curves.values()):
        return False
    region_edits.remove_layers(effect, region)
    region.kind = "OUTLINE"
    for frame, drawn in curves.items():
        region_edits.draw_curves(effect, strip, region, drawn, frame)
    return True
