"""Whether an exposure of filmed frames has too few for its streaks: how far what it shows moves from one to the next.

It is measured in a thread that touches no bpy, of a few frames of the footage, and only when the interface says so
(`advance`): drawing asks for what is known, and never waits."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from bpy.types import PropertyGroup

from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core import threads
from ...core.memo import Kept
from ...core.model import windows
from ...core.model.frame_state import FrameState
from ...core.model.motions import Similarity
from ...media import MediaError, opencv, steps
from ..data.snapshot import Snapshot
from ..data.source_media import SourceSpec

_PAIRS = 4  # of neighbouring frames that are measured for a picture, at most
_KEPT = 64  # pairs whose motion is kept, of half a megabyte each


_moved: Kept[tuple, steps.Moved | None] = Kept()  # by a source's key and a pair
# By scene: the timeline frame that was looked at last, what is known of it, and whether its source repeats frames.
_last_looks: dict[int, tuple[float | None, float | None, bool]] = {}
_NEVER = None, None, False


@dataclass
class _Measuring:
    """wanted: what was asked for last; job: what is measured"""

    wanted: Callable[[], None] | None = None
    job: Future | None = None


_measuring = _Measuring()
_stopped = threading.Event()


def look(effect: PropertyGroup, snapshot: Snapshot, renderer: Renderer, request: Request) -> tuple[float | None, bool]:
    """Pixels of the footage from one frame of a picture's exposure to the next, None: nothing is known, or it is
    smooth; and whether the last look saw something else. What is not known is asked for."""
    _measuring.wanted, before = None, (last(effect), repeats(effect))
    frame, known = effect.id_data.frame_current, _look(effect, snapshot, renderer, request)
    _last_looks[snapshot.scene] = frame, known, renderer.source.repeats
    return known, (known, renderer.source.repeats) != before


def last(effect: PropertyGroup) -> float | None:
    """What the last look has found, if it was at the effect's current frame."""
    frame, known, _repeats = _last_looks.get(effect.scene.session_uid, _NEVER)
    return known if frame == effect.id_data.frame_current else None


def repeats(effect: PropertyGroup) -> bool:
    """Whether the last look has found that frames of the source repeat the one before."""
    return _last_looks.get(effect.scene.session_uid, _NEVER)[-1]


def _look(effect: PropertyGroup, snapshot: Snapshot, renderer: Renderer, request: Request) -> float | None:
    if effect.inbetween != "1":
        return None
    ways = _ways(renderer, request)
    pairs = _chosen(sorted(ways))
    if lacking := [pair for pair in pairs if (snapshot.source.key, pair) not in _moved]:
        _measuring.wanted = partial(_measure_motion, snapshot.source, lacking)
        return None
    known = [
        (motion, way) for pair in pairs for way in ways[pair] if (motion := _moved.get((snapshot.source.key, pair)))
    ]
    height = effect.scene.render.resolution_y
    step = max((steps.step(motion, *way) for motion, way in known), default=0.0) * height
    return step if step > steps.smooth(height) else None


def _ways(renderer: Renderer, request: Request) -> dict[int, list[tuple[Similarity, Similarity]]]:
    """By pairs of frames, each by its first, over which a shutter stays open that is seen: where the points of
    the shown picture lie in the two, in heights of the picture, for each of these shutters."""
    request, source = renderer.slid(request, known=True), renderer.source
    state = request.state
    ways: dict[int, list[tuple[Similarity, Similarity]]] = {}
    shot = renderer.shot(request, known=True)
    frames = windows.indices(state.options, request.index, shot, request.direction)
    for i in _seen(state):
        if state.combines and state.combines[i].mode == "median":  # which leaves no streaks
            continue
        is_open = state.bars[i] > 0
        both = is_open[1:] & is_open[:-1] & (frames[1:] != frames[:-1]) & (frames[1:] >= 0) & (frames[:-1] >= 0)
        for pair in set(np.minimum(frames[1:], frames[:-1])[both].tolist()):
            before, after = (_way(state, i, end, source.height) for end in (pair, pair + 1))
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
    for known in (_moved, _last_looks):
        known.clear()


def _measure_motion(spec: SourceSpec, lacking: list[int]) -> None:
    for pair in lacking:
        _moved.keep((spec.key, pair), None, _KEPT)  # what cannot be read is not tried again
    if opencv.cv2 is None:
        return
    with suppress(MediaError, OSError), spec.open() as medium:
        for pair in lacking:
            if not _stopped.is_set():
                _moved.keep((spec.key, pair), steps.moved(medium, pair), _KEPT)
