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
from .clip import Clip, ShownFrame
from .effect import Camera, Effect, MatteRegion, Region, Subject
from .frame_state import Following, FrameState, Layers, Options
from .mattes import Matte
from .motions import Placement, Similarity


class ShownState(NamedTuple):
    """What an effect needs for a picture at one timeline frame: its state, and the footage's frame shown there.

    Attributes:
        source_frame: The footage's shown frame, from 0, counting moments (frames made between two filmed ones).
        state: The effect's state.
        direction: 1 where the footage plays forward, −1 where it plays backward.
    """

    source_frame: int
    state: FrameState
    direction: int


def state_at(effect: Effect, clip: Clip, frame: float) -> ShownState:
    """Return an effect's state at a timeline frame, complete except for what needs the footage's pictures.

    In addition to Effect.at, its bars are those of moments (frames made between two filmed ones), exposures have the
    length that a motion or the timeline sets, and it has followed motions and layers. Cuts in the footage do not matter
    here: they are only found by reading pictures.

    Args:
        clip: The footage. If the effect has a `time` of its own, that replaces the clip's timing.
        frame: The timeline frame, possibly between two whole ones.

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
    return ShownState(at.source_frame, _layered(effect, state, clip, at), at.direction)


def _in_moments(effect: Effect, state: FrameState, clip: Clip, at: ShownFrame) -> FrameState:
    """Return the state with its bars and window in moments: filmed frames, and those that are made between them.

    Options.window then counts moments; Options.step and `backward` are set. Bars that only give an exposure's shape are
    spread evenly over their moments, so that the shape stays.

    Args:
        state: Its state at the shown frame, with bars of filmed frames.
        clip: The footage; its `step` is the number of moments per filmed frame.
        at: The shown frame.
    """
    options = replace(state.options, window=state.options.window * clip.step, step=clip.step, backward=at.direction < 0)
    if clip.step == 1:
        return replace(state, options=options)
    bars = [
        shutter.bars.at(at.frame, options.interpolation, shutter.spread(clip.step, options.backward))
        for shutter in effect.shutters
    ]
    return replace(state, bars=np.stack(bars), options=options)


def _layered(effect: Effect, state: FrameState, clip: Clip, at: ShownFrame) -> FrameState:
    """Return the state with the effect's layers, and their mattes in all source frames that the picture may use.

    These are the frames of the window, and those around it that are searched for the background (Options.plate_reach).
    The state is unchanged if no layer is visible.

    Args:
        state: Its state at the shown frame, in moments.
        clip: The footage.
        at: The shown frame.

    Raises:
        EffectError: The strokes of a region, which need not be a layer, are too far outside the picture.
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
    """Return a region's matte at a time between two timeline frames: that of the nearer one, or the first halfway.

    Args:
        region: The region; one of strokes has no matte, so the result is None.
        frame: The timeline frame before the time.
        share: How far the time is from that frame to the next one, 0 to 1.
    """
    return region.at(frame + round(share)) if isinstance(region, MatteRegion) else None


def _scribbles(
    effect: Effect, state: FrameState, drawn: Sequence[tuple[int, Region]], count: int, frame: float, share: float
) -> FrameState:
    """Return the state that stands for the drawn layers in one source frame (Layers.scribbles).

    Its shutter 1 + i stands for layer i, and its shutter 0 for what belongs to no layer. Its scribbles are opaque;
    regions whose opacity is 0 have none.

    Args:
        state: The effect's state at the shown frame, whose options are used, except `edge_aware`.
        drawn: (1 + the layer's index, region) for each region of strokes, later ones on top; 0 instead for a region
            that is no layer.
        count: The number of layers, drawn or not.
        frame: The timeline frame at the source frame's time, or less than one frame before it.
        share: How far the source frame's time is from that frame to the next one, 0 to 1.
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

# Gives placement and center (2,) at a frame; the center is None if nothing is drawn.
Places = Callable[[float], tuple[Placement, np.ndarray | None]]


def followed(effect: Effect, state: FrameState, clip: Clip, at: ShownFrame) -> FrameState:
    """Return the state with the motions that shutters follow, and with exposures whose length depends on these motions.

    The state is unchanged if no shutter follows anything.

    Args:
        state: Its state at the shown frame, in moments.
        clip: The footage.
        at: The shown frame.

    Raises:
        EffectError: The strokes of something that is followed are too far outside the picture.
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


