"""Drawings of an outline that are made of what is carried: to mend it, and where one is needed next; and an outline
as a Blender mask with shape keys, and a mask as an outline.

Annotations have no key types in Blender 5.2: a drawing that was made and one's own look alike in the Dope Sheet.
"""

from bisect import bisect
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import lru_cache
from typing import NamedTuple

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Mask, MaskSpline, PropertyGroup, Scene, Strip

from ...core import revision
from ...core.messages import EffectError
from ...core.model import outlines, scribbles
from ...core.model.keyframes import Ease
from ...core.model.scribbles import mapped
from ...media import flow, outlining
from ...media.carried_mattes import CarriedFile, CarriedMattes
from ...media.subject_mattes import SubjectFile
from ..data import annotations, fcurves, mask_reading, snapshot, strips
from ..data.annotations import layer_of
from ..data.property_copy import for_a_while
from ..rendering import effect_source
from . import region_edits

Strokes = outlines.Curves | list[np.ndarray]  # (n, 2) in fractions of the picture
SURE_SUBJECT = 0.5  # confidence from which on a subject needs no correction
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
    to_image = annotations.picture_to_image(strip, annotations.picture_size(effect))
    if not annotations.is_invertible(to_image):
        raise EffectError(rpt_('strip "{strip}" is scaled to nothing').format(strip=strip.name))
    name = "outline_layer" if region.kind == "SUBJECT" else "layer"
    layer = layer_of(effect, region, name) or region_edits.new_layer(effect, region, name)
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
    if effect.regions[index].kind == "SUBJECT":
        return _least_sure(file, shown)
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


def _least_sure(file: SubjectFile, shown: dict[int, int]) -> Needed:
    """The frame of a subject that is least sure of those whose mattes are made."""
    with closing(file.open()) as mattes:
        sure = {frame: sure for frame, number in shown.items() if (sure := mattes.confidence(number)) is not None}
    frame = min(sure, key=sure.__getitem__, default=None)
    is_sure = frame is None or sure[frame] >= SURE_SUBJECT
    return Needed(frame=None, confidence=SURE_SUBJECT) if is_sure else Needed(frame=frame, confidence=sure[frame])


def to_mask(context: Context, of: tuple[Scene, PropertyGroup, Strip], index: int, step: int) -> Mask:
    """A new mask of an outline, whose frames are the source's, from its start on; each curve that comes and goes has a
    layer, and what two of them enclose lies outside.

    of: scene, effect and strip
    step: how many frames from one shape key to the next, between the drawings of what is carried; 0: drawings alone
    EffectError, MediaError: nothing is drawn, nothing can be carried, or there is no window to write shape keys in."""
    scene, effect, strip = of
    keys = _keys(scene, effect, strip, index, step)
    if not any(curves for _frame, curves in keys):
        raise EffectError(rpt_("Nothing is drawn in the outline"))
    size = annotations.picture_size(effect)
    last = int(snapshot.last_shown(scene, effect, strip))
    mask = bpy.data.masks.new(effect.regions[index].name)
    mask.frame_start, mask.frame_end = 1, max(last, keys[-1][0]) + 1
    chains = outlines.chains(keys, size[0] / size[1])
    try:
        with _mask_editor(context, mask):
            for number, chain in enumerate(chains, 1):
                _add_layer(mask, f"{mask.name} {number}", chain, size)
            _insert_keys(context, mask, chains, size)
    except (EffectError, RuntimeError):
        bpy.data.masks.remove(mask)
        raise
    return mask


def from_mask(scene: Scene, effect: PropertyGroup, strip: Strip, shutter: PropertyGroup, mask: Mask) -> PropertyGroup:
    """A new region: an outline with a drawing for each frame at which something is said of a mask. EffectError,
    MediaError: the mask cannot be read or encloses nothing there, or OpenCV is missing."""
    size = annotations.picture_size(effect)
    shapes = {
        frame: outlining.traced(mask_reading.mask_at(mask, mask.frame_start + number).values(*size))
        for frame, number in _drawn_frames(scene, effect, strip, mask).items()
    }
    if not any(shapes.values()):
        raise EffectError(rpt_('mask "{mask}" encloses nothing in the strip').format(mask=mask.name))
    region = region_edits.add_region(effect, shutter, "OUTLINE", mask.name)
    region.motion, region.between = "LOCATION", "STRAIGHT"
    for frame, curves in _in_order(shapes, size[0] / size[1]).items():
        draw(effect, strip, region, curves, frame)
    return region


