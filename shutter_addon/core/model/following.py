"""Motions that exposures follow: where the points of the shown picture lie in the frames around it.

Keys are on timeline frames, but a window has source frames. Keys place a source frame's content at the timeline frame
that shows it: the nearest one to the shown frame if there are several, or a time between two frames for source frames
that are skipped and for moments. Between timeline frames, motion is linear.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from . import motions, trails, windows
from .clip import Clip, Shown
from .effect import Camera, Effect, Subject
from .frame_state import Following, FrameState, Options
from .motions import Placement, Similarity

# Below this scale a subject is a point, which does not tell where other points are.
_SMALLEST = 1e-6

# Gives placement and centre (2,) at a frame; the centre is None if nothing is drawn.
Places = Callable[[float], tuple[Placement, np.ndarray | None]]


def followed(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """Return the state at a timeline frame with the motions that shutters follow, and with bars of trails.

    Raises:
        EffectError: A followed subject is too far outside the picture.
    """
    if not any(shutter.follow for shutter in effect.shutters):
        return state
    frames = seen(state.options, at, clip.count)
    times = times_of(clip, at, frames, reach(state.options.filmed))
    turns = np.ones((len(frames), len(effect.shutters)), np.complex128)
    shifts = np.zeros_like(turns)
    known: dict[tuple, np.ndarray] = {}
    for i, shutter in enumerate(effect.shutters):
        if shutter.follow is None:
            continue
        way = id(shutter.follow), shutter.follow_motion, shutter.follow_smooth
        if way not in known:
            known[way] = moves(
                places_of(shutter.follow, shutter.follow_motion, shutter.follow_smooth), clip, at.frame, times
            )
        turns[:, i], shifts[:, i] = known[way]
    following = Following(frames.start, turns, shifts)
    bars = _with_trails(effect, state, following, clip, at)
    return replace(state, bars=bars, following=following.of(slice(None)))


def _with_trails(effect: Effect, state: FrameState, following: Following, clip: Clip, at: Shown) -> np.ndarray:
    """Return the state's bars (N, L), with the lengths of trails."""
    bars = state.bars.copy()
    positions = windows.positions(state.options, at.source_frame, at.direction)
    shown_at = float(np.abs(positions - at.source_frame).argmin()) + 0.5
    frames = windows.source_frames(state.options, positions, range(clip.count))
    # Frames that are left out beyond the clip's ends stand still, as repeated ones do.
    turns, shifts = following.at(np.where(frames < 0, positions, frames))
    for i, shutter in enumerate(effect.shutters):
        if shutter.follow and shutter.has_trail:
            corners = [motions.pixel(corner, (clip.width, clip.height)) for corner in shutter.follow.corners(at.frame)]
            places = np.outer(turns[:, i], corners) + shifts[:, i, None]
            way = trails.travelled(places) / clip.height
            bars[i] = trails.with_length(bars[i], way, float(shutter.trail.at(at.frame)), shown_at)
        share = float(shutter.follow.influence.at(at.frame)) if isinstance(shutter.follow, Camera) else 1.0
        if share < 1:
            bars[i] = trails.shortened(bars[i], share, shown_at)
    return bars


def reach(filmed: int) -> int:
    """Return how many timeline frames around the shown one are searched for a window's source frames.

    It suffices for footage at a quarter of its speed. Source frames beyond get the motion of the nearest one.

    Args:
        filmed: Filmed frames of the window.
    """
    return 4 * filmed


def seen(options: Options, at: Shown, count: int) -> range:
    """Return the source frames, out of `count`, that a window may show, wherever its shot ends."""
    positions = windows.positions(options, at.source_frame, at.direction)
    if options.edges == "slide" and options.stop_at_cuts:  # a cut may lie on either side
        positions = at.source_frame + np.array([-1, 1]) * (options.window + options.step)
    beyond = options.window if options.edges == "mirror" else 0
    low, high = min(positions.min(), at.source_frame) - beyond, max(positions.max(), at.source_frame) + beyond
    return range(max(int(low), 0), min(int(high), count - 1) + 1)


def times_of(clip: Clip, at: Shown, wanted: range, reach: int) -> list[float]:
    """Return the timeline's time, nearest to the shown frame and within reach, that shows each wanted source frame."""
    times, last = {at.source_frame: at.frame}, {1: at.source_frame, -1: at.source_frame}
    for distance in range(1, reach + 1):
        if len(times) == len(wanted):
            break
        for way, before in last.items():
            after = last[way] = clip.shown(at.frame + way * distance).source_frame
            low, high = max(min(before, after), wanted.start), min(max(before, after), wanted.stop - 1)
            for source in range(low, high + 1) if before != after else ():
                apart = distance - 1 + (source - before) / (after - before)
                if source not in times or apart < abs(times[source] - at.frame):
                    times[source] = at.frame + way * apart
    known = np.array(sorted(times))
    nearest = known[np.abs(known - np.arange(wanted.start, wanted.stop)[:, None]).argmin(axis=1)]
    return [times[source] for source in nearest.tolist()]


def smoothing(smooth: int) -> np.ndarray:
    """Return weights (2 · smooth + 1,), Σ = 1, of the frames around one: a bell, which has no jolts like a box."""
    bell = 1 + np.cos(np.pi * np.arange(-smooth, smooth + 1) / (smooth + 1))
    return bell / bell.sum()


def places_of(subject: Subject, motion: motions.Motion = "scale", smooth: int = 0) -> Places:
    """Return a function that gives a subject's places, with the followed part of its motion, averaged over time."""

    @cache
    def own(frame: float) -> tuple[Placement, np.ndarray | None]:
        return motions.only(subject.placement(frame), motion), subject.centre(frame)

    if not smooth:
        return own
    weights = smoothing(smooth)

    @cache
    def averaged(frame: float) -> tuple[Placement, np.ndarray | None]:
        around = [own(frame + k) for k in range(-smooth, smooth + 1)]
        placements, centres = zip(*around, strict=True)
        is_drawn = all(centre is not None for centre in centres)
        centre = weights @ np.array(centres) if is_drawn else None
        return motions.averaged(placements, weights), centre

    return averaged


def moves(places: Places, clip: Clip, frame: float, times: list[float]) -> np.ndarray:
    """Return turns and shifts (2, n) of the motions of the picture from a timeline frame to (fractional) times."""
    found = [motion_to(places, frame, time, (clip.width, clip.height)) for time in times]
    return np.array([(motion.turn, motion.shift) for motion in found], np.complex128).T


def motion_to(places: Places, frame: float, time: float, size: tuple[int, int]) -> Similarity:
    """Return the motion of the picture from a timeline frame to a (fractional) time; none if nothing is drawn."""
    whole = frame + math.floor(time - frame)
    share = time - whole
    start, centre = places(frame)
    (first, first_centre), (second, second_centre) = places(whole), places(whole + 1 if share else whole)
    if centre is None or first_centre is None or second_centre is None or abs(start.scale) < _SMALLEST:
        return Similarity()
    placement = motions.between(first, second, share)
    moved = (1 - share) * first_centre + share * second_centre
    if start == placement and np.array_equal(centre, moved):
        return Similarity()  # exactly
    return motions.motion_between(start, placement, centre, moved, size)
