"""Compare an effect strip with its source, and match it on request: transform, crop, flip, color and range.

Strokes keep their place on the picture. What can only be a mistake is corrected without asking, by
reconcile.follow_sources.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import bpy
import numpy as np
from bpy.app.translations import pgettext_n as n_
from bpy.types import AnnotationFrame, FCurve, PropertyGroup, Scene, Strip

from ...core import revision
from ...core.model.scribbles import mapped
from ..data import fcurves, sampled, strips
from ..data.annotations import layers_of
from ..data.property_copy import for_a_while
from . import add_effect


def strip_and_source(effect: PropertyGroup) -> list[Strip]:
    """Return [effect strip, source strip] of an effect; [] if one of them is missing."""
    shown = strips.with_sources(effect.id_data)
    return next(([each.strip, each.source] for each in shown if each.effect == effect), [])


class SourceMatch(NamedTuple):
    """What panels show about the source strip of an effect, and how the effect strip differs from it.

    Attributes:
        source: Name of the source strip.
        differences: English labels of what `match` would change: keys of add_effect.LOOK, such as "crop", and "range".
        lacks_modifiers: Whether the source has more unmuted modifiers of some type than the effect strip has of that
            type. An effect reads the source's file, so modifiers of the source do not show in it.
        has_effects: Whether strips such as Glow or Speed Control have the source as input. Their result does not show
            in the effect either.
    """

    source: str
    differences: list[str]
    lacks_modifiers: bool
    has_effects: bool


def shown(effect: PropertyGroup) -> SourceMatch | None:
    """Return what panels show about an effect's source, cached until something changes; None: a strip is missing."""
    return revision.until_change("source", effect.scene.session_uid, lambda: _compare(effect))


def _compare(effect: PropertyGroup) -> SourceMatch | None:
    if not (pair := strip_and_source(effect)):
        return None
    strip, source = pair
    look, wanted = _looks(strip), _looks(source)
    words = [word for word in add_effect.LOOK if look[word] != wanted[word]]
    if _goal(effect, strip, source)[:2] != (strip.left_handle, strip.right_handle):
        words.append(n_("range"))
    # The engine reads the file, without modifiers.
    modifiers = Counter(modifier.type for modifier in source.modifiers if not modifier.mute)
    lacks_modifiers = bool(modifiers - Counter(modifier.type for modifier in strip.modifiers))
    return SourceMatch(source.name, words, lacks_modifiers, bool(effects_on(effect.id_data, source)))


def match(effect: PropertyGroup) -> Strip | None:
    """Copy the look (transform, crop, flip, color) with its keyframes, and the range, from the source to its effect.

    Strokes stay where they are on the picture.

    Returns:
        A neighbor in the same channel because of which the effect strip does not get the whole range; None: none is in
        the way.
    """
    scene, (strip, source) = effect.id_data, strip_and_source(effect)
    with scribbles_kept(effect, strip):
        add_effect.copy_look(source, strip, keys=True)
    left, right, neighbor = _goal(effect, strip, source)
    _slip(scene, strip, source, left, right)
    strip.right_handle = max(strip.right_handle, right)  # otherwise the left handle could not pass it
    strip.left_handle, strip.right_handle = left, right
    return neighbor


def _looks(strip: Strip) -> dict[str, str]:
    """Describe a strip's look in texts: strips look alike if their texts are equal.

    Numbers would not do, because NaN never equals NaN.

    Returns:
        For each key of add_effect.LOOK, such as "crop": the values and unmuted F-curves of its properties, as a text.
    """
    path = f"{strip.path_from_id()}."
    curves = [curve for curve in fcurves.curves_under(strip.id_data, path) if not curve.mute]
    return {
        word: repr([(_values(strip, name), _keyed(curves, path + name)) for name in names])
        for word, names in add_effect.LOOK.items()
    }


def _values(strip: Strip, name: str) -> list:
    values = [getattr(owner, prop) for owner, prop in add_effect.settings(strip, name)]
    values = [1.0 if value == strips.IN_CODE_VALUES else value for value in values]
    return [tuple(value) if isinstance(value, Iterable) else value for value in values]


def _keyed(curves: list[FCurve], path: str) -> list:
    found = []
    for curve in (curve for curve in curves if curve.data_path.startswith(path)):
        keys = [(*key.handle_left, *key.co, *key.handle_right, key.interpolation) for key in curve.keyframe_points]
        found.append((curve.data_path.removeprefix(path), curve.array_index, curve.extrapolation, keys))
    return sorted(found)


