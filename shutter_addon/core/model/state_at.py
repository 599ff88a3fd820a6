"""The state of an effect at a timeline frame: `state_at` puts together everything that a picture needs, as plain data.

Exposures can follow a motion. Keys of regions and of the camera are on timeline frames, but a window consists of source
frames. So the content of a source frame is where the keys place it at the timeline frame that shows this source frame:
the nearest one to the shown frame if there are several, or a time between two timeline frames for source frames that
are skipped and for moments. Between timeline frames, motion is linear.

Exposures can also have a length that the bars do not set. Then bars only describe a shape:

Trail length: the shutter is open while what it follows moves by a given distance, at any speed. The bars' times are
scaled about the shown frame, so that the quantile keeps its shape. The span is not a whole number of frames and changes
without jumps.

Timeline length: the bars are the shape of an exposure over one frame of the timeline, at any speed of the footage, as
if a camera with the timeline's frame rate had filmed what is seen. If the footage runs s source frames per timeline
frame, a fully open shutter exposes s of them. In a freeze it exposes the shown frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from . import motions, scribbles, shutters, windows
from .clip import Clip, Shown
from .effect import Camera, Effect, MatteRegion, Region, Subject
from .frame_state import Following, FrameState, Layers, Options
from .mattes import Matte
from .motions import Placement, Similarity


class Moment(NamedTuple):
    """The state of an effect at a timeline frame, and the frame of the footage that is shown there.

    Attributes:
        source_frame: The shown frame of the clip, from 0.
        state: The effect.
        direction: 1, or −1 where the footage plays backward.
    """

    source_frame: int
    state: FrameState
    direction: int


def state_at(effect: Effect, clip: Clip, frame: float) -> Moment:
    """Return an effect's state at a timeline frame, with everything that does not need the footage's pictures.

    Beyond Effect.at, it has bars of moments, exposures with lengths of their own, followed motions, and layers. Cuts
    are not considered yet, since no frame is read.

    Raises:
        EffectError: No picture can be made of the effect.
    """
    if effect.time is not None:
        clip = replace(clip, timing=effect.time)
    at = clip.shown(frame)
    state = _in_moments(effect, effect.at(frame), clip, at)
    state = exposed(effect, state, clip, at)
    has_trails = any(shutter.has_trail for shutter in effect.shutters)
    state = windows.slid(state, at.source_frame, at.direction, range(clip.count), whole=has_trails)
    state = followed(effect, state, clip, at)
    return Moment(at.source_frame, _layered(effect, state, clip, at), at.direction)


def _in_moments(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """Return the state with bars and window in the clip's moments: filmed frames, and those made between them.

    There are `clip.step` moments per filmed frame. Bars that are only the shape of an exposure are spread evenly, so
    that the shape stays.
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
    """Return the state with the effect's layers, and their mattes in all source frames that the picture may use.

    Raises:
        EffectError: The strokes of a layer are too far outside the picture.
    """
    if not (regions := effect.layers_at(at.frame)):
        return state
    shown, beyond, step = seen(state.options, at, clip.count), state.options.plate_reach, state.options.step
    frames = range(max(shown.start - beyond * step, 0), min(shown.stop + beyond * step, clip.count))
    times = times_of(clip, at, frames, reach(state.options.filmed) + beyond)
    moments = [(at.frame + math.floor(time - at.frame), (time - at.frame) % 1.0) for time in times]
    drawn = [(1 + i, region) for i, region in enumerate(regions) if isinstance(region, Region)]
    others = [(0, region) for region in effect.regions if isinstance(region, Region) and region not in regions]
    camera = None
    if effect.camera.moves.are_keyed:
        turns, shifts = moves(places_of(effect.camera), clip, at.frame, times)
        camera = Following(frames.start, turns[:, None], shifts[:, None]).of(slice(None))
    return replace(
        state,
        layers=Layers(
            shutters=tuple(region.shutter for region in regions),
            opacities=tuple(float(region.opacity.at(at.frame)) for region in regions),
            first=frames.start,
            scribbles=tuple(
                _scribbles(effect, state, (*others, *drawn), len(regions), *moment)
                if drawn and (frame in shown or frame % step == 0)  # plates are taken from filmed frames
                else None
                for frame, moment in zip(frames, moments, strict=True)
            ),
            mattes=tuple(tuple(_matte(region, *moment) for region in regions) for moment in moments),
            camera=camera,
        ),
    )


