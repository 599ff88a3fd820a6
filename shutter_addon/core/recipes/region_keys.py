"""A recipe's region, or its camera, with keys of how it moves."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from ..model import motions, presence
from ..model.effect import Camera, Moves, OutlineRegion, Region, Subject, SubjectRegion
from ..model.keyframes import Channel, Ease, Keys
from ..model.motions import Placement, Placements, Size

_DIGITS = 6  # of what was measured: far below a pixel
# Pixels by which a thinned camera may be off: unlike a region, it carries the picture itself.
STEADY = 0.25
# Of the picture, from its centre on.
CORNERS = motions.offsets([motions.PICTURE])


def with_placements(
    moving: Camera | Region | OutlineRegion | SubjectRegion,
    placements: Placements,
    exact: Collection[int],
    size: Size,
    *,
    thin: bool = True,
) -> Camera | Region | OutlineRegion | SubjectRegion:
    """The region, or the camera, with these placements as its keys, in place of those that it has from the first of
    these frames to the last. At whole frames beyond these it stays where its keys put it, and its drawings stay where
    and as they are.

    exact: those frames among them whose keys are kept in any case, and as they are given
    size: of the picture; thin: no more keys than the motion needs within a pixel, within a quarter of one everywhere in
    the picture for a camera"""
    if isinstance(moving, Camera):
        chosen = motions.thinned(placements, CORNERS, size, exact, STEADY) if thin else sorted(placements)
        return replace(moving, moves=_moves(moving, placements, exact, chosen, {}))
    drawings = replace(moving.drawings, aspect=size[0] / size[1])
    if isinstance(moving, SubjectRegion):
        shape = np.concatenate([motions.offsets(strokes) for strokes in (*drawings.strokes, *moving.outlines.strokes)])
        chosen = motions.thinned(placements, shape, size, exact) if thin else sorted(placements)
        return replace(moving, moves=_moves(moving, placements, exact, chosen, {}))
    keyed = _eases(moving)
    # A drawing at no key is there from the first on.
    drawn = [frame for frame in drawings.frames if frame in keyed]
    eases = {frame: keyed[frame] for frame in drawn if len(drawings.frames) > 1}
    chosen = sorted(placements)
    if thin:
        # behind a drawing with an ease of its own the motion is to go straight
        straight: set[float] = {frame + 1 for frame, ease in eases.items() if ease != "linear"}
        shape = np.concatenate([motions.offsets(strokes) for strokes in drawings.strokes])
        chosen = motions.thinned(placements, shape, size, {*exact, *drawn, *straight})
    moves = _moves(replace(moving, drawings=drawings), placements, exact, chosen, eases)
    assert isinstance(moves.location, Keys)
    if len(drawings.frames) == 1 or drawings.frames[0] not in keyed:
        frames = moves.location.frames[0], *drawings.frames[1:]
        drawings = replace(drawings, frames=frames)
    return replace(moving, moves=moves, drawings=replace(drawings, aspect=moving.drawings.aspect))


def _eases(moving: Subject) -> dict[float, Ease]:
    """The eases of its keys, by their frames."""
    location = moving.moves.location
    return dict(zip(location.frames, location.eases, strict=True)) if isinstance(location, Keys) else {}


def _moves(
    moving: Subject,
    placements: Placements,
    exact: Collection[int],
    chosen: list[int],
    eases: Mapping[float, Ease],
) -> Moves:
    """Keys with the chosen placements, in place of those from the first placement to the last; what moves still does so
    at whole frames beyond. eases: by frame, those that drawings have."""
    first, last = min(placements), max(placements)
    old = _eases(moving)
    keys: dict[float, Placement] = {frame: moving.placement(frame) for frame in old if not first <= frame <= last}
    kept = {frame: old[frame] for frame in keys}
    keys |= {frame: moving.placement(frame) for frame in _cut(old, first - 1, -1) + _cut(old, last + 1, 1)}
    keys |= {frame: placements[frame] if frame in exact else _rounded(placements[frame]) for frame in chosen}
    return Moves.keyed([(f, keys[f], eases.get(f, kept.get(f, "linear"))) for f in sorted(keys)])


def _cut(keys: Mapping[float, Ease], edge: int, step: int) -> list[int]:
    """The frames that need a key, so that what lies beyond an edge stays when keys on the other side of it change: the
    edge where the way to the next key is straight, all frames on a way that is not; none without a key beyond."""
    beyond = [frame for frame in keys if step * (frame - edge) >= 0]
    if not beyond or edge in beyond:
        return []
    if next((keys[frame] for frame in sorted(keys, reverse=True) if frame < edge), "linear") == "linear":
        return [edge]
    return list(range(edge, math.ceil(min(beyond)) if step > 0 else math.floor(max(beyond)), step))


def _rounded(placement: Placement) -> Placement:
    x, y = (round(number, _DIGITS) for number in placement.location)
    return Placement((x, y), round(placement.rotation, _DIGITS), round(placement.scale, _DIGITS))


def with_ends(value: Channel, keys: list[presence.Key], frames: range) -> Channel:
    """How much something counts, with keys of where it is tracked (presence.keys), in place of those that it has at
    these frames; beyond them it stays what it is. All of it is what it was at most."""
    if not isinstance(value, Keys):
        return _channel([(key.frame, value.at(1) * key.value, key.ease) for key in keys]) if keys else value
    old = list(zip(value.frames, value.values, value.eases, strict=True))
    whole, first, last = max(value.values), frames[0], frames[-1]
    before, after = [key for key in old if key[0] < first], [key for key in old if key[0] > last]
    made = [(key.frame, whole * key.value, key.ease) for key in keys if first <= key.frame <= last]
    start = whole * keys[0].value if keys else whole
    made = made if made and made[0][0] == first else [(first, start, "constant"), *made]
    held = [(first - 1, float(value.at(first - 1)), "constant")] if before and before[-1][0] < first - 1 else []
    back = [(last + 1, float(value.at(last + 1)), "linear")] if after and after[0][0] > last + 1 else []
    return _channel([*before, *held, *made, *back, *after])


def _channel(keys: list[tuple]) -> Keys:
    return Keys(*zip(*keys, strict=True))
