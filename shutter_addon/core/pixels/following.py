"""What the exposures of shutters follow: where the points of the shown picture lie in the frames around it.

Keys of regions and of the camera are on timeline frames, a window has frames of the source. What a source frame shows
is where the keys have it at the timeline frame that shows it: of several the one nearest to the shown frame; between
two timeline frames for a source frame that is passed over there, or for an in-between frame. Between timeline frames
motion is straight.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..frames.frame_source import FrameSource
from ..model import motions
from ..model.effect import Camera, Effect, Subject
from ..model.frame_state import Following, FrameState, Options
from ..model.motions import Placement, Similarity
from . import compositor, trails

# Below this scale a subject is a point, and says nothing of where the others are.
_SMALLEST = 1e-6


def reach(window: int) -> int:
    """How many timeline frames before and after the shown one say where the source frames of a window lie: enough for
    footage that is slowed down to a quarter. Source frames shown beyond have the motion of the nearest within."""
    return 4 * window


def smoothing(smooth: int) -> np.ndarray:
    """Weights (2 · smooth + 1,), Σ = 1, of the frames before and after one: a bell, without the jolts that a box has
    where something sudden enters and leaves it."""
    bell = 1 + np.cos(np.pi * np.arange(-smooth, smooth + 1) / (smooth + 1))
    return bell / bell.sum()


class Followed:
    """What a shutter follows of a region or the camera, asked as these are: its location alone, perhaps, and averaged
    over time. It depends on keys around a frame, and on no other picture."""

    def __init__(self, motion: motions.Motion, smooth: int, subject: Subject):
        self._subject, self._motion, self._smooth = subject, motion, smooth
        self._weights = smoothing(smooth)
        self._own: dict[float, tuple[Placement, np.ndarray | None]] = {}
        self._averaged: dict[float, tuple[Placement, np.ndarray | None]] = {}

    def at(self, frame: float) -> tuple[Placement, np.ndarray | None]:
        """The placement and the centre (2,), None: nothing is drawn."""
        if not self._smooth:
            return self._at(frame)
        if frame not in self._averaged:
            around = [self._at(frame + k) for k in range(-self._smooth, self._smooth + 1)]
            placements, centres = zip(*around, strict=True)
            is_drawn = all(centre is not None for centre in centres)
            centre = self._weights @ np.array(centres) if is_drawn else None
            self._averaged[frame] = motions.averaged(placements, self._weights), centre
        return self._averaged[frame]

    def _at(self, frame: float) -> tuple[Placement, np.ndarray | None]:
        if frame not in self._own:
            placement = motions.only(self._subject.placement(frame), self._motion)
            self._own[frame] = placement, self._subject.centre(frame)
        return self._own[frame]


class Shown(NamedTuple):
    """A timeline frame, and the source frame that is shown there, as for compositor.window_positions."""

    frame: float
    source_frame: int
    direction: int = 1


def followed(
    effect: Effect, state: FrameState, at: Shown, source: FrameSource, shown: Callable[[float], int]
) -> FrameState:
    """The effect's state at a timeline frame, with what its shutters follow, and with the bars of those whose trail has
    a length.

    shown: the source frame that is shown at a timeline frame a whole number of frames away, at most `reach`
    EffectError: what is followed lies nowhere"""
    subjects = [shutter.follow for shutter in effect.shutters]
    if not any(subjects):
        return state
    frame, index, direction = at
    frames = seen(state.options, index, direction, source.count)
    times = times_of(shown, frame, index, frames, reach(state.options.window))
    turns = np.ones((len(frames), len(subjects)), np.complex128)
    shifts = np.zeros_like(turns)
    ways = [(id(shutter.follow), shutter.follow_motion, shutter.follow_smooth) for shutter in effect.shutters]
    for way, shutter in dict(zip(ways, effect.shutters, strict=True)).items():
        if shutter.follow is None:
            continue
        subject = Followed(shutter.follow_motion, shutter.follow_smooth, shutter.follow)
        moves = [motion_to(subject, frame, time, (source.width, source.height)) for time in times]
        followers = [other == way for other in ways]
        turns[:, followers] = np.array([motion.turn for motion in moves])[:, None]
        shifts[:, followers] = np.array([motion.shift for motion in moves])[:, None]
    following = Following(frames.start, turns, shifts)
    bars, open_for = _with_trails(effect, state, following, at, source)
    return replace(state, bars=bars, following=following.of(slice(None)), open_for=open_for)


def _with_trails(
    effect: Effect, state: FrameState, following: Following, at: Shown, source: FrameSource
) -> tuple[np.ndarray, dict[int, float]]:
    """The state's bars (N, L), those of shutters whose trail has a length open for it, and FrameState.open_for;
    arguments like those of `followed`."""
    bars, open_for, size = state.bars.copy(), dict(state.open_for), (source.width, source.height)
    frame, index, direction = at
    positions = compositor.window_positions(state.options, index, direction)
    shown_at = float(np.abs(positions - index).argmin()) + 0.5
    seen = compositor.source_frames(state.options, positions, range(source.count))
    # What is left out beyond the clip's ends stands still there, as what is held does.
    turns, shifts = following.at(np.where(seen < 0, positions, seen))
    for i, shutter in enumerate(effect.shutters):
        if shutter.follow and shutter.has_trail:
            corners = [motions.pixel(corner, size) for corner in shutter.follow.corners(frame)]
            places = np.outer(turns[:, i], corners) + shifts[:, i, None]
            way = trails.travelled(places) / source.height
            bars[i], open_for[i] = trails.with_length(bars[i], way, float(shutter.trail.at(frame)), shown_at)
        share = float(shutter.follow.influence.at(frame)) if isinstance(shutter.follow, Camera) else 1.0
        if share < 1:
            bars[i], open_for[i] = trails.shortened(bars[i], share, shown_at)
    return bars, open_for


def seen(options: Options, index: int, direction: int, count: int) -> range:
    """The source frames that a window may show, wherever its shot ends."""
    positions = compositor.window_positions(options, index, direction)
    if options.edges == "slide" and options.stop_at_cuts:  # a cut may lie on either side
        positions = index + np.array([-1, 1]) * (options.window + options.step)
    beyond = options.window if options.edges == "mirror" else 0
    low, high = min(positions.min(), index) - beyond, max(positions.max(), index) + beyond
    return range(max(int(low), 0), min(int(high), count - 1) + 1)


def times_of(shown: Callable[[float], int], frame: float, index: int, wanted: range, reach: int) -> list[float]:
    """The time on the timeline, nearest to a frame, at which each of the wanted source frames is shown."""
    times, last = {index: frame}, {1: index, -1: index}
    for distance in range(1, reach + 1):
        if len(times) == len(wanted):
            break
        for way, before in last.items():
            after = last[way] = shown(frame + way * distance)
            low, high = max(min(before, after), wanted.start), min(max(before, after), wanted.stop - 1)
            for source in range(low, high + 1) if before != after else ():
                apart = distance - 1 + (source - before) / (after - before)
                if source not in times or apart < abs(times[source] - frame):
                    times[source] = frame + way * apart
    known = np.array(sorted(times))
    nearest = known[np.abs(known - np.arange(wanted.start, wanted.stop)[:, None]).argmin(axis=1)]
    return [times[source] for source in nearest.tolist()]


def motion_to(subject: Followed, frame: float, time: float, size: tuple[int, int]) -> Similarity:
    """The motion of the picture from a timeline frame to a time that may lie between two; none where nothing is drawn
    that could be followed."""
    whole = frame + math.floor(time - frame)
    share = time - whole
    start, centre = subject.at(frame)
    (first, first_centre), (second, second_centre) = subject.at(whole), subject.at(whole + 1 if share else whole)
    if centre is None or first_centre is None or second_centre is None or abs(start.scale) < _SMALLEST:
        return Similarity()
    placement = motions.between(first, second, share)
    moved = (1 - share) * first_centre + share * second_centre
    if start == placement and np.array_equal(centre, moved):
        return Similarity()  # to the bit
    return motions.motion_between(start, placement, centre, moved, size)
