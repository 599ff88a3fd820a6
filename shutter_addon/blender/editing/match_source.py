"""An effect goes along with its source.

What could only be wrong follows by itself: the rate of the effect's scene, and the size of its picture. What an editor
may have set on purpose is matched when asked for: place, crop, flip and colour of the strips, and their range.
Scribbles stay where they lie on the picture.
"""

from collections import Counter
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import bpy
import mathutils
import numpy as np
from bpy.app.translations import pgettext_n as n_

from ...core import revision
from ...core.model.scribbles import mapped
from ...media import MediaError
from ..data import annotations, fcurves, geometry, source_media, strips
from . import add_effect

# What a strip looks like: what it is called, and the names of the strip's properties and groups.
_LOOK = {
    n_("transform"): ("transform",),
    n_("crop"): ("crop",),
    n_("flip"): ("use_flip_x", "use_flip_y"),
    n_("color"): ("color_multiply", "color_saturation", "multiply_alpha"),
}
_RANGE = n_("range")
_KEPT = 256
_shown = revision.UntilChange()
_sizes: dict[tuple, tuple[int, int] | None] = {}  # of media, by their keys: their headers are read once


def forget() -> None:
    """Forgets what media were read, before another file is loaded."""
    _sizes.clear()


def follow(scene) -> None:
    """Gives the effect scenes of a scene's effects its rate and the size of their sources. A second call changes
    nothing."""
    for effect in scene.virtual_shutter.effects:
        if effect.scene is not None and effect.scene.library is None:
            _follow_rate(scene, effect.scene.render)
            _follow_size(effect)


def _follow_rate(scene, render) -> None:
    for name in ("fps", "fps_base"):
        if getattr(render, name) != getattr(scene.render, name):
            setattr(render, name, getattr(scene.render, name))


def _follow_size(effect) -> None:
    pairs = parts(effect)
    size = next((size for _part, source in pairs if (size := _size(source)) is not None), None)
    if size is not None and size != annotations.picture_size(effect):
        with _scribbles_kept(effect):
            effect.scene.render.resolution_x, effect.scene.render.resolution_y = size


def _size(source) -> tuple[int, int] | None:
    """Width and height of a source's picture, as a scene can have them; None: it cannot be read."""
    with suppress(MediaError):
        key = source_media.media_key(source)
        if key not in _sizes:
            while len(_sizes) >= _KEPT:
                del _sizes[next(iter(_sizes))]
            _sizes[key] = None  # it is not tried again and again
            medium = source_media.open_media(source)
            medium.close()
            side = bpy.types.RenderSettings.bl_rna.properties["resolution_x"]
            _sizes[key] = tuple(min(max(n, side.hard_min), side.hard_max) for n in (medium.width, medium.height))
        return _sizes[key]
    return None


def parts(effect) -> list[tuple]:
    """The strips of an effect, one, or the parts of one that was cut; each with its source."""
    scene = effect.id_data
    own = [strip for strip in strips.effect_strips(scene) if strip.scene == effect.scene]
    pairs = [(strip, strips.nearest_source(scene, effect, strip)) for strip in own]
    return [(strip, source) for strip, source in pairs if source is not None]


class Shown(NamedTuple):
    """What panels say of an effect beside its source: what `match` would change, in words to be translated; whether it
    lacks modifiers of its source, and whether effect strips of Blender's are on that; None: it has no source."""

    differences: list[str]
    lacks_modifiers: bool
    has_effects: bool


def shown(effect) -> Shown | None:
    """For what is drawn: worked out once until something changes."""
    return _shown.get(effect.scene.session_uid, lambda: _compare(effect))


def _compare(effect) -> Shown | None:
    if not (pairs := parts(effect)):
        return None
    lacks = any(missing_modifiers(part, source) for part, source in pairs)
    return Shown(differences(effect), lacks, any(effects_on(effect.id_data, source) for _part, source in pairs))


def differences(effect) -> list[str]:
    """What match would change, in words to be translated."""
    pairs = parts(effect)
    looks = [(_looks(part), _looks(source)) for part, source in pairs]
    words = [word for word in _LOOK if any(part[word] != source[word] for part, source in looks)]
    if any((goal.left, goal.right) != _range(goal.part) for goal in _goals(effect, pairs)):
        words.append(_RANGE)
    return words