def _matte(region: Region | MatteRegion, frame: float, share: float) -> Matte | None:
    """Return a region's matte between two timeline frames: that of the nearer one. A region of strokes has none.

    Args:
        region: The region.
        frame: The timeline frame before.
        share: The share of the way to the next frame, 0 to 1.
    """
    return region.at(frame + round(share)) if isinstance(region, MatteRegion) else None


def _scribbles(
    effect: Effect, state: FrameState, drawn: Sequence[tuple[int, Region]], count: int, frame: float, share: float
) -> FrameState:
    """Return a state with the shapes of regions between two timeline frames, for Layers.scribbles.

    Shutter 1 + i of this state stands for layer i, and shutter 0 for what belongs to no layer.

    Args:
        effect: The effect.
        state: Its state at the shown frame, for the options.
        drawn: Regions, later ones on top, each with 1 + its layer's number, or 0 without a layer.
        count: The number of layers.
        frame: The timeline frame before.
        share: The share of the way to the next frame, 0 to 1.
    """
    placed = [(number, _between(region, frame, share)) for number, region in drawn]
    shapes = tuple(replace(shape, shutter=number, opacity=1.0) for number, shape in placed if shape.opacity > 0)
    options = replace(state.options, edge_aware=float(effect.edge_aware.at(frame + round(share))))
    return FrameState(options=options, bars=np.ones((1 + count, options.window)), shapes=shapes)


def _between(region: Region, frame: float, share: float) -> scribbles.Shape:
    """Return a region's shape between a timeline frame and the next one, at a share 0 to 1 of the way."""
    before = region.at(frame)
    if not share:
        return before
    after = region.at(frame + 1)
    strokes = scribbles.between_strokes(before.strokes, after.strokes, share, region.drawings.aspect)
    return replace(before, strokes=tuple(strokes), width=(1 - share) * before.width + share * after.width)


# Below this scale a subject is a point, which does not tell where other points are.
_SMALLEST = 1e-6

# Gives placement and centre (2,) at a frame; the centre is None if nothing is drawn.
Places = Callable[[float], tuple[Placement, np.ndarray | None]]


