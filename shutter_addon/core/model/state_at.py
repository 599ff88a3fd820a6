"""An effect at a timeline frame, with everything that its picture needs: plain data of plain data."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from . import following, layers, trails, windows
from .clip import Clip, Shown
from .effect import Effect
from .frame_state import FrameState


class Moment(NamedTuple):
    """What a compute.request.Request begins with: the clip's frame that is shown, the effect there, and 1, or −1 where
    the clip runs backward."""

    source_frame: int
    state: FrameState
    direction: int


def state_at(effect: Effect, clip: Clip, frame: float) -> Moment:
    """An effect at a timeline frame of a clip: its bars as long as they are on the timeline or as trails are, within
    the clip; what exposures follow; and layers. Where the shot ends is not known before frames are read.

    EffectError: no picture can be made of it."""
    if effect.time is not None:
        clip = replace(clip, timing=effect.time)
    at = clip.shown(frame)
    state = _in_moments(effect, effect.at(frame), clip, at)
    state = trails.exposed(effect, state, clip, at)
    has_trails = any(shutter.has_trail for shutter in effect.shutters)
    state = windows.slid(state, at.source_frame, at.direction, range(clip.count), whole=has_trails)
    state = following.followed(effect, state, clip, at)
    return Moment(at.source_frame, layers.layered(effect, state, clip, at), at.direction)


def _in_moments(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """The state whose bars are of the moments that a clip has, `clip.step` for each filmed frame. Bars that say the
    shape of an exposure of another length stay that shape, and are moved to its moments later."""
    options = replace(state.options, window=state.options.window * clip.step, step=clip.step, backward=at.direction < 0)
    if clip.step == 1:
        return replace(state, options=options)
    bars = [
        shutter.bars.at(at.frame, options.interpolation, shutter.spread(clip.step, options.backward))
        for shutter in effect.shutters
    ]
    return replace(state, bars=np.stack(bars), options=options)
