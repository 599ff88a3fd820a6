"""Writing tracked motion into a recipe: keys of a region or of the camera."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from ..model import motions, presence
from ..model.effect import Camera, Moves, OutlineRegion, Region, Subject, SubjectRegion
from ..model.keyframes import Channel, Ease, Keys
from ..model.motions import Placement, Placements, Size

_DIGITS = 6  # of measured numbers: far below a pixel
# Allowed error of a thinned camera in pixels; it is small because the camera moves the whole picture.
STEADY = 0.25
# The picture's corners, from its centre.
CORNERS = motions.offsets([motions.PICTURE])
Moving = Camera | Region | OutlineRegion | SubjectRegion  # what can be tracked


def with_placements(
    moving: Moving, placements: Placements, exact: Collection[int], size: Size, *, thin: bool = True
) -> Moving:
    """Return the region or camera with keys for these placements.

    They replace its keys from the first to the last of these frames. At whole frames beyond, it stays where it was, and
    its drawings keep their place and shape.

    Args:
        exact: Frames that keep their keys, with unrounded numbers.
        size: Of the picture.
        thin: Leave out keys that the motion does not need, to within a pixel, or a quarter of one for a camera.
    """
    drawings = moving.drawings if isinstance(moving, Region | OutlineRegion) else None
    keyed, starts = (_eases(moving), drawings.frames) if drawings else ({}, ())
    # A drawing without a key of its own exists from the first key on.
    drawn = [frame for frame in starts if frame in keyed]
    eases = {frame: keyed[frame] for frame in drawn if len(starts) > 1}
    chosen = sorted(placements)
    if thin:
        # After a drawing whose ease is not linear, keep the motion straight.
        straight: set[float] = {frame + 1 for frame, ease in eases.items() if ease != "linear"}
        tolerance = STEADY if isinstance(moving, Camera) else 1.0
        chosen = motions.thinned(placements, _shape(moving), size, {*exact, *drawn, *straight}, tolerance)
    moves = _moves(moving, placements, exact, chosen, eases)
    if drawings and (len(starts) == 1 or starts[0] not in keyed):
        assert isinstance(moves.location, Keys)
        frames = moves.location.frames[0], *starts[1:]
        moving = replace(moving, drawings=replace(drawings, frames=frames))
    return replace(moving, moves=moves)


def _shape(moving: Moving) -> np.ndarray:
    """Return the points (n, 2) of what moves, relative to its centre."""
    if isinstance(moving, Camera):
        return CORNERS
    outlines = moving.outlines.strokes if isinstance(moving, SubjectRegion) else ()
    return np.concatenate([motions.offsets(strokes) for strokes in (*moving.drawings.strokes, *outlines)])


def _eases(moving: Subject) -> dict[float, Ease]:
    """Return the ease of each key, by frame."""
    location = moving.moves.location
    return dict(zip(location.frames, location.eases, strict=True)) if isinstance(location, Keys) else {}


def _moves(
    moving: Subject, placements: Placements, exact: Collection[int], chosen: list[int], eases: Mapping[float, Ease]
) -> Moves:
    """Return moves with keys for the chosen placements, in place of those from the first placement to the last.

    At whole frames beyond, the subject moves as before.

    Args:
        eases: The drawings' eases, by frame.
    """
    first, last = min(placements), max(placements)
    old = _eases(moving)
    keys: dict[float, Placement] = {frame: moving.placement(frame) for frame in old if not first <= frame <= last}
    kept = {frame: old[frame] for frame in keys}
    keys |= {frame: moving.placement(frame) for frame in _cut(old, first - 1, -1) + _cut(old, last + 1, 1)}
    keys |= {frame: placements[frame] if frame in exact else _rounded(placements[frame]) for frame in chosen}
    return Moves.keyed([(f, keys[f], eases.get(f, kept.get(f, "linear"))) for f in sorted(keys)])


def _cut(keys: Mapping[float, Ease], edge: int, step: int) -> list[int]:
    """Return the frames that need a key so that motion beyond `edge` stays when keys before it change.

    That is the edge if the motion towards the next key is linear, else all frames up to that key. Nothing is needed
    without a key beyond.

    Args:
        step: 1 or −1, the direction away from the changed keys.
    """
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
    """Return an opacity or influence with keys of where the subject is tracked.

    They replace the keys at `frames`; beyond these, the value stays. Each is scaled by the highest old value.

    Args:
        keys: See presence.keys.
    """
    if not isinstance(value, Keys):
        scaled = [(key.frame, value.at(1) * key.value, key.ease) for key in keys]
        return Keys(*zip(*scaled, strict=True)) if keys else value
    old = list(zip(value.frames, value.values, value.eases, strict=True))
    whole, first, last = max(value.values), frames[0], frames[-1]
    before, after = [key for key in old if key[0] < first], [key for key in old if key[0] > last]
    made = [(key.frame, whole * key.value, key.ease) for key in keys if first <= key.frame <= last]
    start = whole * keys[0].value if keys else whole
    made = made if made and made[0][0] == first else [(first, start, "constant"), *made]
    held = [(first - 1, float(value.at(first - 1)), "constant")] if before and before[-1][0] < first - 1 else []
    back = [(last + 1, float(value.at(last + 1)), "linear")] if after and after[0][0] > last + 1 else []
    return Keys(*zip(*before, *held, *made, *back, *after, strict=True))
