"""Decide what previews show of an effect: in which detail, and whether our draw handler draws it or Blender shows it.

This is decided once for each redraw: for the engine, if Blender asks it for the picture, and then for the draw handler.
Blender asks the engine for a Scene strip's full size whatever the preview's size, takes floats, converts, blends and
uploads them. What our handler draws stays on the GPU, and is as small as it is shown.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from bpy.types import Context, Scene

from ... import features
from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core.frames.frame_source import FrameSource
from ...core.stopping import Slice, Slices, never
from ...media.reduced import DIVISORS
from ..data import annotations, preview_areas, selection, strips
from ..data.preview_areas import Look, PreviewedStrip
from ..data.snapshot import Snapshot
from . import effect_source, invalidation, render_job, sessions

# Operators that read the sequencer's pictures from the window.
_READERS = {"RENDER_OT_opengl", "SEQUENCER_OT_sample"}
# Operators that show one picture after another: drafts, so that keys need not wait.
_TRACKING = {"SHUTTER_OT_track", "SHUTTER_OT_track_camera", "SHUTTER_OT_panning_shot", "SHUTTER_OT_tripod"}
_GOING = {"ANIM_OT_change_frame"} | _TRACKING
_PEN = "GPENCIL_OT_annotate"
_MOMENT = 0.3  # seconds that pictures may be late after such an operator
_SLICE = 0.15  # seconds
_PLAYED = 1.0  # seconds of the only slice of a frame during playback
_READING_TOOL = "builtin.sample"  # it reads once before its operator runs
DRAFT_ROWS = 270  # blocks along the shorter side of a draft in which shutters follow edges
RESULTS = "RESULT", "SPLIT", "EDGES"  # views of the live preview that show the result


@dataclass
class Whole:
    """Which picture the user looks at with *Full Quality*.

    Attributes:
        scene: session_uid of the effect scene.
        frame: Timeline frame.
        key: Request.key, without the source, of the picture without moments (frames computed between filmed ones). If
            it differs later, the effect has changed. None: not known yet.
    """

    scene: int
    frame: int
    key: tuple | None = None


@dataclass(frozen=True)
class Decision:
    """What a preview shows of an effect in one redraw.

    Attributes:
        snapshot: The effect.
        frame: Timeline frame.
        request: The picture to show.
        is_drawn: Whether the draw handler draws it: then the engine makes none.
        is_plain: Whether the picture lacks frames computed between filmed ones, and one with these follows.
        is_late: Whether the engine was stopped before the picture was done, to let Blender handle events.
        stopped: Returns True once making the picture has to pause for Blender; None: it may take as long as it needs.
    """

    snapshot: Snapshot
    frame: float
    request: Request
    is_drawn: bool = False
    is_plain: bool = False
    is_late: bool = False
    stopped: Callable[[], bool] | None = None


@dataclass(frozen=True)
class PreviewDrawing:
    """What the extension's draw handler draws over a preview.

    Attributes:
        decision: What the preview shows.
        request: The picture to draw, possibly as a draft (previews.draft).
        renderer: Makes the picture.
        left: Width of the part at the left that shows the source, as a fraction of the picture's width.
        draws_result: Whether the handler draws the result. False: Blender shows it, or it is not shown.
    """

    decision: Decision
    request: Request
    renderer: Renderer
    left: float
    draws_result: bool


@dataclass
class _Pen:
    """What drawing strokes has changed in the previews, to restore it later.

    Attributes:
        channel: *Display Channel* that was set to show the source strip; 0: none was set.
        tool: Tool that *Draw* or *Erase* replaced, to restore after the stroke; "": none.
        is_down: Whether the pen was down when a preview was last drawn.
    """

    channel: int = 0
    tool: str = ""
    is_down: bool = False


@dataclass
class _Looking:
    """The state of all previews.

    Attributes:
        whole: The picture that the user looks at with *Full Quality*; None: that is off.
        late_until: Time (time.monotonic) until which pictures may be late, because the user scrubs or tracks.
        decision: What for_engine has decided in this redraw, for take_decision; None: Blender has not asked the engine,
            or not for the effect and frame that the preview shows, or an operator or tool reads the picture.
        slices: The limits of time in which a slow picture is made piece by piece, between redraws.
        pen: What drawing strokes has changed.
        emptied: Addresses (as_pointer) of sequencer spaces from which an effect's annotation was taken, so that they
            get one again.
    """

    whole: Whole | None = None
    late_until: float = 0.0
    decision: Decision | None = None
    slices: Slices = field(default_factory=Slices)
    pen: _Pen = field(default_factory=_Pen)
    emptied: set[int] = field(default_factory=set)


looking = _Looking()


def for_engine(context: Context, effect_scene: Scene) -> Decision | None:
    """Return what the engine has to make while Blender draws a preview.

    It is kept for take_decision only if the preview shows this effect at the frame that is made.

    Returns:
        The decision. None: the picture is not for a preview, or an operator or tool reads it. It then has full quality.

    Raises:
        effect_source.FAULTS: The effect cannot be shown.
    """
    region, looking.decision = context.region, None
    if region is None or region.type != "PREVIEW" or is_read(context):
        return None
    scene, seen = selection.scene_of(context), preview_areas.shown(context)
    owner, effect, strip = strips.find_effect(effect_scene, effect_scene.frame_current)
    frame = strips.timeline_frame(strip, effect_scene.frame_current)
    if seen is not None and (seen.effect != effect or scene.frame_current != frame):
        seen = None
    look = preview_areas.look(context, scene, effect, seen.strip if seen else strip) if owner == scene else None
    snapshot = invalidation.current(owner, effect, strip, frame)
    if seen and look:
        decision = looking.decision = _decide(context, seen, look, snapshot)
        is_told = context.window_manager.virtual_shutter.live and not decision.is_drawn
        return replace(decision, stopped=_time_up(context, decision.request) if is_told else None)
    detail = effect_source.FULL if look is None or looking.whole is not None else _detail(context, look)
    request, _is_plain = _best(context, snapshot, frame, detail)
    return Decision(snapshot, frame, request)


def take_decision() -> Decision | None:
    """Return what for_engine decided for this redraw, and forget it; None: nothing was kept."""
    decision, looking.decision = looking.decision, None
    return decision


def for_drawing(context: Context, shown: PreviewedStrip, decision: Decision | None) -> PreviewDrawing:
    """Return what the extension's draw handler draws over a preview.

    Args:
        shown: The effect strip that the preview shows.
        decision: What for_engine decided in this redraw. None, or if the effect has changed since: decide anew.

    Raises:
        effect_source.FAULTS: The effect cannot be shown.
    """
    settings, snapshot = context.window_manager.virtual_shutter, _snapshot(shown)
    if decision is None or decision.snapshot is not snapshot:
        decision = _decide(context, shown, _look(context, shown), snapshot)
    request = _drafted(context, shown, decision.request)
    has_result = settings.view in RESULTS
    left = settings.split if settings.view == "SPLIT" else 0.0 if has_result else 1.0
    # In the sharp source, the user sees whether a stroke stays on its subject.
    if _TRACKING & render_job.operators_running():
        left = 1.0
    # Otherwise Blender shows the engine's picture among the other strips.
    draws_result = has_result and left < 1 and (decision.is_drawn or not _is_rendered(shown))
    renderer = sessions.of_drawing().renderer(request)
    decision = replace(decision, stopped=never if is_read(context) else _time_up(context, decision.request))
    return PreviewDrawing(decision=decision, request=request, renderer=renderer, left=left, draws_result=draws_result)


def request_of(context: Context, shown: PreviewedStrip) -> Request:
    """Return what to compose for the picture that our draw handler draws of an effect strip at the current frame.

    Raises:
        effect_source.FAULTS: The effect cannot be shown.
    """
    return _drafted(context, shown, _decide(context, shown, _look(context, shown), _snapshot(shown)).request)


def _look(context: Context, shown: PreviewedStrip) -> Look:
    return preview_areas.look(context, shown.scene, shown.effect, shown.strip)


def _decide(context: Context, shown: PreviewedStrip, look: Look, snapshot: Snapshot) -> Decision:
    request, is_plain = _requested(context, shown, snapshot, look)
    source = sessions.of_drawing().renderer(request).source
    is_drawn = _is_drawn(context, shown, look, source, is_less=is_plain or is_going(context))
    return Decision(snapshot, shown.scene.frame_current, request, is_drawn, is_plain)


def _snapshot(shown: PreviewedStrip) -> Snapshot:
    return invalidation.current(shown.scene, shown.effect, shown.strip, shown.scene.frame_current)


def _requested(context: Context, shown: PreviewedStrip, snapshot: Snapshot, look: Look) -> tuple[Request, bool]:
    """Return _best's request for the shown frame, in full detail while *Full Quality* is on, else in that of previews.

    *Full Quality* ends here if another effect or frame is shown, the effect has changed, the film plays, or the user
    scrubs or tracks.

    Returns:
        The request, and whether a better picture follows (_best).
    """
    frame = shown.scene.frame_current
    whole = looking.whole
    if whole and (whole.scene, whole.frame) == (snapshot.scene, frame) and not is_going(context):
        plain = sessions.of_drawing().request(snapshot, frame, replace(effect_source.FULL, smooth=False))
        if whole.key in (None, plain.key[1:]):
            whole.key = plain.key[1:]
            return _best(context, snapshot, frame, effect_source.FULL)
    looking.whole = None
    return _best(context, snapshot, frame, _detail(context, look))


def _best(context: Context, snapshot: Snapshot, frame: float, detail: effect_source.Detail) -> tuple[Request, bool]:
    """Return the request for the best picture that a preview can show now.

    Returns:
        The request, and whether it is a stand-in: a picture without frames computed between filmed ones, shown until
        the one with them is ready. An operator or tool that reads the picture never gets a stand-in.
    """
    render = sessions.of_drawing()
    if not is_read(context) and detail.smooth:
        for smooth_request in features.each("smooth_request"):
            return smooth_request(render, snapshot, frame, detail)
    features.call("rest_smooth")
    return render.request(snapshot, frame, detail), False


def _detail(context: Context, look: Look) -> effect_source.Detail:
    """Return the detail that all previews of a scene share.

    The divisor is the one of reduced.DIVISORS that makes the picture about as large as the largest preview. While
    playing, scrubbing or tracking, and in views other than RESULTS, no frames are computed between filmed ones, because
    optical flow takes long.

    Args:
        look: How previews show the effect. If its scale is None (no preview shows it), the detail is that of renders.
    """
    if (scale := look.scale) is None:
        return effect_source.FULL
    divisor = min(DIVISORS, key=lambda number: abs(math.log2(max(scale, 1e-3) * number)))
    is_smooth = not is_going(context) and context.window_manager.virtual_shutter.view in RESULTS
    return effect_source.Detail(divisor, look.proxy, smooth=is_smooth)


def _is_drawn(context: Context, shown: PreviewedStrip, look: Look, source: FrameSource, *, is_less: bool) -> bool:
    """Tell whether our draw handler shows the picture instead of Blender, which is allowed where both look the same.

    A still result of full size is left to Blender, because what the handler draws has only 8 bits.

    Args:
        source: The opened footage, in the previews' size.
        is_less: Whether the picture is plain, or drawn while the film plays or the user scrubs or tracks: a better
            one follows.
    """
    settings = context.window_manager.virtual_shutter
    is_small = source.from_proxy or source.width < annotations.picture_size(shown.effect)[0]
    is_wanted = settings.live and (is_small or is_less or settings.view not in RESULTS)
    return is_wanted and not shown.strips_above and source.alpha == "opaque" and look.is_plain and not pen_is_down()


def _drafted(context: Context, shown: PreviewedStrip, request: Request) -> Request:
    is_result = context.window_manager.virtual_shutter.view in RESULTS and _is_rendered(shown)
    if looking.whole is not None or (is_result and not is_going(context)):
        return request
    return draft(request, sessions.of_drawing().renderer(request).source)


def draft(request: Request, source: FrameSource) -> Request:
    """Return a request for a faster draft: if shutters follow edges, they do so in coarser blocks of pixels.

    There are at most DRAFT_ROWS blocks along the picture's shorter side.
    """
    options = request.state.options
    if not options.edge_aware:
        return request
    block = options.aggregate
    while min(source.width, source.height) > block * DRAFT_ROWS:
        block *= 2
    return replace(request, state=request.state.in_blocks(block))


def _is_rendered(shown: PreviewedStrip) -> bool:
    """Tell whether the sequencer's previews show Scene strips rendered, by our engine."""
    return shown.scene.render.sequencer_gl_preview == "RENDERED"