def _with_trails(effect: Effect, state: FrameState, following: Following, clip: Clip, at: ShownFrame) -> np.ndarray:
    """Return the state's bars (N, L), stretched or shortened where a motion sets the exposure's length.

    A shutter of the length "motion" is open while the subject that it follows moves by the shutter's distance
    (Shutter.trail). Exposures that follow the camera are then shortened by Camera.influence.

    Args:
        state: Its state at the shown frame, in moments.
        following: The motion of each shutter's subject in each source frame.
        clip: The footage.
        at: The shown frame.
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
    """Return how many timeline frames on each side of the shown one are searched for a window's source frames.

    This is 4 × the window, enough for footage that is slowed down to a quarter of its speed. Source frames that are not
    found get the motion of the nearest one.

    Args:
        filmed: The number of filmed frames in the window.
    """
    return 4 * filmed


def seen(options: Options, at: ShownFrame, count: int) -> range:
    """Return all source frames that the window can show, whichever cuts there are in the footage.

    The range lies in the footage. It always includes the shown frame, and is wider if the window can be moved away from
    a cut ("slide") or folded back at an end ("mirror").

    Args:
        options: The state's options, in moments.
        at: The shown frame.
        count: The number of source frames of the footage.
    """
    positions = windows.positions(options, at.source_frame, at.direction)
    if options.edges == "slide" and options.stop_at_cuts:  # a cut may lie on either side
        positions = at.source_frame + np.array([-1, 1]) * (options.window + options.step)
    beyond = options.window if options.edges == "mirror" else 0
    low, high = min(positions.min(), at.source_frame) - beyond, max(positions.max(), at.source_frame) + beyond
    return range(max(int(low), 0), min(int(high), count - 1) + 1)


def times_of(clip: Clip, at: ShownFrame, wanted: range, reach: int) -> list[float]:
    """Return the timeline time at which each wanted source frame is shown, the one nearest to the shown frame.

    Args:
        clip: The footage.
        at: The shown frame.
        wanted: The source frames, including the shown one.
        reach: How many timeline frames before and after the shown one are searched. A source frame that is not found
            gets the time of the nearest source frame that is.

    Returns:
        A timeline frame for each of `wanted`, with a fraction if the timeline skips that source frame.
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
    """Return a function that gives a subject's placement and center at a timeline frame, as a shutter follows it.

    The center is None where nothing is drawn, or with smoothing, at any of the averaged frames.

    Args:
        subject: The region or camera.
        motion: Which of the placement's parts are used, as in motions.only; the others have no effect.
        smooth: How many frames on each side placement and center are averaged over (`smoothing`). 0: they are not.
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
    """Return how a subject moves from one timeline frame to n other times.

    Args:
        places: From `places_of`.
        clip: The footage, for the picture's size.
        frame: The timeline frame at which the motions begin.
        times: The n timeline frames at which they end, possibly with fractions.

    Returns:
        The motions' turns and shifts, (2, n) complex128, as in motions.Similarity.
    """
    found = [motion_to(places, frame, time, (clip.width, clip.height)) for time in times]
    return np.array([(motion.turn, motion.shift) for motion in found], np.complex128).T


def motion_to(places: Places, frame: float, time: float, size: tuple[int, int]) -> Similarity:
    """Return the motion by which a subject goes from a timeline frame to another time.

    Args:
        places: From `places_of`.
        frame: The timeline frame at which the motion begins.
        time: The time at which it ends, a timeline frame, possibly with a fraction. Placements are linear between two
            frames.
        size: Width and height of the picture, in pixels.

    Returns:
        The motion; Similarity(), which moves nothing, if nothing is drawn at one of the frames, or if the subject's
        scale is almost 0 at `frame`.
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
    """Return how far something has moved by each boundary of the window's L bars: (L + 1,), ascending from 0.

    From frame to frame the point that moves farthest counts. A bar has half of the distance from the frame before and
    half of that to the frame after. The first and last bar lack one side, and count the other twice.

    Args:
        places: Where the thing's P points lie in each of the window's frames, (L, P) complex, in pixels. The result has
            the same unit.
    """
    steps = np.abs(np.diff(places, axis=0)).max(axis=1, initial=0)
    if not steps.size:
        return np.zeros(2)
    own = (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])) / 2
    return np.concatenate([[0.0], np.cumsum(own)])


def shortened(bars: np.ndarray, share: float, shown: float) -> np.ndarray:
    """Return bars (L,) whose open part is shortened towards the shown frame. Shape and sum stay.

    Args:
        bars: (L,).
        share: 0 to 1, how much stays of the open part's length beyond one frame: at 0 the part lasts for one frame.
        shown: The middle of the shown frame's bar, as a time in 0 … L. If the frame lies outside the open part, the
            nearest end of that takes its place.
    """
    bars = np.where(shutters.are_open(bars), bars, 0)
    first, last = shutters.open_span(bars)
    own = min(max(shown - 0.5, first), last - 1)
    start, end = own + share * (first - own), own + 1 + share * (last - own - 1)
    return shutters.spanning(bars, start, end)


def with_length(bars: np.ndarray, way: np.ndarray, length: float, shown: float) -> np.ndarray:
    """Return bars (L,) that are open while something moves by a given distance. Shape and sum stay.

    Their open part is stretched or shrunk. If the thing does not move that far, it lasts for the whole window.

    Args:
        bars: (L,).
        way: How far the thing has moved by the boundaries of the bars, (L + 1,), from `travelled`.
        length: The distance, in the same unit.
        shown: The time, in 0 … L, of the shown frame's middle: it keeps its relative place in the open part. If it lies
            outside, the nearest end of that takes its place. An open part that reaches one end of the window grows only
            towards the other end.
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


def exposed(effect: Effect, state: FrameState, clip: Clip, at: ShownFrame) -> FrameState:
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
    """Return bars (L,) of the window from bars that only give the shape of an exposure of one timeline frame.

    The shape is spread over what the footage plays in that timeline frame: from the start of the shown filmed frame on
    ("start" in Options.position), around its middle ("center"), or up to its end ("end"). What lies beyond the window
    is left out, and the rest is scaled to the sum of `bars`. If the footage stands still, or all lies outside, only the
    shown frame is exposed.

    Args:
        bars: (L,), the shape.
        options: Of the state, in moments.
        positions: Where the footage is (Clip.position) at an odd number of times, evenly spaced from the previous
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
    """Return which share (L,) of the time from `start` to `end` falls on each frame of a window of L frames.

    Args:
        start, end: Times in frames from the window's start, start ≤ end. The part outside the window is lost, so that
            the sum is less than 1. If they are almost equal, the frame that they lie in gets 1.
        window: The number of frames L.
    """
    if end - start < _INSTANT:
        return (np.arange(window) == np.floor(start + _INSTANT)).astype(float)
    boundaries = np.clip(np.arange(window + 1), start, end)
    return np.diff(boundaries) / (end - start)