def followed(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """Add the motions that shutters follow to the state, and the lengths of exposures that depend on these motions.

    Raises:
        EffectError: The strokes of something followed are too far outside the picture.
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
    """Return the state's bars (N, L), stretched or shortened where a motion sets the exposure's length.

    Trails are open while what they follow moves by their distance; Camera.influence shortens the camera's exposures.
    """
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
            way = travelled(places) / clip.height
            bars[i] = with_length(bars[i], way, float(shutter.trail.at(at.frame)), shown_at)
        share = float(shutter.follow.influence.at(at.frame)) if isinstance(shutter.follow, Camera) else 1.0
        if share < 1:
            bars[i] = shortened(bars[i], share, shown_at)
    return bars


def reach(filmed: int) -> int:
    """Return how many timeline frames before and after the shown one are searched for a window's source frames.

    This is 4 × the window, enough for footage at a quarter of its speed. Source frames beyond get the nearest motion.

    Args:
        filmed: The number of filmed frames in the window.
    """
    return 4 * filmed


def seen(options: Options, at: Shown, count: int) -> range:
    """Return the source frames that a window may show, wherever the cuts around it lie.

    Args:
        options: The state's options.
        at: The shown frame.
        count: The number of source frames.
    """
    positions = windows.positions(options, at.source_frame, at.direction)
    if options.edges == "slide" and options.stop_at_cuts:  # a cut may lie on either side
        positions = at.source_frame + np.array([-1, 1]) * (options.window + options.step)
    beyond = options.window if options.edges == "mirror" else 0
    low, high = min(positions.min(), at.source_frame) - beyond, max(positions.max(), at.source_frame) + beyond
    return range(max(int(low), 0), min(int(high), count - 1) + 1)


def times_of(clip: Clip, at: Shown, wanted: range, reach: int) -> list[float]:
    """Return a timeline time for each wanted source frame: when the timeline shows it, nearest to the shown frame.

    Args:
        clip: The footage.
        at: The shown frame.
        wanted: The source frames.
        reach: Timeline frames before and after the shown one that are searched. A source frame that is not shown there
            has the time of the nearest one that is.

    Returns:
        Timeline frames, with a fraction if the timeline skips the source frame.
    """
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
    """Return weights (2 · smooth + 1,) with the sum 1 for averaging a motion over `smooth` frames on each side.

    The weights form a bell, since equal ones would leave jolts.
    """
    bell = 1 + np.cos(np.pi * np.arange(-smooth, smooth + 1) / (smooth + 1))
    return bell / bell.sum()


def places_of(subject: Subject, motion: motions.Motion = "scale", smooth: int = 0) -> Places:
    """Return a function of a timeline frame that gives a subject's placement and centre, as a shutter follows it.

    Args:
        subject: The region or camera.
        motion: What counts of its motion.
        smooth: Frames on each side over which it is averaged.
    """

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
    """Return the motions by which a subject goes from a timeline frame to n times: turns and shifts, (2, n) complex128.

    Args:
        places: From `places_of`.
        clip: The footage, for the picture's size.
        frame: The timeline frame.
        times: n timeline frames, possibly with fractions.
    """
    found = [motion_to(places, frame, time, (clip.width, clip.height)) for time in times]
    return np.array([(motion.turn, motion.shift) for motion in found], np.complex128).T


def motion_to(places: Places, frame: float, time: float, size: tuple[int, int]) -> Similarity:
    """Return the motion by which a subject goes from a timeline frame to a time; no motion if nothing is drawn.

    Args:
        places: From `places_of`.
        frame: The timeline frame.
        time: A timeline frame, possibly with a fraction; the motion is linear between two frames.
        size: Of the picture (width, height).
    """
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


# Frames: shorter spans of the timeline expose a single frame.
_INSTANT = 1e-6
# Fraction of the exposure that the window has to contain.
_LEAST = 1e-9


def travelled(places: np.ndarray) -> np.ndarray:
    """Return how far something has moved at the boundaries of the window's bars: (L + 1,), ascending from 0.

    The point that moves farthest counts, frame by frame. Half of the way between two frames belongs to each of their
    bars. The first and the last bar go on at the pace beside them.

    Args:
        places: (L, P) complex, where P of its points lie in the window's frames.
    """
    steps = np.abs(np.diff(places, axis=0)).max(axis=1, initial=0)
    if not steps.size:
        return np.zeros(2)
    own = (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2
    return np.concatenate([[0.0], np.cumsum(own)])


def shortened(bars: np.ndarray, share: float, shown: float) -> np.ndarray:
    """Return bars (L,) of the same shape and sum that are open for a share of their time, but at least for one frame.

    Args:
        bars: (L,).
        share: 0 to 1. The time shrinks towards the shown frame.
        shown: The middle of the shown frame's bar, in 0 … L; clamped to the open bars.
    """
    bars = np.where(shutters.are_open(bars), bars, 0)
    first, last = shutters.open_span(bars)
    own = min(max(shown - 0.5, first), last - 1)
    start, end = own + share * (first - own), own + 1 + share * (last - own - 1)
    return shutters.spanning(bars, start, end)


def with_length(bars: np.ndarray, way: np.ndarray, length: float, shown: float) -> np.ndarray:
    """Return bars (L,) of the same shape and sum that are open while something moves by a distance.

    If it does not move as far, they are open for the whole window.

    Args:
        bars: (L,).
        way: How far it has moved at the bars' boundaries (L + 1,), from `travelled`.
        length: The distance, in the same unit.
        shown: The time in 0 … L that keeps its place, clamped to the open bars. If the exposure reaches one end of the
            window, it only grows towards the other.
    """
    bars = np.where(shutters.are_open(bars), bars, 0)
    first, last = shutters.open_span(bars)
    about = min(max(shown, first), last)
    before = (about - first) / (last - first)
    boundaries = np.arange(len(way), dtype=np.float64)

    def starts(widths: np.ndarray | float) -> np.ndarray:
        return np.clip(about - before * widths, 0, len(bars) - widths)

    # The way within a span is piecewise linear in the span's width. It bends where an end passes a boundary.
    bends = [boundaries]
    bends += [(boundaries - about) / share for share in (-before, 1 - before) if share]
    widths = np.unique(np.concatenate(bends).clip(0, len(bars)))
    moved = np.interp(starts(widths) + widths, boundaries, way) - np.interp(starts(widths), boundaries, way)
    moved = np.maximum.accumulate(moved)  # avoids a decrease from rounding
    # Reversed, so that the smallest of the widths without added motion counts: a trail of length 0 is a still frame.
    width = float(np.interp(-length, -moved[::-1], widths[::-1]) if length <= moved[-1] else len(bars))
    width = max(width, 1e-3)  # frames that the shortest trail lasts
    start = float(starts(width))
    return shutters.spanning(bars, start, start + width)


def exposed(effect: Effect, state: FrameState, clip: Clip, at: Shown) -> FrameState:
    """Replace the bars of shutters whose `length` is "timeline", so that they expose one timeline frame."""
    chosen = [i for i, shutter in enumerate(effect.shutters) if shutter.length == "timeline"]
    if not chosen:
        return state
    places = np.array([clip.position(at.frame + k) for k in (-1, -0.5, 0, 0.5, 1)])
    here = places[2]
    if places[0] == here in clip.ends:  # the strip repeats its end frame there, which is not a freeze
        places[:2] = 2 * here - places[:2:-1]
    elif places[4] == here in clip.ends:
        places[3:] = 2 * here - places[1::-1]
    bars = state.bars.copy()
    for index in chosen:
        bars[index] = on_timeline(bars[index], state.options, places)
    return replace(state, bars=bars)


def on_timeline(bars: np.ndarray, options: Options, positions: np.ndarray) -> np.ndarray:
    """Return bars (L,) of the window for bars that shape an exposure of one timeline frame. Their sum stays.

    By Options.position, the exposure begins with the shown filmed frame, has its middle there, or ends with it. What
    lies outside the window is left out.

    Args:
        bars: (L,), the shape.
        options: Of the state.
        positions: The footage's positions (Clip.position) at n times (n odd) at even distances, from the previous
            timeline frame to the next one.
    """
    window, here = len(bars), positions[len(positions) // 2]
    begin, anchor = {
        "start": (0.0, 0.0),
        "center": (-0.5, options.step / 2),
        "end": (-1.0, float(options.step)),
    }[options.position]
    times = begin + np.arange(window + 1) / window
    way = np.interp(times, np.linspace(-1, 1, len(positions)), positions) - here
    places = options.before + anchor + (-way if options.backward else way)
    found, shown = np.zeros(window), min(options.shown, window - 1)  # the window may be shorter than a filmed frame
    if np.ptp(places) < _INSTANT:
        found[shown] = bars.sum()
        return found
    for weight, start, end in zip(bars, places[:-1], places[1:], strict=True):
        found += weight * _spread(min(start, end), max(start, end), window)
    if found.sum() <= _LEAST * bars.sum():  # everything is outside the window
        found[shown] = 1.0
    return found * (bars.sum() / found.sum())


def _spread(start: float, end: float, window: int) -> np.ndarray:
    """Return which share (L,) of the time from `start` to `end` falls on each of a window's L frames.

    Times are in frames from the window's start. What lies outside is lost. A time without length falls on one frame.
    """
    if end - start < _INSTANT:
        return (np.arange(window) == np.floor(start + _INSTANT)).astype(float)
    boundaries = np.clip(np.arange(window + 1), start, end)
    return np.diff(boundaries) / (end - start)
