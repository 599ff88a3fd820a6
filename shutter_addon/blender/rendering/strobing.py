"""Whether an exposure has too few frames for its streaks: how far what it shows moves from one frame of it to the next,
how many in-between frames help, and what these cost.

It is measured in a thread that touches no bpy, of a few frames of the footage, and only when the interface says so
(`advance`): drawing asks for what is known, and never waits."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import PropertyGroup, Strip

from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core import threads
from ...core.frames.frame_source import FrameSource
from ...core.messages import translated
from ...core.model import shutters, windows
from ...core.model.frame_state import FrameState
from ...core.model.motions import Similarity
from ...media import MediaError, inbetween, opencv, steps
from ..data import inbetween_settings
from ..data.snapshot import Snapshot
from ..data.source_media import SourceSpec
from . import effect_source

FACTORS = 2, 4, 8, 16
# Copies that lie so far apart, in heights of the picture, look like a streak: 3 pixels of 1080; at 4, lines show in
# sharp lettering. Edges of footage are some 2 pixels wide, however small it is.
_SMOOTH, _SMOOTH_PIXELS = 3 / 1080, 2.0
_PAIRS = 4  # of neighbouring frames that are measured for a picture, at most
_KEPT = 64  # pairs whose motion is kept, of half a megabyte each


class Strobing(NamedTuple):
    """An exposure with too few frames.

    step: pixels of the footage from one of its frames to the next
    factor: of in-between frames, with which it looks smooth, or as smooth as can be; None: there is none
    seconds, size: of all that the strip needs, and bytes, about; None: that is not known yet"""

    step: float
    factor: int | None
    seconds: float | None = None
    size: float | None = None


_moved: dict[tuple, steps.Moved | None] = {}  # by a source's key and a pair
_costs: dict[tuple, inbetween.Cost | None] = {}  # by a source's key and a method
_last_looks: dict[int, tuple[float, Strobing | None]] = {}  # by scene: the timeline frame that was looked at last


@dataclass
class _Measuring:
    """wanted: what was asked for last; job: what is measured"""

    wanted: Callable[[], None] | None = None
    job: Future | None = None


_measuring = _Measuring()
_stopped = threading.Event()


class Looked(NamedTuple):
    """known: of a picture's exposure, None: nothing, or it is smooth; is_new: whether the last look saw another;
    is_busy: whether something is measured, or asked for"""

    known: Strobing | None
    is_new: bool
    is_busy: bool


def look(effect: PropertyGroup, strip: Strip, snapshot: Snapshot, renderer: Renderer, request: Request) -> Looked:
    """Looks at a picture's exposure. What is not known is asked for."""
    _measuring.wanted, before = None, last(effect)
    frame, known = effect.id_data.frame_current, _look(effect, strip, snapshot, renderer, request)
    _last_looks[snapshot.scene] = frame, known
    return Looked(known=known, is_new=known != before, is_busy=is_busy())


def last(effect: PropertyGroup) -> Strobing | None:
    """What the last look has found, if it was at the effect's current frame."""
    frame, known = _last_looks.get(effect.scene.session_uid, (None, None))
    return known if frame == effect.id_data.frame_current else None


def _look(
    effect: PropertyGroup, strip: Strip, snapshot: Snapshot, renderer: Renderer, request: Request
) -> Strobing | None:
    ways = _ways(renderer, request)
    pairs = _chosen(sorted(ways))
    if lacking := [pair for pair in pairs if (snapshot.source.key, pair) not in _moved]:
        _measuring.wanted = partial(_measure_motion, snapshot.source, lacking)
        return None
    known = [(motion, way) for pair in pairs for way in ways[pair] if (motion := _moved[snapshot.source.key, pair])]
    height = effect.scene.render.resolution_y
    step = max((steps.step(motion, *way) for motion, way in known), default=0.0) * height / request.state.options.step
    if step <= smooth(height):
        return None
    factor = _factor(request.state, step / smooth(height))
    if factor is None:
        return Strobing(step=step, factor=None)
    key = snapshot.source.key, inbetween_settings.method(effect)
    if key not in _costs:
        _measuring.wanted = partial(_measure_cost, snapshot.source, pairs[0], key)
    if (cost := _costs.get(key)) is None:
        return Strobing(step=step, factor=factor)
    count = _count(strip, snapshot, renderer.source, request)
    return Strobing(step=step, factor=factor, seconds=cost.seconds(count, factor), size=cost.bytes(count, factor))


def smooth(height: int) -> float:
    """Up to how many pixels from frame to frame a streak looks smooth, in a picture of that height."""
    return max(_SMOOTH * height, _SMOOTH_PIXELS)


