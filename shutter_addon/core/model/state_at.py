"""An effect at a timeline frame, with everything that its picture needs: plain data of plain data."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from . import following, layers, timeline_exposure, windows
from .clip import Clip
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
    state, at = effect.at(frame), clip.shown(frame)
    state = timeline_exposure.exposed(effect, state, clip, at)
    has_trails = any(shutter.has_trail for shutter in effect.shutters)
    state = windows.slid(state, at.source_frame, at.direction, range(clip.count), whole=has_trails)
    state = following.followed(effect, state, clip, at)
    return Moment(at.source_frame, layers.layered(effect, state, clip, at), at.direction)
