"""What previews show of an effect: in which detail, and whether our draw handler shows it or Blender.

Blender asks the engine for a Scene strip's full size whatever a preview's, takes its floats, converts, blends and sends
them. Drawn by our handler, the picture stays on the GPU, and is as small as it is shown.
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from ...compute.request import Request
from ...media.reduced import DIVISORS
from ..data import annotations, geometry, preview_areas, selection, strip_proxies, strips
from ..data.snapshot import Snapshot
from . import effect_source, render_context, render_job
from .render_context import RenderContext

# Operators that read the sequencer's pictures, from the window.
_READERS = {"RENDER_OT_opengl", "SEQUENCER_OT_sample"}
# Operators by which one picture comes after another, as where it plays: drafts, so that a key need not wait.
_TRACKING = {"SHUTTER_OT_track", "SHUTTER_OT_track_camera", "SHUTTER_OT_panning_shot", "SHUTTER_OT_tripod"}
_BUILDING = {"SHUTTER_OT_inbetween_build", "SHUTTER_OT_smooth_streaks"}
_GOING = {"ANIM_OT_change_frame"} | _TRACKING | _BUILDING
PEN = "GPENCIL_OT_annotate"
_MOMENT = 0.3  # seconds
_READING_TOOL = "builtin.sample"  # reads once before it is one of those that run
_PERCENT = {"PROXY_25": 25, "PROXY_50": 50, "PROXY_75": 75, "PROXY_100": 100}
_STANDARD = {"view_transform": "Standard", "look": "None", "exposure": 0.0, "gamma": 1.0}
_STANDARD |= {"use_curve_mapping": False, "use_white_balance": False}
_PLAIN_STRIP = {"blend_alpha": 1.0, "color_multiply": 1.0, "color_saturation": 1.0, "scene_input": "CAMERA"}
DRAFT_ROWS = 270  # blocks along the shorter side of a draft in which shutters follow edges
RESULTS = "RESULT", "SPLIT"  # views of the live preview that show the result
_PLAIN_SPACE = {"display_mode": "IMAGE", "display_channel": 0, "show_overexposed": 0}


@dataclass(frozen=True)
class Shown:
    """The effect strip that a preview shows."""

    edit: object
    effect: object
    strip: object
    strips_above: bool


@dataclass
class Whole:
    """The picture that is looked at as it will be rendered, by the effect's scene and the timeline frame.

    key: of its request (Request.key), its source excepted; None: it was not drawn yet"""

    scene: int
    frame: int
    key: tuple | None = None


@dataclass(frozen=True)
class Decision:
    """What a preview shows of an effect as it is drawn once.

    snapshot: of the effect; request: its picture in the previews' detail
    is_drawn: whether our draw handler shows the result"""

    snapshot: Snapshot
    request: Request
    is_drawn: bool


@dataclass
class _Looking:
    """How previews are looked at.

    whole: the picture that is looked at as it will be rendered; late_until: the time until which pictures may be late
    decision: the engine's, for the draw handler, which Blender calls after it
    """

    whole: Whole | None = None
    late_until: float = 0.0
    decision: Decision | None = None


looking = _Looking()


def requested(context, render: RenderContext, found: Shown, snapshot: Snapshot) -> Request:
    """What an effect strip shows at the current frame, in the previews' detail: in full, while it is looked at so. That
    ends here with the frame and with a change of the effect. One of effect_source.FAULTS: it cannot be shown."""
    frame = found.edit.frame_current
    if (
        (whole := looking.whole) is not None
        and (whole.scene, whole.frame) == (snapshot.scene, frame)
        and not is_going(context)
    ):
        request = render.request(snapshot, frame, effect_source.FULL)
        if whole.key in (None, request.key[1:]):
            whole.key = request.key[1:]
            return request
    looking.whole = None
    return render.request(snapshot, frame, detail(context, found.edit, found.effect, found.strip))


def draft(request: Request, source) -> Request:
    """The request as it is drawn while an editor waits: where shutters follow edges, of blocks so large that the
    picture has no more than DRAFT_ROWS of them along its shorter side."""
    options = request.state.options
    if not options.edge_aware:
        return request
    block = options.aggregate
    while min(source.width, source.height) > block * DRAFT_ROWS:
        block *= 2
    return replace(request, state=replace(request.state, options=replace(options, aggregate=block)))


def shown(context) -> Shown | None:
    """The effect strip under the playhead that the preview shows, as selection.seen has it."""
    edit, space = selection.edit_of(context), context.space_data
    if space.display_mode != "IMAGE" or space.display_channel or (found := selection.seen(edit)) is None:
        return None
    above = any(other.channel > found[2].channel for other in selection.visible(edit))
    return Shown(*found, above)


def detail(context, edit, effect, strip) -> effect_source.Detail:
    """What an effect's picture is composed in for the previews of its edit: smaller by the power of two, of
    reduced.DIVISORS, that is nearest to the largest of them, and from the proxy that Blender reads for that one."""
    spaces = {area.spaces.active: _scale(context, edit, strip, area) for area in _areas_of(context, edit)}
    spaces = {space: scale for space, scale in spaces.items() if math.isfinite(scale)}
    if not spaces:
        return effect_source.FULL
    space = max(spaces, key=spaces.get)
    divisor = min(DIVISORS, key=lambda number: abs(math.log2(max(spaces[space], 1e-3) * number)))
    return effect_source.Detail(divisor, _proxy(edit, effect, strip, space))


def _proxy(edit, effect, strip, space) -> strip_proxies.Proxy | None:
    """What Blender reads of an effect's source in a preview; None: the footage itself."""
    source, percent = strips.nearest_source(edit, effect, strip), _PERCENT.get(space.proxy_render_size)
    if source is None or percent is None or not space.use_proxies:
        return None
    return strip_proxies.proxy_of(edit, source, percent)


