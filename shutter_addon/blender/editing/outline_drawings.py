"""Drawings of an outline that are made of what is carried: to mend it, and where one is needed next.

Annotations have no key types in Blender 5.2: a drawing that was made and one's own look alike in the Dope Sheet.
"""

from bisect import bisect
from contextlib import closing
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Scene, Strip

from ...core import revision
from ...core.messages import EffectError
from ...core.model import outlines, scribbles
from ...core.model.scribbles import mapped
from ...media import flow, outlining
from ...media.carried_mattes import CarriedFile, CarriedMattes
from ..data import annotations, geometry, snapshot, strips
from ..data.annotations import layer_of
from ..rendering import effect_source
from . import region_edits

Strokes = outlines.Curves | list[np.ndarray]  # (n, 2) in fractions of the picture
SURE = 0.75  # confidence from which on no drawing is needed: an overlap of nine tenths, as a rule


class Needed(NamedTuple):
    """Where a drawing is needed most.

    frame: of the timeline, None: nowhere; confidence: 0 to 1, of its matte"""

    frame: int | None
    confidence: float


def curves_now(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> outlines.Curves:
    """The curves of an outline at the current frame, in fractions of the picture: drawn, carried, or straight where
    nothing is carried yet. EffectError, MediaError: there are none."""
    frame = scene.frame_current
    if not strips.is_carried(effect.regions[index]):
        return outlines.curves(snapshot.strokes_at(scene, effect, strip, index, frame))
    file, shown = snapshot.carried_outline(scene, effect, strip, index, (frame,))
    with closing(_opened(file)) as mattes:
        return mattes.curves(min(shown[frame], mattes.count - 1))


@lru_cache(1)  # to open a movie at each frame that is passed would be slow; it is opened again where it is read
def _opened(file: CarriedFile) -> CarriedMattes:
    return file.open()


def shown_curves(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> outlines.Curves:
    """As curves_now, read once until something changes: for what is drawn."""
    key = effect.scene.session_uid, strip.name, index, scene.frame_current
    return revision.until_change("outline", key, lambda: curves_now(scene, effect, strip, index))


def add(effect: PropertyGroup, strip: Strip, region: PropertyGroup, curve: np.ndarray, frame: int) -> None:
    """Adds a curve (n, 2), in fractions of the picture, to the drawing of a region at a timeline frame. EffectError: as
    draw."""
    draw(effect, strip, region, [curve], frame, adds=True)


def draw(
    effect: PropertyGroup, strip: Strip, region: PropertyGroup, curves: Strokes, frame: int, *, adds: bool = False
) -> None:
    """Makes curves the drawing of a region at a timeline frame; in place of one that is there, unless it adds to it.
    EffectError: the strip is scaled to nothing."""
    to_image = geometry.picture_to_image(strip, annotations.picture_size(effect))
    if not geometry.is_invertible(to_image):
        raise EffectError(rpt_('strip "{strip}" is scaled to nothing').format(strip=strip.name))
    layer = layer_of(effect, region) or region_edits.new_layer(effect, region)
    there = [drawing for drawing in layer.frames if drawing.frame_number == frame]
    while there and not adds:
        layer.frames.remove(there.pop())
    drawing = there[0] if there else layer.frames.new(frame)
    for points in curves:
        annotations.add_stroke(drawing, mapped(to_image, np.asarray(points)))
    revision.changed()  # Blender tells of no strokes


def picture_now(scene: Scene, effect: PropertyGroup, strip: Strip) -> np.ndarray:
    """The source's frame (H, W, 3) uint8 that is seen at the current frame. EffectError, MediaError: there is none."""
    shown = snapshot.take(scene, effect, strip, (scene.frame_current,))
    with effect_source.open_source(shown) as source:
        samples = source.read(effect_source.clip_of(shown, source).shown(scene.frame_current).source_frame)
        return flow.displayed(samples, source.transfer, source.alpha)


def nearest(effect: PropertyGroup, index: int, frame: int) -> int:
    """The timeline frame of a region's drawing that is nearest to a frame; that itself, where there is none."""
    layer = layer_of(effect, effect.regions[index])
    drawn = [drawing.frame_number for drawing in layer.frames] if layer else []
    return min(drawn, key=lambda each: abs(each - frame), default=frame)


def outline_it(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> bool:
    """Makes a region the outline of the subject that its strokes run over, or are drawn around, at the current frame;
    what was drawn at other frames of an outline stays. Whether there is one. EffectError, MediaError: there are no
    strokes, or no picture."""
    region, frame = effect.regions[index], scene.frame_current
    there = snapshot.region_at(scene, effect, strip, index, (frame,))
    strokes = there.drawings.at(frame) if region.kind == "OUTLINE" else there.at(frame).strokes
    if not len(strokes):
        raise EffectError(rpt_("The region has no strokes at the current frame"))
    picture = picture_now(scene, effect, strip)
    height, width = outlining.working_shape(picture)
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
    """What gives the mattes of an outline (media.carried_mattes.CarriedFile), and which frames of the source the frames
    of its strip show, by timeline frame. EffectError, MediaError: nothing is carried."""
    frames = range(strip.left_handle, strip.right_handle)
    file, shown = snapshot.carried_outline(scene, effect, strip, index, frames)
    return file, {int(frame): number for frame, number in shown.items()}


def next_needed(scene: Scene, effect: PropertyGroup, strip: Strip, index: int) -> Needed:
    """Where in the strip a drawing of an outline that is carried helps most: of the stretches between drawings, and
    beyond the first and the last, in the one that is least sure altogether; there, where as much of the doubt lies
    before it as behind it. EffectError, MediaError: nothing is carried."""
    file, shown = carried_frames(scene, effect, strip, index)
    drawn = [number for number, _curves in file.drawings]
    stretches: dict[int, list[tuple[int, int, float]]] = {}
    with closing(file.open()) as mattes:
        for number, frame in sorted({number: frame for frame, number in shown.items()}.items()):
            sure = mattes.confidence(number) or 0.0  # None: too far from all drawings
            if number not in drawn and sure < SURE:
                stretches.setdefault(bisect(drawn, number), []).append((number, frame, sure))
    if not stretches:
        return Needed(frame=None, confidence=SURE)
    worst = max(stretches.values(), key=lambda stretch: sum(1 - sure for *_, sure in stretch))
    doubts = np.cumsum([1 - sure for *_, sure in worst])
    _number, frame, sure = worst[int(np.searchsorted(doubts, doubts[-1] / 2))]
    return Needed(frame=frame, confidence=sure)
