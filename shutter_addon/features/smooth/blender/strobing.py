"""Find out whether an exposure has too few frames, so that what moves shows as copies instead of a streak (strobing).

That depends on how far the picture moves between the exposed frames next to the shown one. A thread that touches no bpy
measures this when the interface calls `advance`; drawing only asks for what is known, and never waits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Context, Operator, PropertyGroup, UILayout

from ....blender.data import preview_areas
from ....blender.data.snapshot import Snapshot
from ....blender.data.source_media import SourceSpec
from ....blender.devices import main_thread
from ....blender.interface.operator_bases import operator
from ....blender.interface.panel_parts import sentence
from ....compute.renderer import Renderer
from ....compute.request import Request
from ....core import threads
from ....core.caches import RecentValues
from ....core.model import windows
from ....core.model.frame_state import FrameState
from ....core.model.motions import Similarity
from ....media import MediaError, opencv
from .. import smooth

_KEPT = 64  # pairs of frames whose motion is kept, half a megabyte each
_TRIED = 4  # pairs around the shown frame, until the motion of one can be found

_TICK = 0.25  # seconds between two looks at the thread
_STILL = 0.4  # seconds after which a frame counts as still

_NEVER = None, None, False


@dataclass
class _Measuring:
    """What is measured, and what is known.

    Attributes:
        moved: How the picture moves between two neighboring frames, by (SourceSpec.key, first of the two frames). None:
            the motion cannot be found, or it is being measured. Pairs that are not in it have yet to be measured.
        looks: What the last call of `look` found, by session_uid of the effect scene: the timeline frame, how many
            pixels the picture moves from one exposed frame to the next (None: nothing to report), and whether the
            source repeats frames.
        wanted: What to measure next: the source, and the first of two neighboring frames; None: nothing.
        job: The measurement that is running on a thread; None: none is.
    """

    moved: RecentValues[tuple, smooth.Moved | None] = field(default_factory=RecentValues)
    looks: dict[int, tuple[float | None, float | None, bool]] = field(default_factory=dict)
    wanted: tuple[SourceSpec, int] | None = None
    job: Future | None = None


_measuring = _Measuring()


def look(effect: PropertyGroup, snapshot: Snapshot, renderer: Renderer, request: Request) -> tuple[float | None, bool]:
    """Tell how far the picture moves between exposed frames, if that is too far for a streak.

    This never waits: if the motion is not known yet, it is noted as the next one to measure (`advance` does so).

    Returns:
        The step from one exposed frame to the next, in pixels of the picture. None: it is small enough for a streak, it
        is not known yet or cannot be found, or *Smooth* is on.
        Whether something is new: the step, or whether the source repeats frames, differs from what the last call for
        this effect found. A step found at another timeline frame counts as None.
    """
    _measuring.wanted, before = None, (last(effect), repeats(effect))
    frame, known = effect.id_data.frame_current, _step(effect, snapshot, renderer, request)
    _measuring.looks[snapshot.scene] = frame, known, renderer.source.repeats
    return known, (known, renderer.source.repeats) != before


def last(effect: PropertyGroup) -> float | None:
    """Return the motion between exposed frames, in pixels, that `look` found last; None: none, or at another frame."""
    frame, known, _repeats = _measuring.looks.get(effect.scene.session_uid, _NEVER)
    return known if frame == effect.id_data.frame_current else None


def repeats(effect: PropertyGroup) -> bool:
    """Tell whether the source repeats frames, as `look` found last."""
    return _measuring.looks.get(effect.scene.session_uid, _NEVER)[-1]


def _step(effect: PropertyGroup, snapshot: Snapshot, renderer: Renderer, request: Request) -> float | None:
    if effect.inbetween != "1":
        return None
    request = renderer.slid(request, known=True)
    exposed = _exposed_pairs(renderer, request)
    for pair in sorted(set().union(*exposed.values()), key=lambda first: abs(first - request.index))[:_TRIED]:
        key = snapshot.source.key, pair
        if key not in _measuring.moved:
            _measuring.wanted = snapshot.source, pair
            return None
        if (moved := _measuring.moved[key]) is not None:
            height, state = effect.scene.render.resolution_y, request.state
            shutters = [shutter for shutter, pairs in exposed.items() if pair in pairs]
            step = height * max(smooth.step(moved, *_ways(state, i, pair, renderer.source.height)) for i in shutters)
            return step if step > smooth.smooth_step(height) else None
    return None


def _exposed_pairs(renderer: Renderer, request: Request) -> dict[int, set[int]]:
    """Return for each visible shutter the pairs of neighboring source frames that it exposes without a gap.

    Only such pairs can make a streak. Shutters that take the median leave no streaks and are left out.

    Returns:
        By the shutter's index, the first frame of each pair, the earlier one in the footage.
    """
    state, pairs = request.state, {}
    shot = renderer.shot(request, known=True)
    frames = windows.indices(state.options, request.index, shot, request.direction)
    for i in _visible(state):
        if state.combines and state.combines[i].mode == "median":  # it leaves no streaks
            continue
        is_open = state.bars[i] > 0
        both = is_open[1:] & is_open[:-1] & (frames[1:] != frames[:-1]) & (frames[1:] >= 0) & (frames[:-1] >= 0)
        pairs[i] = set(np.minimum(frames[1:], frames[:-1])[both].tolist())
    return pairs


def _visible(state: FrameState) -> set[int]:
    """Return the indices of the shutters that have strokes, mattes or layers; no pixels are examined.

    The default shutter, 0, counts too if there are no strokes or if the picture's border gets it.
    """
    drawn = {shape.shutter for shape in state.shapes if len(shape.strokes)}
    if state.options.border or not drawn:
        drawn.add(0)
    return drawn | {matte.shutter for matte in state.mattes} | set(state.layers.shutters if state.layers else ())


def _ways(state: FrameState, shutter: int, pair: int, height: int) -> tuple[Similarity, Similarity]:
    """Return how what a shutter's exposure follows moves from the shown picture to each of two neighboring frames.

    Args:
        state: The effect at the shown frame.
        shutter: Index of the shutter.
        pair: The first of the two source frames.
        height: Height in pixels of the pictures to whose pixels the effect's motions refer.

    Returns:
        The motion to the first frame and that to the second, with shifts in heights of the picture. If nothing is
        followed, both leave all points in place.
    """
    if state.following is None:
        return Similarity(), Similarity()
    turns, shifts = state.following.at([pair, pair + 1])
    first, second = (Similarity(complex(turns[i, shutter]), complex(shifts[i, shutter]) / height) for i in range(2))
    return first, second


def is_busy() -> bool:
    """Tell whether something is being measured, or about to be."""
    return _measuring.job is not None or _measuring.wanted is not None


def advance() -> bool:
    """Start the next measurement on a thread, if none is running. Return whether one has just finished."""
    if _measuring.job is not None and not _measuring.job.done():
        return False
    ended, _measuring.job = _measuring.job is not None, None
    if _measuring.wanted is not None:
        _measuring.job, _measuring.wanted = threads.start(_measure_motion, *_measuring.wanted), None
    return ended


def note_streaks(
    effect: PropertyGroup, snapshot: Snapshot, renderer: Renderer, request: Request, say: Callable[[str], None]
) -> None:
    """Add a note to a preview if the exposure has too few frames. Unknown motion is measured once the playhead rests.

    Called while a preview is drawn. When a measurement has finished, previews are drawn again; if it changed what
    `look` returns, so are panels.

    Args:
        say: A function that adds a note to the preview.
    """
    known, is_new = look(effect, snapshot, renderer, request)
    if known is not None:
        say(too_few_frames(known))
    if is_new:
        main_thread.later(preview_areas.redraw_panels)  # panels may have been drawn before
    if is_busy():
        main_thread.drop(_measure)
        main_thread.later(_measure, _STILL)  # when the frame stays


def _measure() -> float | None:
    """Start measurements, and redraw previews when one has finished. This is a timer of Blender."""
    if advance():
        preview_areas.redraw()
    return _TICK if is_busy() else None


def too_few_frames(step: float) -> str:
    """Return a note for the user that an exposure shows copies instead of a streak.

    Args:
        step: Pixels that the picture moves from one exposed frame to the next.
    """
    return rpt_("Too few frames: steps of {pixels} pixels").format(pixels=f"{step:.0f}")


def forget() -> None:
    """Forget all measurements, when a file is loaded or the extension is disabled."""
    if _measuring.job is not None:
        wait([_measuring.job])
    _measuring.job = _measuring.wanted = None
    _measuring.moved.clear()
    _measuring.looks.clear()


def _measure_motion(spec: SourceSpec, pair: int) -> None:
    _measuring.moved.keep((spec.key, pair), None, _KEPT)  # an unreadable pair is not tried again
    if opencv.cv2 is not None:
        with suppress(MediaError, OSError), spec.open() as medium:
            _measuring.moved.keep((spec.key, pair), smooth.moved(medium, pair), _KEPT)


def _why_smooth(effect: PropertyGroup) -> str | None:
    return None if effect.inbetween == "1" else rpt_("The exposures are already smooth")


@operator("Smooth Streaks", _why_smooth)
def smooth_streaks(_self: Operator, _context: Context, effect: PropertyGroup) -> None:
    """Expose as many moments between filmed frames as the footage needs"""
    effect.inbetween = "AUTO"


def draw_smooth(layout: UILayout, effect: PropertyGroup) -> None:
    """Draw the settings of *Smooth* in a panel."""
    row = layout.row(align=True)
    row.prop(effect, "inbetween")
    if effect.inbetween != "1":
        row.prop(effect, "skip_repeats", text="", icon="FRAME_NEXT")
        if repeats(effect):
            sentence(layout, iface_("The source repeats frames: motion continues across them"), "INFO")


def notes(effect: PropertyGroup) -> Iterator[tuple[str, str]]:
    """Yield notes about an effect for the panel, each with the bl_idname of the operator that helps."""
    if (step := last(effect)) is not None:
        yield too_few_frames(step), "shutter.smooth_streaks"