def _ways(renderer: Renderer, request: Request) -> dict[int, list[tuple[Similarity, Similarity]]]:
    """By pairs of filmed frames, each by its first, over which a shutter stays open that is seen: where the points of
    the shown picture lie in the two, in heights of the picture, for each of these shutters."""
    request, source = renderer.slid(request, known=True), renderer.source
    state = request.state
    options, count = state.options, state.options.step
    ways: dict[int, list[tuple[Similarity, Similarity]]] = {}
    shot = renderer.shot(request, known=True)
    frames = windows.indices(options, request.index, shot, request.direction)
    for i in _seen(state):
        if state.combines and state.combines[i].mode == "median":  # which leaves no streaks
            continue
        is_open = state.bars[i] > 0
        both = is_open[1:] & is_open[:-1] & (frames[1:] != frames[:-1]) & (frames[1:] >= 0) & (frames[:-1] >= 0)
        for pair in set((np.minimum(frames[1:], frames[:-1])[both] // count).tolist()):
            before, after = (_way(state, i, end * count, source.height) for end in (pair, pair + 1))
            ways.setdefault(pair, []).append((before, after))
    return ways


def _seen(state: FrameState) -> set[int]:
    """The shutters that pixels are exposed with."""
    drawn = {shape.shutter for shape in state.shapes if len(shape.strokes)}
    if state.options.border or not drawn:
        drawn.add(0)
    return drawn | {matte.shutter for matte in state.mattes} | set(state.layers.shutters if state.layers else ())


def _way(state: FrameState, shutter: int, frame: int, height: int) -> Similarity:
    if state.following is None:
        return Similarity()
    turns, shifts = state.following.at([frame])
    return Similarity(complex(turns[0, shutter]), complex(shifts[0, shutter]) / height)


def _chosen(pairs: list[int]) -> list[int]:
    """A few of them: those of neighbouring pictures are the same, mostly."""
    apart = 1
    while len(pairs) > apart * _PAIRS:
        apart *= 2
    return [pair for pair in pairs if pair % apart == 0] or pairs[:1]


def _factor(state: FrameState, ratio: float) -> int | None:
    """The least factor with which steps get smaller by a ratio, or the largest that there is room for."""
    now, window = state.options.step, state.options.window
    possible = [factor for factor in FACTORS if factor > now and window * factor // now <= shutters.MAX_WINDOW]
    return next((factor for factor in possible if factor >= ratio * now), possible[-1] if possible else None)


def _count(strip: Strip, snapshot: Snapshot, source: Any, request: Request) -> int:
    """About how many pairs the strip's pictures need, or a few more."""
    options = request.state.options
    all_pairs = source.filmed - 1
    if snapshot.timing is None:
        return all_pairs
    clip = effect_source.clip_of(snapshot, source)
    ends = strip.left_handle, strip.right_handle - 1
    first, final = (clip.shown(frame).source_frame // options.step for frame in ends)
    return min(abs(final - first) + -(-options.window // options.step), all_pairs)


def pairs(snapshot: Snapshot, medium: FrameSource, factor: int) -> list[int]:
    """The pairs of filmed frames, each by its first, ascending, whose in-between frames an effect strip needs with
    this factor, in place of its own, at the snapshot's frames: those across cuts as well, which take no time.
    EffectError, MediaError: that cannot be known."""
    needed: set[int] = set()
    clip = effect_source.clip_of(snapshot, medium).stepped(factor)
    moved = (
        shutter.has_trail or shutter.length == "timeline" or shutter.use_threshold
        for shutter in snapshot.effect.shutters
    )
    has_trails = any(moved)
    for frame in snapshot.frames:
        with translated(rpt_):
            state = snapshot.effect.at(frame)
        options, position = state.options, state.options.position
        bars = np.stack([shutters.multiplied(row, options.step, factor, position) for row in state.bars])
        options = replace(options, step=factor, window=bars.shape[1])
        _frame, index, direction = clip.shown(frame)
        places = windows.positions(options, index, direction)
        if options.edges == "mirror":  # at a cut, on the other side of it
            places = np.arange(places.min() - options.window, places.max() + options.window + 1)
        elif options.edges != "shorten" and not has_trails:
            places = places[slice(*shutters.open_span(bars))]
        if options.edges == "slide":  # at an end, or a cut that is not known yet
            places = np.append(places, np.arange(index - len(places) + 1, index + len(places)))
        shown = windows.source_frames(options, np.append(places, index), range(clip.count))
        needed.update((shown[(shown >= 0) & (shown % factor > 0)] // factor).tolist())
    return sorted(needed)


def is_busy() -> bool:
    """Whether something is measured, or asked for."""
    return _measuring.job is not None or _measuring.wanted is not None


def advance() -> bool:
    """Begins to measure what was asked for last; True: something was measured meanwhile."""
    if _measuring.job is not None and not _measuring.job.done():
        return False
    ended, _measuring.job = _measuring.job is not None, None
    if _measuring.wanted is not None:
        _stopped.clear()
        _measuring.job, _measuring.wanted = threads.start(_measuring.wanted), None
    return ended


def forget() -> None:
    """Ends what is measured, and forgets what was: when a file is loaded, and when the extension goes."""
    _stopped.set()
    if _measuring.job is not None:
        wait([_measuring.job])
    _measuring.job = _measuring.wanted = None
    for known in (_moved, _costs, _last_looks):
        known.clear()


def _measure_motion(spec: SourceSpec, lacking: list[int]) -> None:
    for pair in lacking:
        _moved[spec.key, pair] = None  # what cannot be read is not tried again
    if opencv.cv2 is None:
        return
    with suppress(MediaError, OSError), spec.open() as medium:
        for pair in lacking:
            if not _stopped.is_set():
                _moved[spec.key, pair] = steps.moved(medium, pair)
    while len(_moved) > _KEPT:
        del _moved[next(iter(_moved))]


def _measure_cost(spec: SourceSpec, pair: int, key: tuple) -> None:
    _costs[key] = None
    with suppress(MediaError, OSError), spec.open() as medium:
        _costs[key] = inbetween.cost(medium, pair, key[1])
