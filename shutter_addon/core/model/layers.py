"""Which layers there are at a frame, and where they lie in the source's frames around it (core.pixels.layering)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from . import following, scribbles
from .clip import Clip, Shown
from .effect import Effect, MatteRegion, Region
from .frame_state import Following, FrameState, Layers
from .mattes import Matte


def layered(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """The effect's state at a timeline frame, with its layers. EffectError: one lies nowhere."""
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
    """Its matte at a time between a timeline frame and the next: that of the nearer one."""
    return region.at(frame + round(share)) if isinstance(region, MatteRegion) else None


def _scribbles(
    effect: Effect, state: FrameState, drawn: Sequence[tuple[int, Region]], count: int, frame: float, share: float
) -> FrameState:
    """Layers.scribbles at a time between a timeline frame and the next, of so many layers.

    drawn: regions, the later over the earlier, each with 1 + the number of its layer, 0 for what is none's"""
    shapes = []
    for number, region in drawn:
        shape = _between(region, frame, share)
        if shape.opacity > 0:
            shapes.append(replace(shape, shutter=number, opacity=1.0))
    options = replace(state.options, edge_aware=float(effect.edge_aware.at(frame + round(share))))
    return FrameState(options=options, bars=np.ones((1 + count, options.window)), shapes=tuple(shapes))


def _between(region: Region, frame: float, share: float) -> scribbles.Shape:
    before = region.at(frame)
    if not share:
        return before
    after = region.at(frame + 1)
    strokes = scribbles.between_strokes(before.strokes, after.strokes, share, region.drawings.aspect)
    return replace(before, strokes=tuple(strokes), width=(1 - share) * before.width + share * after.width)