def match(effect) -> list[tuple]:
    """Gives the effect's strips the look and the range of their sources. Returns the strips that cannot have the whole
    range, each with the neighbour in its channel that is in the way."""
    scene, pairs = effect.id_data, parts(effect)
    with _scribbles_kept(effect):
        for part, source in pairs:
            add_effect.copy_look(source, part)
            for name in (name for names in _LOOK.values() for name in names):
                old, new = f"{source.path_from_id()}.{name}", f"{part.path_from_id()}.{name}"
                fcurves.remove_curves(scene, new)
                fcurves.copy_curves(scene, old, scene, new)
    goals = _goals(effect, pairs)
    _slip(scene, goals)
    for goal in goals:
        goal.part.right_handle = max(goal.part.right_handle, goal.right)  # or the left one could not pass it
        goal.part.left_handle, goal.part.right_handle = goal.left, goal.right
    return [(goal.part, goal.neighbor) for goal in goals if goal.neighbor is not None]


def _looks(strip) -> dict[str, str]:
    """What a strip looks like: values and keys, as words: "not a number" is never the same again."""
    path = f"{strip.path_from_id()}."
    curves = [curve for curve in fcurves.curves_under(strip.id_data, path) if not curve.mute]
    return {
        word: repr([(_plain(getattr(strip, name)), _keyed(curves, path + name)) for name in names])
        for word, names in _LOOK.items()
    }


def _plain(value):
    if isinstance(value, bpy.types.bpy_struct):
        names = [prop.identifier for prop in value.bl_rna.properties if not prop.is_readonly]
        return [_plain(getattr(value, name)) for name in names]
    return tuple(value) if isinstance(value, bpy.types.bpy_prop_array | mathutils.Vector) else value


def _keyed(curves, path: str) -> list:
    return sorted(
        (
            (curve.data_path.removeprefix(path), curve.array_index, curve.extrapolation),
            [(*key.handle_left, *key.co, *key.handle_right, key.interpolation) for key in curve.keyframe_points],
        )
        for curve in curves
        if curve.data_path.startswith(path)
    )


def _range(strip) -> tuple[int, int]:
    return strip.left_handle, strip.right_handle


@dataclass(frozen=True)
class _Goal:
    """The handles that a part of an effect would have from its source; neighbor: what stops it short of them."""

    part: Any
    source: Any
    left: int
    right: int
    neighbor: Any = None


def _goals(effect, pairs) -> list[_Goal]:
    """An edge where another part of the effect goes on with the same source stays where it is."""
    own = {part.name: _below(effect, part, source) for part, source in pairs}
    goals = []
    for part, source in pairs:
        names = {s.name for s in own[part.name]}
        beside = [other for other, _source in pairs if any(s.name in names for s in own[other.name])]
        left, right = min(s.left_handle for s in own[part.name]), max(s.right_handle for s in own[part.name])
        left = part.left_handle if any(p.left_handle < part.left_handle for p in beside) else left
        right = part.right_handle if any(p.right_handle > part.right_handle for p in beside) else right
        goals.append(_with_room(_Goal(part=part, source=source, left=left, right=right)))
    return goals


def _below(effect, part, source) -> list:
    """The part's source, and those of the source's own parts, if it was cut, that lie below it."""
    same = [s for s in part.id_data.sequence_editor.strips_all if s.virtual_shutter_source == effect.source]
    same = [s for s in same if s.type == source.type and strips.origin(s) == strips.origin(source)]
    return [s for s in same if s == source or (s.left_handle < part.right_handle and part.left_handle < s.right_handle)]


def _with_room(goal: _Goal) -> _Goal:
    """The goal, short of the strips in the part's channel; where it stands, if they leave no room at all."""
    part = goal.part
    level = (part.parent_meta() or part.id_data.sequence_editor).strips
    beside = [strip for strip in level if strip.channel == part.channel and strip != part]
    before = [s for s in beside if s.left_handle < part.left_handle and s.right_handle > goal.left]
    after = [s for s in beside if s.left_handle > part.left_handle and s.left_handle < goal.right]
    first = max(before, key=lambda strip: strip.right_handle, default=None)
    last = min(after, key=lambda strip: strip.left_handle, default=None)
    left = first.right_handle if first else goal.left
    right = last.left_handle if last else goal.right
    left, right = (left, right) if left < right else _range(part)
    return replace(goal, left=left, right=right, neighbor=first or last)