def _time_up(context: Context, request: Request) -> Slice:
    """Return a function that returns True once making the picture has to pause, so that Blender can handle events.

    The picture goes on in the next redraw. While the film plays, each frame gets one second.
    """
    key = request.key
    if _is_playing(context):
        looking.slices.end()
        return looking.slices.next(key, _PLAYED, _PLAYED)
    return looking.slices.next(key, _SLICE / 2, _SLICE)  # the playhead and a note move after the first slice


def refine() -> None:
    """Work for about 0.15 s on each picture with frames computed between filmed ones, which will replace a plain one.

    While the pen is down, drop what is done so far; while a slow picture is being made, do nothing.

    Raises:
        effect_source.FAULTS: A picture cannot be made.
    """
    if pen_is_down():
        features.call("rest_smooth")
    elif looking.slices.last is None:
        features.call("advance_smooth", _SLICE)


def show_carried() -> None:
    """Have previews show new mattes of tracked outlines and subjects ("carried" from frame to frame).

    Close the renderers of previews, which hold older mattes, and draw previews again.
    """
    sessions.SESSIONS.window.keep(set())
    strips.invalidate_all()
    preview_areas.redraw()


def is_going(context: Context) -> bool:
    """Tell whether the film plays, or pictures may be late (may_be_late)."""
    return _is_playing(context) or may_be_late()


def _is_playing(context: Context) -> bool:
    return any(window.screen.is_animation_playing for window in context.window_manager.windows)


def pen_is_down() -> bool:
    """Tell whether the user is drawing or erasing a stroke right now."""
    return _PEN in render_job.operators_running()


def may_be_late() -> bool:
    """Tell whether the user scrubs or tracks, or did a moment ago, so that input comes before pictures."""
    if _GOING & render_job.operators_running():
        looking.late_until = time.monotonic() + _MOMENT
    return time.monotonic() < looking.late_until


def is_read(context: Context) -> bool:
    """Tell whether an operator or tool reads the sequencer's picture, and so needs it in full quality."""
    tool = context.workspace and context.workspace.tools.from_space_sequencer("PREVIEW", create=False)
    return bool(_READERS & render_job.operators_running()) or (tool is not None and tool.idname == _READING_TOOL)
