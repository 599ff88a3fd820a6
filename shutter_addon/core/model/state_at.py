"""The state of an effect at a timeline frame, as plain data with everything that a picture needs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from . import following, scribbles, windows
from .clip import Clip, Shown
from .effect import Effect, MatteRegion, Region
from .frame_state import Following, FrameState, Layers
from .mattes import Matte


class Moment(NamedTuple):
    """The shown frame of the clip, the effect there, and the direction: 1, or −1 where the clip runs backward."""

    source_frame: int
    state: FrameState
    direction: int


def state_at(effect: Effect, clip: Clip, frame: float) -> Moment:
    """Return an effect's state at a timeline frame of a clip.

    It has the bars' lengths on the timeline and of trails, followed motions and layers. Cuts are not considered yet,
    since no frame is read.

    Raises:
        EffectError: No picture can be made of it.
    """
    if effect.time is not None:
        clip = replace(clip, timing=effect.time)
    at = clip.shown(frame)
    state = _in_moments(effect, effect.at(frame), clip, at)
    state = following.exposed(effect, state, clip, at)
    has_trails = any(shutter.has_trail for shutter in effect.shutters)
    state = windows.slid(state, at.source_frame, at.direction, range(clip.count), whole=has_trails)
    state = following.followed(effect, state, clip, at)
    return Moment(at.source_frame, _layered(effect, state, clip, at), at.direction)


def _in_moments(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """Return the state with bars of the clip's moments, `clip.step` per filmed frame.

    Bars that shape an exposure of another length keep their shape.
    """
    options = replace(state.options, window=state.options.window * clip.step, step=clip.step, backward=at.direction < 0)
    if clip.step == 1:
        return replace(state, options=options)
    bars = [
        shutter.bars.at(at.frame, options.interpolation, shutter.spread(clip.step, options.backward))
        for shutter in effect.shutters
    ]
    return replace(state, bars=np.stack(bars), options=options)


def _layered(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """Return the state at a timeline frame with its layers. EffectError: a layer is too far outside the picture."""
    if not (regions := effect.layers_at(at.frame)):
        return state
    seen, reach, step = following.seen(state.options, at, clip.count), state.options.plate_reach, state.options.step
    frames = range(max(seen.start - reach * step, 0), min(seen.stop + reach * step, clip.count))
    times = following.times_of(clip, at, frames, following.reach(state.options.filmed) + reach)
    moments = [(at.frame + math.floor(time - at.frame), (time - at.frame) % 1.0) for time in times]
    drawn = [(1 + i, region) for i, region in enumerate(regions) if isinstance(region, Region)]
    others = [(0, region) for region in effect.regions if isinstance(region, Region) and region not in regions]
    camera = None
    if effect.camera.moves.are_keyed:
        turns, shifts = following.moves(following.places_of(effect.camera), clip, at.frame, times)
        camera = Following(frames.start, turns[:, None], shifts[:, None]).of(slice(None))
    return replace(
        state,
        layers=Layers(
            shutters=tuple(region.shutter for region in regions),
            opacities=tuple(float(region.opacity.at(at.frame)) for region in regions),
            first=frames.start,
            scribbles=tuple(
                _scribbles(effect, state, (*others, *drawn), len(regions), *moment)
                if drawn and (frame in seen or frame % step == 0)  # plates are taken from filmed frames
                else None
                for frame, moment in zip(frames, moments, strict=True)
            ),
            mattes=tuple(tuple(_matte(region, *moment) for region in regions) for moment in moments),
            camera=camera,
        ),
    )


def _matte(region: Region | MatteRegion, frame: float, share: float) -> Matte | None:
    """Return the region's matte at a time between two timeline frames: that of the nearer one."""
    return region.at(frame + round(share)) if isinstance(region, MatteRegion) else None


def _scribbles(
    effect: Effect, state: FrameState, drawn: Sequence[tuple[int, Region]], count: int, frame: float, share: float
) -> FrameState:
    """Return a state of Layers.scribbles at a time between a timeline frame and the next.

    Args:
        drawn: Regions, later ones on top, each with 1 + its layer's number, or 0 without a layer.
        count: The number of layers.
    """
    placed = [(number, _between(region, frame, share)) for number, region in drawn]
    shapes = tuple(replace(shape, shutter=number, opacity=1.0) for number, shape in placed if shape.opacity > 0)
    options = replace(state.options, edge_aware=float(effect.edge_aware.at(frame + round(share))))
    return FrameState(options=options, bars=np.ones((1 + count, options.window)), shapes=shapes)


def _between(region: Region, frame: float, share: float) -> scribbles.Shape:
    before = region.at(frame)
    if not share:
        return before
    after = region.at(frame + 1)
    strokes = scribbles.between_strokes(before.strokes, after.strokes, share, region.drawings.aspect)
    return replace(before, strokes=tuple(strokes), width=(1 - share) * before.width + share * after.width)
