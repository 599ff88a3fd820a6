"""A recipe's region, or its camera, with keys of how it moves."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from . import motions
from .motions import Placement
from .recipe import CameraKey, Recipe, Region, RegionKey

_DIGITS = 6  # of what was measured: far below a pixel
# Pixels by which a thinned camera may be off: unlike a region, it carries the picture itself.
STEADY = 0.25
# Of the picture, from its centre on.
CORNERS = np.array([(x, y) for x in (-0.5, 0.5) for y in (-0.5, 0.5)])


def with_placements(
    region: Region, placements: Mapping[int, Placement], exact: Collection[int], size, *, thin: bool = True
) -> Region:
    """The region with these placements as its keys, in place of those that it has from the first of these frames to the
    last. At whole frames beyond these it stays where its keys put it, and its drawings stay where and as they are.

    placements: by frame; exact: those frames among them whose keys are kept in any case, and as they are given
    size: width and height of the picture; thin: no more keys than the motion needs within a pixel"""
    drawn = {key.frame if key else None: strokes for key, strokes in region.drawings()}
    eases = {key.frame: key.ease for key in region.keys if key.frame in drawn and len(drawn) > 1}
    first, last = min(placements), max(placements)
    chosen = sorted(placements)
    if thin:
        # behind a drawing with an ease of its own the motion is to go straight
        kept = {*exact, *drawn, *(frame + 1 for frame, ease in eases.items() if ease != "linear")}
        shape = np.concatenate([motions.offsets(strokes) for strokes in drawn.values()])
        chosen = motions.thinned(placements, shape, size, kept)
    keys = [key for key in region.keys if not first <= key.frame <= last]
    moved = region.over_time(0, size[0] / size[1])
    for frame in _cut(region.keys, first - 1, -1) + _cut(region.keys, last + 1, 1):
        keys.append(RegionKey(frame, tuple(moved.location.at(frame)), moved.rotation.at(frame), moved.scale.at(frame)))
    for frame in chosen:
        placement = placements[frame] if frame in exact else _rounded(placements[frame])
        ease = eases.get(frame, "linear")
        keys.append(RegionKey(frame, placement.location, placement.rotation, placement.scale, ease=ease))
    return _redrawn(replace(region, keys=sorted(keys, key=lambda key: key.frame)), drawn)


def with_camera(
    source: Recipe, placements: Mapping[int, Placement], exact: Collection[int], size, *, thin: bool = True
) -> Recipe:
    """The recipe whose camera has these placements as its keys; arguments as of with_placements. Thinned keys are
    within a quarter of a pixel of the placements, everywhere in the picture."""
    first, last = min(placements), max(placements)
    chosen = motions.thinned(placements, CORNERS, size, exact, STEADY) if thin else sorted(placements)
    camera = source.effect(size[0] / size[1]).camera
    kept = {key.frame: key for key in source.camera if not first <= key.frame <= last}
    for frame in _cut(source.camera, first - 1, -1) + _cut(source.camera, last + 1, 1):
        there = camera.placement(frame)
        kept[frame] = CameraKey(frame, there.location, there.rotation, there.scale)
    for frame in chosen:
        there = placements[frame] if frame in exact else _rounded(placements[frame])
        kept[frame] = CameraKey(frame, there.location, there.rotation, there.scale)
    return replace(source, camera=[kept[frame] for frame in sorted(kept)])


def _cut(keys: list, edge: int, step: int) -> list[int]:
    """The frames that need a key, so that what lies beyond an edge stays when keys on the other side of it change: the
    edge where the way to the next key is straight, all frames on a way that is not; none without a key beyond."""
    beyond = [key.frame for key in keys if step * (key.frame - edge) >= 0]
    if not beyond or edge in beyond:
        return []
    if next((key.ease for key in reversed(keys) if key.frame < edge), "linear") == "linear":
        return [edge]
    return list(range(edge, math.ceil(min(beyond)) if step > 0 else math.floor(max(beyond)), step))


def _redrawn(region: Region, drawn: dict) -> Region:
    """The region with its drawings, by frame, on its keys: the first one is its own as well."""
    strokes = next(iter(drawn.values()))
    if len(drawn) == 1:
        return replace(region, strokes=strokes, keys=[replace(key, strokes=None) for key in region.keys])
    return replace(region, strokes=strokes, keys=[replace(key, strokes=drawn.get(key.frame)) for key in region.keys])


def _rounded(placement: Placement) -> Placement:
    x, y = (round(number, _DIGITS) for number in placement.location)
    return Placement((x, y), round(placement.rotation, _DIGITS), round(placement.scale, _DIGITS))