def _keys(
    scene: Scene, effect: PropertyGroup, strip: Strip, index: int, step: int
) -> list[tuple[int, outlines.Curves]]:
    """The curves of an outline, at the source's frames that get a shape key, ascending."""
    if not (strips.is_carried(effect.regions[index]) and step):
        return sorted(snapshot.drawn_outline(scene, effect, strip, index).items())
    file, _shown = snapshot.carried_outline(scene, effect, strip, index, ())
    drawn = [frame for frame, _curves in file.drawings]
    if effect.regions[index].kind == "SUBJECT":
        drawn += snapshot.source_frames(scene, effect, strip, (strip.left_handle, strip.right_handle - 1)).values()
    frames = sorted({*drawn, *range(min(drawn), max(drawn), step)}) if drawn else []
    with closing(file.open()) as mattes:
        return [(frame, mattes.curves(frame)) for frame in frames]


def _in_mask(points: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Points (..., 2) in mask space (core.model.masks), of fractions of the picture."""
    return (points - 0.5) * np.array(size) / max(size) + 0.5


def _add_layer(mask: Mask, name: str, chain: outlines.Chain, size: tuple[int, int]) -> None:
    """A layer of one spline, which is there from its first frame on until it is gone."""
    layer = mask.layers.new(name=name)
    layer.blend, layer.alpha = "DIFFERENCE", 1.0  # Blender's own begin with 0 where a script makes them
    spline = layer.splines.new()
    spline.points.add(chain.points.shape[1] - len(spline.points))
    spline.use_cyclic = True
    for point in spline.points:
        point.handle_type = "FREE"
    _place(spline, _in_mask(chain.points[0], size))
    keys: list[tuple[float, float, Ease]] = [(1.0, 0.0, "constant")] if chain.frames[0] else []
    keys.append((chain.frames[0] + 1.0, 1.0, "constant"))
    if chain.gone is not None:
        keys.append((chain.gone + 1.0, 0.0, "constant"))
    if len(keys) > 1:
        fcurves.set_keys(mask, f'layers["{bpy.utils.escape_identifier(layer.name)}"].alpha', 0, keys)


def _place(spline: MaskSpline, points: np.ndarray) -> None:
    flat = np.ascontiguousarray(points, np.float32).ravel()
    for name in ("co", "handle_left", "handle_right"):
        spline.points.foreach_set(name, flat)


def _insert_keys(context: Context, mask: Mask, chains: list[outlines.Chain], size: tuple[int, int]) -> None:
    """Blender gives shape keys to selected layers, at its current frame."""
    edited = context.window.scene
    with for_a_while([(edited, "frame_current", edited.frame_current)]):
        for frame in sorted({frame for chain in chains for frame in chain.frames}):
            edited.frame_current = frame + 1
            context.window.view_layer.update()  # or the operator would, and put the points where the last key has them
            for layer, chain in zip(mask.layers, chains, strict=True):
                has_key = frame in chain.frames
                layer.hide = not has_key
                for point in layer.splines[0].points:
                    point.select = has_key
                if has_key:
                    _place(layer.splines[0], _in_mask(chain.points[chain.frames.index(frame)], size))
            bpy.ops.mask.shape_key_insert()
        for layer in mask.layers:
            layer.hide = False


@contextmanager
def _mask_editor(context: Context, mask: Mask) -> Iterator[None]:
    """Where Blender's operators on masks run: the area becomes an editor of one for a moment. EffectError: there is no
    window."""
    window = context.window
    if window is None:
        raise EffectError(rpt_("A mask is written in a window of Blender, and there is none"))
    area = context.area or window.screen.areas[0]
    with for_a_while([(area, "ui_type", "IMAGE_EDITOR")]):
        space = area.spaces.active
        with for_a_while([(space, "mode", "MASK"), (space, "mask", mask)]):
            region = next(region for region in area.regions if region.type == "WINDOW")
            with context.temp_override(window=window, area=area, region=region):
                yield


def _drawn_frames(scene: Scene, effect: PropertyGroup, strip: Strip, mask: Mask) -> dict[int, int]:
    """The timeline frames of the strip that get a drawing, and the source's that they show: those of a mask's keys, and
    the ends, where it has some beyond them."""
    frames = range(strip.left_handle, strip.right_handle)
    shown = snapshot.source_frames(scene, effect, strip, frames)
    wanted = [frame - mask.frame_start for frame in mask_reading.key_frames(mask)] or [0]
    numbers = {round(min(max(number, min(shown.values())), max(shown.values()))) for number in wanted}
    nearest = {min(frames, key=lambda frame: abs(shown[frame] - number)): number for number in sorted(numbers)}
    return {frame: shown[frame] for frame in sorted(nearest)}


def _in_order(shapes: dict[int, outlines.Curves], aspect: float) -> dict[int, outlines.Curves]:
    """Curves by frame, so that those go into each other, as they go straight from drawing to drawing, that belong
    together: those first that are there all the time."""
    chains = outlines.chains(sorted(shapes.items()), aspect)
    chains.sort(key=lambda chain: -len(chain.frames))
    return {
        frame: outlines.curves([chain.points[chain.frames.index(frame)] for chain in chains if frame in chain.frames])
        for frame in shapes
    }