def _scale(context, edit, strip, area) -> float:
    """How wide or high a pixel of the source is in a preview: in its picture, which is as small as Blender's menu has
    it; and on the screen, where our handler draws."""
    space = area.spaces.active
    percent = _PERCENT.get(space.proxy_render_size, edit.render.resolution_percentage)
    size = strip.scene.render.resolution_x, strip.scene.render.resolution_y
    scale = percent / 100 * _pixel(geometry.picture_to_image(strip, size), size)
    if not context.window_manager.virtual_shutter.live:
        return percent / 100
    region = preview_areas.preview_region(area)
    if space.display_mode != "IMAGE" or min(region.width, region.height) < 2:
        return scale
    return min(scale, _pixel(geometry.picture_to_region(strip, size, region), size))


def _pixel(matrix, size) -> float:
    """The larger side of a picture's pixel after a matrix (3, 3) from fractions of the picture."""
    return float(np.max(np.hypot(*matrix[:2, :2]) / size))


def _areas_of(context, edit):
    """The areas in which an edit's preview is drawn."""
    for window, area in preview_areas.previews(context):
        shows = getattr(window.workspace, "sequencer_scene", None) or window.scene
        if shows == edit and area.spaces.active.proxy_render_size != "NONE":
            yield area


def is_drawn(context, found: Shown, source) -> bool:
    """Whether our draw handler shows the result, or in another view what covers it, in place of what Blender makes of
    the engine's picture: wherever both are the same, in all previews of the edit. Not a still picture of full size:
    what is drawn passes through 8 bits on its way to the screen, and lacks shades next to black."""
    edit, strip = found.edit, found.strip
    is_less = source.from_proxy or source.width < annotations.picture_size(found.effect)[0]
    return (
        context.window_manager.virtual_shutter.live
        and (is_less or is_going(context) or context.window_manager.virtual_shutter.view not in RESULTS)
        and not found.strips_above
        and source.alpha == "opaque"
        and strip.blend_type in ("REPLACE", "ALPHA_OVER")
        and _has(strip, _PLAIN_STRIP)
        and all(modifier.mute for modifier in strip.modifiers)
        and edit.display_settings.display_device == "sRGB"
        and _has(edit.view_settings, _STANDARD)
        and not edit.render.use_multiview
        and not edit.sequence_editor.show_overlay_frame
        and all(_has(area.spaces.active, _PLAIN_SPACE) for area in _areas_of(context, edit))
        and PEN not in render_job.operators_running()
    )


def is_going(context) -> bool:
    """Whether the film plays, or may_be_late."""
    is_playing = any(window.screen.is_animation_playing for window in context.window_manager.windows)
    return is_playing or may_be_late()


def is_tracking() -> bool:
    """Whether what is tracked is shown."""
    return bool(_TRACKING & render_job.operators_running())


def may_be_late() -> bool:
    """Whether the playhead is dragged, something is tracked or in-between frames are built, or was a moment ago: keys
    count for more than pictures."""
    if _GOING & render_job.operators_running():
        looking.late_until = time.monotonic() + _MOMENT
    return time.monotonic() < looking.late_until


def _has(item, values: dict) -> bool:
    return all(getattr(item, name) == value for name, value in values.items())


def is_read(context) -> bool:
    """Whether somebody reads the sequencer's picture from the window, for whom it has to be whole."""
    tool = context.workspace and context.workspace.tools.from_space_sequencer("PREVIEW", create=False)
    return bool(_READERS & render_job.operators_running()) or (tool is not None and tool.idname == _READING_TOOL)


def decide(context, shown: Shown, snapshot: Snapshot) -> Decision:
    """What this preview shows of the effect under the playhead. One of effect_source.FAULTS: it cannot be shown."""
    render = render_context.of_drawing()
    request = requested(context, render, shown, snapshot)
    return Decision(snapshot, request, is_drawn(context, shown, render.renderer(request).source))


def for_engine(context, snapshot: Snapshot, frame: float) -> tuple[effect_source.Detail, bool]:
    """What the engine is asked for while Blender draws a preview: the detail, and whether our draw handler shows the
    picture of it in place of Blender. One of effect_source.FAULTS: there is none."""
    region, looking.decision = context.region, None
    if region is None or region.type != "PREVIEW" or is_read(context):
        return effect_source.FULL, False
    edit, seen = selection.edit_of(context), shown(context)
    if seen is not None and seen.effect.scene.session_uid == snapshot.scene and edit.frame_current == frame:
        decision = looking.decision = decide(context, seen, snapshot)
        return decision.request.source.detail, decision.is_drawn
    strip = next((s for s in strips.effect_strips(edit) if s.scene.session_uid == snapshot.scene), None)
    effect = strip and strips.effect_of(edit, strip.scene)
    if effect is None or looking.whole is not None:
        return effect_source.FULL, False
    return detail(context, edit, effect, strip), False


def take_decision() -> Decision | None:
    """What the engine was asked for while Blender draws this preview; None: Blender had the picture already."""
    decision, looking.decision = looking.decision, None
    return decision
