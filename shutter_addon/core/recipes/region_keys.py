"""A recipe's region, or its camera, with keys of how it moves."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..model import effect, keyframes, mattes, motions, presence
from ..model.motions import Placement, Placements, Size
from .recipe import CameraKey, Keyable, OutlineRegion, Recipe, Region, RegionKey, ValueKey

D = TypeVar("D", Region, OutlineRegion)
_DIGITS = 6  # of what was measured: far below a pixel
# Pixels by which a thinned camera may be off: unlike a region, it carries the picture itself.
STEADY = 0.25
# Of the picture, from its centre on.
CORNERS = motions.offsets([motions.PICTURE])


def with_placements(region: D, placements: Placements, exact: Collection[int], size: Size, *, thin: bool = True) -> D:
    """The region with these placements as its keys, in place of those that it has from the first of these frames to the
    last. At whole frames beyond these it stays where its keys put it, and its drawings stay where and as they are.

    exact: those frames among them whose keys are kept in any case, and as they are given
    size: of the picture; thin: no more keys than the motion needs within a pixel"""
    drawn: dict[float | None, list] = {key.frame if key else None: strokes for key, strokes in region.drawings()}
    eases = {key.frame: key.ease for key in region.keys if key.frame in drawn and len(drawn) > 1}
    chosen = sorted(placements)
    if thin:
        # behind a drawing with an ease of its own the motion is to go straight
        straight: set[float] = {frame + 1 for frame, ease in eases.items() if ease != "linear"}
        kept = {*exact, *(frame for frame in drawn if frame is not None), *straight}
        shape = np.concatenate([motions.offsets(strokes) for strokes in drawn.values()])
        chosen = motions.thinned(placements, shape, size, kept)
    moving = region.over_time(0, size[0] / size[1], *([mattes.NoFile()] if isinstance(region, OutlineRegion) else []))
    keys = _keys(RegionKey, region.keys, moving, placements, exact, chosen)
    keys = [replace(key, ease=eases.get(key.frame, key.ease)) for key in keys]
    return _redrawn(replace(region, keys=keys), drawn)


def with_camera(
    source: Recipe, placements: Placements, exact: Collection[int], size: Size, *, thin: bool = True
) -> Recipe:
    """The recipe whose camera has these placements as its keys; arguments like those of with_placements. Thinned keys
    are within a quarter of a pixel of the placements, everywhere in the picture."""
    chosen = motions.thinned(placements, CORNERS, size, exact, STEADY) if thin else sorted(placements)
    camera = source.effect(size[0] / size[1]).camera
    return replace(source, camera=_keys(CameraKey, source.camera, camera, placements, exact, chosen))


def _keys(
    kind: type[RegionKey | CameraKey],
    keys: list,
    moving: effect.Subject,
    placements: Placements,
    exact: Collection[int],
    chosen: list[int],
) -> list:
    """Keys with the chosen placements, in place of those from the first placement to the last; moving: what moves by
    `keys`, and still does so at whole frames beyond."""
    first, last = min(placements), max(placements)
    keyed = {frame: moving.placement(frame) for frame in _cut(keys, first - 1, -1) + _cut(keys, last + 1, 1)}
    keyed |= {frame: placements[frame] if frame in exact else _rounded(placements[frame]) for frame in chosen}
    made = [
        kind(frame=frame, location=there.location, rotation=there.rotation, scale=there.scale)
        for frame, there in keyed.items()
    ]
    kept = [key for key in keys if not first <= key.frame <= last]
    return sorted(kept + made, key=lambda key: key.frame)


def _cut(keys: list, edge: int, step: int) -> list[int]:
    """The frames that need a key, so that what lies beyond an edge stays when keys on the other side of it change: the
    edge where the way to the next key is straight, all frames on a way that is not; none without a key beyond."""
    beyond = [key.frame for key in keys if step * (key.frame - edge) >= 0]
    if not beyond or edge in beyond:
        return []
    if next((key.ease for key in reversed(keys) if key.frame < edge), "linear") == "linear":
        return [edge]
    return list(range(edge, math.ceil(min(beyond)) if step > 0 else math.floor(max(beyond)), step))


def _redrawn(region: D, drawn: dict) -> D:
    """The region with its drawings, by frame, on its keys: the first one is its own as well."""
    strokes = next(iter(drawn.values()))
    if len(drawn) == 1:
        return replace(region, strokes=strokes, keys=[replace(key, strokes=None) for key in region.keys])
    return replace(region, strokes=strokes, keys=[replace(key, strokes=drawn.get(key.frame)) for key in region.keys])


def _rounded(placement: Placement) -> Placement:
    x, y = (round(number, _DIGITS) for number in placement.location)
    return Placement((x, y), round(placement.rotation, _DIGITS), round(placement.scale, _DIGITS))


def with_ends(value: Keyable, keys: list[presence.Key], frames: range) -> Keyable:
    """How much something counts, with keys of where it is tracked (presence.keys), in place of those that it has at
    these frames; beyond them it stays what it is. All of it is what it was at most."""
    if not isinstance(value, list):
        return [ValueKey(key.frame, value * key.value, key.ease) for key in keys] if keys else value
    columns = zip(*((key.frame, key.value, key.ease) for key in value), strict=True)
    at, whole = keyframes.Keys(*columns).at, max(key.value for key in value)
    first, last = frames[0], frames[-1]
    before, after = [k for k in value if k.frame < first], [k for k in value if k.frame > last]
    made = [ValueKey(key.frame, whole * key.value, key.ease) for key in keys if first <= key.frame <= last]
    start = whole * keys[0].value if keys else whole
    made = made if made and made[0].frame == first else [ValueKey(first, start, "constant"), *made]
    held = [ValueKey(first - 1, float(at(first - 1)), "constant")] if before and before[-1].frame < first - 1 else []
    back = [ValueKey(last + 1, float(at(last + 1)))] if after and after[0].frame > last + 1 else []
    return [*before, *held, *made, *back, *after]
