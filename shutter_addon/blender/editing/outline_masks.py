"""An outline as a Blender mask with shape keys, and a mask as an outline."""

from collections.abc import Iterator
from contextlib import closing, contextmanager

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Mask, MaskSpline, PropertyGroup, Scene, Strip

from ...core.messages import EffectError
from ...core.model import outlines
from ...core.model.keyframes import Ease
from ...media.outlining import traced
from ..data import annotations, fcurves, mask_reading, snapshot, strips
from ..data.property_copy import for_a_while
from . import outline_drawings, region_edits


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
        frame: traced(mask_reading.mask_at(mask, mask.frame_start + number).values(*size))
        for frame, number in _drawn_frames(scene, effect, strip, mask).items()
    }
    if not any(shapes.values()):
        raise EffectError(rpt_('mask "{mask}" encloses nothing in the strip').format(mask=mask.name))
    region = region_edits.add_region(effect, shutter, "OUTLINE", mask.name)
    region.motion, region.between = "LOCATION", "STRAIGHT"
    for frame, curves in _in_order(shapes, size[0] / size[1]).items():
        outline_drawings.draw(effect, strip, region, curves, frame)
    return region


def _keys(
    scene: Scene, effect: PropertyGroup, strip: Strip, index: int, step: int
) -> list[tuple[int, outlines.Curves]]:
    """The curves of an outline, at the source's frames that get a shape key, ascending."""
    if not (strips.is_carried(effect.regions[index]) and step):
        return sorted(snapshot.drawn_outline(scene, effect, strip, index).items())
    file, _shown = snapshot.carried_outline(scene, effect, strip, index, ())
    drawn = [frame for frame, _curves in file.drawings]
    frames = sorted({*drawn, *range(drawn[0], drawn[-1], step)}) if drawn else []
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