def _slip(scene, goals: list[_Goal]) -> None:
    """Has the effect's content, and with it its keys, go along with a source that has moved as a whole, or that begins
    before it: an effect shows nothing but its first frame there."""
    for goal in goals:
        part, frames = goal.part, int(goal.source.content_start - goal.part.content_start)
        moved = frames == goal.left - part.left_handle == goal.right - part.right_handle
        if frames and (moved or (frames < 0 and goal.left < part.content_start)):
            # Blender has an operator only, which takes the selection.
            with _selected(scene, [goal.part for goal in goals]), bpy.context.temp_override(sequencer_scene=scene):
                bpy.ops.sequencer.slip(offset=frames, ignore_connections=True)
            return


@contextmanager
def _selected(scene, chosen):
    """These strips are the selected ones meanwhile."""
    before = [(strip, strip.select) for strip in scene.sequence_editor.strips_all]
    for strip, _is_selected in before:
        strip.select = strip in chosen
    yield
    for strip, is_selected in before:
        strip.select = is_selected


@contextmanager
def _scribbles_kept(effect):
    """Has scribbles stay on the effect's picture while it is laid elsewhere: every drawing at its own frame, on the
    part that shows it, or the nearest to it."""
    layers = {region.layer: annotations.layer_of(effect, region) for region in effect.regions}
    drawings = [drawing for layer in layers.values() if layer for drawing in layer.frames]
    own_parts = [part for part, _source in parts(effect)]
    shown = [min(own_parts, key=lambda part: _apart(part, drawing.frame_number)) for drawing in drawings]
    before = [_place(effect, part, drawing.frame_number) for part, drawing in zip(shown, drawings, strict=True)]
    yield
    for part, drawing, old in zip(shown, drawings, before, strict=True):
        new = _place(effect, part, drawing.frame_number)
        if geometry.is_invertible(old) and geometry.is_invertible(new) and not np.array_equal(old, new):
            _move(drawing, new @ np.linalg.inv(old))


def _apart(strip, frame: int) -> int:
    return max(strip.left_handle - frame, frame - strip.right_handle + 1, 0)


def _place(effect, part, frame: int) -> np.ndarray:
    """Where a part's picture lies on the image at a frame, as geometry.picture_to_image has it."""
    path = f"{part.path_from_id()}.transform."
    curves = [curve for curve in fcurves.curves_under(effect.id_data, path) if not (curve.mute or curve.is_empty)]
    moved = {curve.data_path.removeprefix(path): curve.evaluate(frame) for curve in curves}
    return geometry.picture_to_image(part, annotations.picture_size(effect), **moved)


def _move(drawing, change: np.ndarray) -> None:
    """Moves the strokes of a drawing on the image."""
    for stroke in drawing.strokes:
        points = np.empty((len(stroke.points), 3), np.float32)
        stroke.points.foreach_get("co", points.ravel())
        points[:, :2] = mapped(change, points[:, :2].astype(np.float64))
        stroke.points.foreach_set("co", points.ravel())


def missing_modifiers(part, source) -> list:
    """The source's modifiers that its effect lacks: the engine reads the medium, which has none."""
    own = Counter(modifier.type for modifier in part.modifiers)
    lacking = []
    for modifier in (modifier for modifier in source.modifiers if not modifier.mute):
        own[modifier.type] -= 1
        if own[modifier.type] < 0:
            lacking.append(modifier)
    return lacking


def copy_modifiers(effect) -> None:
    """Gives the effect's strips the modifiers of their sources that they lack, keys included."""
    scene = effect.id_data
    for part, source in parts(effect):
        if not (lacking := missing_modifiers(part, source)):
            continue
        append_modifiers(scene, source, part, lacking)


def append_modifiers(scene, source, part, chosen: list | None = None) -> None:
    """Gives a strip the modifiers of another one, keys included; chosen: these alone."""
    if not source.modifiers:
        return
    count = len(part.modifiers)
    active, scene.sequence_editor.active_strip = scene.sequence_editor.active_strip, source
    # Blender has an operator only, which takes all modifiers of the active strip.
    with _selected(scene, [part]), bpy.context.temp_override(sequencer_scene=scene):
        bpy.ops.sequencer.strip_modifier_copy(type="APPEND")
    scene.sequence_editor.active_strip = active
    for old, new in list(zip(source.modifiers, part.modifiers[count:], strict=True)):
        if chosen is None or old in chosen:
            fcurves.copy_curves(scene, f"{old.path_from_id()}.", scene, f"{new.path_from_id()}.")
        else:
            part.modifiers.remove(new)


def effects_on(scene, source) -> list:
    """The effect strips of Blender's that have a source as input: what they make of it, the engine does not see."""
    inputs = ("input_1", "input_2")
    return [s for s in scene.sequence_editor.strips_all if any(getattr(s, name, None) == source for name in inputs)]