def _goal(effect: PropertyGroup, strip: Strip, source: Strip) -> tuple[int, int, Strip | None]:
    """Return the left and right handle that `match` would give an effect strip, and a strip that is in the way.

    The range is that of the source. If the source was cut, it is that of all its parts which share frames with the
    strip. A handle stays where it is if another effect strip of the source, or of one of these parts, reaches farther
    on that side. Neighbors in the same channel limit the range. If they leave no frame, both handles stay.

    Returns:
        Left handle; right handle; the neighbor before or, if that is not in the way, after the strip; None: none is.
    """
    parts = (s for s in effect.id_data.sequence_editor.strips_all if s.virtual_shutter_source == effect.source)
    parts = (s for s in parts if s.type == source.type and strips.origin(s) == strips.origin(source))
    below = [s for s in parts if s == source or strips.overlap(s, strip)]
    others = [other for _effect, other, by in strips.with_sources(effect.id_data) if by in below and other != strip]
    left, right = min(s.left_handle for s in below), max(s.right_handle for s in below)
    left = strip.left_handle if any(o.left_handle < strip.left_handle for o in others) else left
    right = strip.right_handle if any(o.right_handle > strip.right_handle for o in others) else right
    level = (strip.parent_meta() or strip.id_data.sequence_editor).strips
    beside = [other for other in level if other.channel == strip.channel and other != strip]
    before = [s for s in beside if s.left_handle < strip.left_handle and s.right_handle > left]
    after = [s for s in beside if s.left_handle > strip.left_handle and s.left_handle < right]
    first = max(before, key=lambda other: other.right_handle, default=None)
    last = min(after, key=lambda other: other.left_handle, default=None)
    left, right = first.right_handle if first else left, last.left_handle if last else right
    left, right = (left, right) if left < right else (strip.left_handle, strip.right_handle)
    return left, right, first or last


def _slip(scene: Scene, strip: Strip, source: Strip, left: int, right: int) -> None:
    """Move the content of an effect strip, within its handles, to where its source's content begins, if necessary.

    It is necessary if the source was moved as a whole: content and handles by the same number of frames. It also is if
    the source's content begins earlier, and the strip would otherwise begin before its own and repeat the first frame
    until there. The effect's keyframes and drawings follow at the next update (reconcile).

    Args:
        scene: The scene with both strips.
        left: Left handle that the effect strip will get.
        right: Right handle that the effect strip will get.
    """
    frames = int(source.content_start - strip.content_start)
    moved = frames == left - strip.left_handle == right - strip.right_handle
    if frames and (moved or (frames < 0 and left < strip.content_start)):
        with add_effect.selecting(scene, [strip]):
            bpy.ops.sequencer.slip(offset=frames, ignore_connections=True)


@contextmanager
def scribbles_kept(effect: PropertyGroup, strip: Strip) -> Iterator[None]:
    """Keep strokes in their place on the effect's picture while a `with` block moves or resizes the picture."""
    before = places(effect, strip)
    yield
    put_back(effect, strip, before)


def places(effect: PropertyGroup, strip: Strip) -> list[np.ndarray | None]:
    """Return, for each drawing of an effect, the matrix (3, 3) from the sequencer's image to the picture at its frame.

    `put_back` compares these from before and after a change. Points of the image are pixels from its center, y up;
    those of the picture are fractions 0 to 1.

    Returns:
        A matrix for each drawing, in the order of _drawings. None: at its frame, the picture has a side of fewer than 4
        pixels, or the strip's transform is not finite.
    """
    frames = [drawing.frame_number for drawing in _drawings(effect)]
    placement = sampled.Sampling.of(effect.id_data, effect, strip, frames).placement
    found = [sampled.tried(placement.at, frame) for frame in frames]
    return [place if isinstance(place, np.ndarray) else None for place in found]


def put_back(effect: PropertyGroup, strip: Strip, before: list[np.ndarray | None]) -> None:
    """Move an effect's strokes along with its picture, so that they stay in place on it.

    A drawing whose place on the picture is unknown (None), before the change or now, is left alone.

    Args:
        before: What `places` returned before the picture was moved or resized.
    """
    for drawing, old, new in zip(_drawings(effect), before, places(effect, strip), strict=True):
        if old is not None and new is not None and not np.array_equal(old, new):
            change = np.linalg.inv(new) @ old
            for stroke in drawing.strokes:
                points = fcurves.numbers(stroke.points, "co", size=3)
                points[:, :2] = mapped(change, points[:, :2].astype(np.float64))
                stroke.points.foreach_set("co", points.ravel())


def _drawings(effect: PropertyGroup) -> list[AnnotationFrame]:
    layers = {layer.info: layer for region in effect.regions for layer in layers_of(effect, region)}
    return [drawing for layer in layers.values() for drawing in layer.frames]


def append_modifiers(scene: Scene, source: Strip, part: Strip) -> None:
    """Copy all modifiers of the strip `source`, with their keyframes, to the end of those of the strip `part`."""
    if not source.modifiers:
        return
    count = len(part.modifiers)
    active = scene.sequence_editor, "active_strip", source
    with for_a_while([active]), add_effect.selecting(scene, [part]):  # it copies all of the active strip
        bpy.ops.sequencer.strip_modifier_copy(type="APPEND")
    for old, new in list(zip(source.modifiers, part.modifiers[count:], strict=True)):
        fcurves.copy_curves(scene, f"{old.path_from_id()}.", scene, f"{new.path_from_id()}.")


def effects_on(scene: Scene, source: Strip) -> list[Strip]:
    """Return the strips, such as Glow, whose input is the strip `source`. Our engine does not see their result."""
    inputs = ("input_1", "input_2")
    return [s for s in scene.sequence_editor.strips_all if any(getattr(s, name, None) == source for name in inputs)]
