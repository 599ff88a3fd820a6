"""Compare an effect strip with its source, and match it on request: transform, crop, flip and color.

Strokes keep their place on the picture. What can only be wrong is corrected automatically by reconcile.follow_sources.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import bpy
import numpy as np
from bpy.types import AnnotationFrame, FCurve, PropertyGroup, Scene, Strip

from ...core import revision
from ...core.model.scribbles import mapped
from ..data import fcurves, sampled, strips
from ..data.annotations import layers_of
from ..data.property_copy import for_a_while
from . import add_effect


def strip_and_source(effect: PropertyGroup) -> list[Strip]:
    """Return the strip of an effect and its source; []: one of them is missing."""
    shown = strips.with_sources(effect.id_data)
    return next(([each.strip, each.source] for each in shown if each.effect == effect), [])


class Shown(NamedTuple):
    """What panels show about an effect's source.

    Attributes:
        source: its name.
        differences: labels of what `match` would change.
        lacks_modifiers: the source has modifiers, and the effect strip has none.
        has_effects: the source has effect strips.
    """

    source: str
    differences: list[str]
    lacks_modifiers: bool
    has_effects: bool


def shown(effect: PropertyGroup) -> Shown | None:
    """Return what panels show about the source, kept until something changes; None: there is no source."""
    return revision.until_change("source", effect.scene.session_uid, lambda: _compare(effect))


def _compare(effect: PropertyGroup) -> Shown | None:
    if not (pair := strip_and_source(effect)):
        return None
    strip, source = pair
    look, wanted = _looks(strip), _looks(source)
    words = [word for word in add_effect.LOOK if look[word] != wanted[word]]
    lacks_modifiers = not strip.modifiers and not all(modifier.mute for modifier in source.modifiers)
    return Shown(source.name, words, lacks_modifiers, bool(effects_on(effect.id_data, source)))


def match(effect: PropertyGroup) -> None:
    """Give the effect strip the look of its source."""
    strip, source = strip_and_source(effect)
    with scribbles_kept(effect, strip):
        add_effect.copy_look(source, strip, keys=True)


def _looks(strip: Strip) -> dict[str, str]:
    """Return values and keyframes of each part of a strip's look, as text so that NaN equals NaN."""
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
    return sorted(
        (
            (curve.data_path.removeprefix(path), curve.array_index, curve.extrapolation),
            [(*key.handle_left, *key.co, *key.handle_right, key.interpolation) for key in curve.keyframe_points],
        )
        for curve in curves
        if curve.data_path.startswith(path)
    )


@contextmanager
def scribbles_kept(effect: PropertyGroup, strip: Strip) -> Iterator[None]:
    """Keep strokes on the effect's picture while the picture moves."""
    before = places(effect, strip)
    yield
    put_back(effect, strip, before)


def places(effect: PropertyGroup, strip: Strip) -> list[np.ndarray | None]:
    """Return the matrix from image to picture for each drawing; None: the picture has no size or place there."""
    frames = [drawing.frame_number for drawing in _drawings(effect)]
    placement = sampled.Sampling.of(effect.id_data, effect, strip, frames).placement
    found = [sampled.tried(placement.at, frame) for frame in frames]
    return [place if isinstance(place, np.ndarray) else None for place in found]


def put_back(effect: PropertyGroup, strip: Strip, before: list[np.ndarray | None]) -> None:
    """Move an effect's drawings back to their place on the picture.

    Args:
        before: result of `places` before the change.
    """
    for drawing, old, new in zip(_drawings(effect), before, places(effect, strip), strict=True):
        if old is not None and new is not None and not np.array_equal(old, new):
            _move(drawing, np.linalg.inv(new) @ old)


def _drawings(effect: PropertyGroup) -> list[AnnotationFrame]:
    layers = {layer.info: layer for region in effect.regions for layer in layers_of(effect, region)}
    return [drawing for layer in layers.values() for drawing in layer.frames]


def _move(drawing: AnnotationFrame, change: np.ndarray) -> None:
    """Move the strokes of a drawing in the image."""
    for stroke in drawing.strokes:
        points = fcurves.numbers(stroke.points, "co", size=3)
        points[:, :2] = mapped(change, points[:, :2].astype(np.float64))
        stroke.points.foreach_set("co", points.ravel())


def append_modifiers(scene: Scene, source: Strip, part: Strip) -> None:
    """Copy the modifiers of a strip to another, with their keyframes."""
    if not source.modifiers:
        return
    count = len(part.modifiers)
    active = scene.sequence_editor, "active_strip", source
    with for_a_while([active]), add_effect.selecting(scene, [part]):  # it copies all of the active strip
        bpy.ops.sequencer.strip_modifier_copy(type="APPEND")
    for old, new in zip(source.modifiers, part.modifiers[count:], strict=True):
        fcurves.copy_curves(scene, f"{old.path_from_id()}.", scene, f"{new.path_from_id()}.")


def effects_on(scene: Scene, source: Strip) -> list[Strip]:
    """Return the effect strips that have a source as input. The engine does not see their result."""
    inputs = ("input_1", "input_2")
    return [s for s in scene.sequence_editor.strips_all if any(getattr(s, name, None) == source for name in inputs)]
