"""The live preview: pictures, views, strokes and notes that a draw handler draws over the sequencer's picture."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache

import bpy
import gpu
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import PointerProperty
from bpy.types import Context, PropertyGroup, Region

from ... import features
from ...compute.devices.device import Texture
from ...compute.renderer import Renderer
from ...compute.request import Request
from ...core import stopping
from ...core.model.choices import CONTEXT
from ...core.model.effect import SubjectRegion
from ...core.model.fields import Labelled
from ...core.model.frame_state import FrameState
from ..data import annotations, preview_areas, selection
from ..data.preview_areas import PreviewedStrip
from ..data.properties import with_fields
from ..data.snapshot import Snapshot
from ..devices import blender_gpu, main_thread
from ..editing import shown_annotations
from ..rendering import effect_source, invalidation, pictures, previews, render_job
from ..rendering.previews import Decision, PreviewDrawing
from . import drawing, sharp_frame
from .drawing import Quad

VIEWS = (
    ("RESULT", "Result", "The finished picture"),
    ("SPLIT", "Split", "The source on the left of the handle, the result on its right"),
    ("EDGES", "Edges", "The result with a line around the area of each shutter"),
    ("SCRIBBLES", "Scribbles", "The source with the strokes of each shutter"),
    ("COEFFICIENTS", "Mattes", "Each pixel's share of each shutter, in the shutters' colors and patterns"),
)


def _view_chosen(_settings: PropertyGroup, context: Context) -> None:
    sharp_frame.give_back(context)
    preview_areas.redraw()


def _redraw_when_still() -> float | None:
    """Redraw previews once playing, scrubbing or tracking has ended, since Blender does not. A timer of Blender."""
    if previews.is_going(bpy.context):
        return _SOON
    preview_areas.redraw()
    return None


_CHOSEN, _REDRAWN = {"update": _view_chosen}, {"update": preview_areas.redraw}
Colors = Sequence[Sequence[float]]  # display values
Say = Callable[[str], None]  # adds a note
_NAVIGATION = 56  # interface units: Blender's navigation buttons at the right of a preview
_SOON = 0.1  # seconds


@dataclass
class _Settings:
    live: bool = Labelled("Live", "Show strokes and views of the effect in the preview").switch(default=True)
    view: str = Labelled("View", "What the live preview shows").choice(VIEWS, default="result", context=CONTEXT)
    split: float = Labelled(
        "Split Position", "Border between source and result, as a fraction of the picture's width"
    ).fixed(default=0.5, subtype="FACTOR")
    probe: bool = Labelled("Probe", "Show bars of the pixel under the pointer, and its share of each shutter").switch()
    probe_at: tuple[float, float] = Labelled(
        "Probe Position", "Position of the probe, as fractions of the picture from its lower left corner"
    ).fixed(default=(-1.0, -1.0), least=-1e3, most=1e3)


@with_fields(_Settings, live=_CHOSEN, view=_CHOSEN, split=_REDRAWN, probe=_REDRAWN, probe_at=_REDRAWN)
class ShutterPreview(PropertyGroup):
    """Settings of the live preview. They are in the window manager, so they are neither saved nor undone."""


def _draw() -> None:
    """Draw the effect's picture, strokes and notes over the sequencer's own picture in a preview.

    This is a draw handler, which Blender calls when it has drawn its own picture. As Blender does not report new
    strokes, also look for them here, and have changed effects drawn again. Gizmos draw themselves.
    """
    context = bpy.context
    blender_gpu.free_unused()
    decision = previews.take_decision()
    if bpy.app.is_job_running("RENDER") or render_job.ends_films():
        return
    invalidation.drop_reduced()
    # Blender does not report strokes, but it redraws the preview after them.
    scene = selection.scene_of(context)
    if scene is not None and scene.library is None and invalidation.invalidate_changed(scene):
        main_thread.later(preview_areas.redraw)  # a redraw tag that is set during drawing is lost
    sharp_frame.follow_pen()
    space = context.space_data
    if shown_annotations.is_laid_wrong(space) or shown_annotations.is_other(space, selection.seen(scene)):
        main_thread.later(shown_annotations.follow)  # drawing code must not change data
    if sharp_frame.is_shown(space):
        _show_sharp(context, preview_areas.shown(context, space.display_channel))
    # Our picture would cover the stroke under the pen; Blender's own picture shows the same.
    if previews.pen_is_down():
        previews.looking.slices.end()
        previews.refine()
        return
    notes: list[str] = []
    say = notes.append
    if not context.window_manager.virtual_shutter.live:
        with suppress(*effect_source.FAULTS):  # no notes
            previews.refine()
        return
    with drawing.pixel_space(context.region):
        if (shown := preview_areas.shown(context)) is not None:
            _show(context, shown, decision, say)
        else:
            previews.looking.whole = None
            previews.looking.slices.end()
            active = selection.active(context)
            if active is not None and context.space_data.show_overlays and not selection.seen(active[0]):
                say(selection.why_unseen(active[0], active[2]))
        try:
            previews.refine()
        except effect_source.FAULTS as error:
            say(rpt_("Shutter: {fault}").format(fault=error))
        draw_notes(context.region, notes)


def _show(context: Context, shown: PreviewedStrip, decision: Decision | None, say: Say) -> None:
    """Draw what the live preview shows of an effect: the picture or view, strokes and notes.

    If making the picture takes long, draw the strokes and the note "Composing…", and go on in the next redraw. An error
    of the effect becomes a note.

    Args:
        context: The context of the preview.
        shown: The effect strip that the preview shows.
        decision: What previews.for_engine has decided for this effect in this redraw; None: decide here.
        say: Adds a note.
    """
    try:
        quad = Quad(context.region, shown)
        wanted = previews.for_drawing(context, shown, decision)
        if previews.is_going(context):
            main_thread.later(_redraw_when_still, _SOON)
        try:
            if wanted.decision.is_late:
                raise stopping.StoppedError
            with stopping.once(wanted.decision.stopped or stopping.never):
                _show_picture(context, quad, shown, wanted, say)
            if wanted.decision.is_plain:
                say(rpt_("Composing…"))
        except stopping.StoppedError:
            say(rpt_("Composing…"))
            _show_strokes(context, quad, shown, wanted.decision.snapshot)
            main_thread.later(preview_areas.redraw)
    except effect_source.FAULTS as error:
        previews.looking.slices.end()
        say(rpt_("Shutter: {fault}").format(fault=error))


def _show_picture(context: Context, quad: Quad, shown: PreviewedStrip, wanted: PreviewDrawing, say: Say) -> None:
    settings, renderer, request = context.window_manager.virtual_shutter, wanted.renderer, wanted.request
    is_still = not context.screen.is_animation_playing
    if context.space_data.show_overlays:
        _tell_detail(wanted, annotations.picture_size(shown.effect), say)
    if wanted.left > 0 or wanted.draws_result:  # a picture drawn over the sequencer's cannot show all
        if shown.strips_above:
            say(rpt_("The strips above are hidden in this view"))
        if shown.scene.view_settings.view_transform != "Standard":
            say(rpt_("This view uses the view transform Standard"))
    if wanted.left > 0:
        _show_source(quad, shown, renderer, request, wanted.left)
    if wanted.draws_result:
        texture = renderer.draw(replace(request, quick=previews.is_going(context), levels=True))
        quad.draw("PICTURE", {"picture": texture.gpu}, wanted.left, 1.0, opacity=shown.strip.blend_alpha)
    colors = [shutter.color for shutter in shown.effect.shutters]
    if settings.view == "SCRIBBLES":
        _show_shares(quad, "SCRIBBLES", colors, renderer.drawn_labels(request), renderer, 0.7)
    elif settings.view in ("COEFFICIENTS", "EDGES"):
        opacity, unit = 1.0 if settings.view == "EDGES" else 0.75, float(drawing.ui_scale())
        drawn, count = renderer.drawn_with_layers(replace(request, quick=True)), len(request.state.bars)
        _show_shares(quad, settings.view, colors, drawn, renderer, opacity, count=count, unit=unit)
    if settings.view not in ("SCRIBBLES", "COEFFICIENTS"):
        _show_strokes(context, quad, shown, wanted.decision.snapshot)
    previews.looking.slices.end()
    features.call("note_tracking", say)
    for sentence in pictures.shortages(renderer, wanted.decision.snapshot, request):
        say(sentence)
    # Measuring would slow down what is running.
    decision = wanted.decision
    if context.space_data.show_overlays and is_still and not decision.is_plain and not previews.may_be_late():
        features.call("note_streaks", shown.effect, decision.snapshot, renderer, decision.request, say)


def _tell_detail(wanted: PreviewDrawing, size: tuple[int, int], say: Say) -> None:
    """Add a note about how a preview is worse than a render: smaller, from a proxy, or with draft edges.

    With *Full Quality*, the note says that the picture is as it will be rendered.

    Args:
        wanted: What is drawn.
        size: Width and height of the rendered picture.
        say: Adds the note.
    """
    source = wanted.renderer.source
    if previews.looking.whole is not None:
        say(rpt_("Full quality: as it will be rendered"))
        return
    less = []
    if source.width < size[0]:
        less.append(rpt_("{scale} of the size").format(scale=f"1/{round(size[0] / source.width)}"))
    if source.from_proxy:
        less.append(rpt_("from a proxy"))
    if wanted.request is not wanted.decision.request:
        less.append(rpt_("draft edges"))
    if less:
        say(rpt_("Preview: {what}").format(what=", ".join(less)))


def _show_sharp(context: Context, shown: PreviewedStrip | None) -> None:
    """Draw a note and the strokes over the source frame that is shown for drawing (sharp_frame)."""
    with drawing.pixel_space(context.region), suppress(*effect_source.FAULTS):
        draw_notes(context.region, [rpt_("Sharp frame to draw on: the result appears after the stroke")])
        if shown is not None and not previews.pen_is_down():
            quad = Quad(context.region, shown)
            snapshot = invalidation.current(shown.scene, shown.effect, shown.strip, shown.scene.frame_current)
            _show_strokes(context, quad, shown, snapshot)


def _show_strokes(context: Context, quad: Quad, shown: PreviewedStrip, snapshot: Snapshot) -> None:
    """Draw the strokes and outlines at the current frame (Effect.drawn_at), unless the preview hides overlays.

    Regions whose annotation layer is hidden are left out, except for a subject's *Not This* strokes.
    """
    if not context.space_data.show_overlays:
        return
    frame = shown.scene.frame_current
    for is_hidden, shape in zip(shown.hides_strokes, snapshot.effect.drawn_at(frame), strict=True):
        if is_hidden:
            continue
        color = (*shown.effect.shutters[shape.shutter].color, shape.opacity)
        for points in shape.strokes:
            drawing.lines(quad.view.on_region(points), color, closed=shape.kind == "lasso", width=2)
    for region in snapshot.effect.regions:
        nots = region.nots if isinstance(region, SubjectRegion) else None
        for points in nots.at(frame) if nots is not None and frame in nots.frames else ():
            drawing.lines(quad.view.on_region(points), (*annotations.NOT_THIS, 1.0), width=2)


def _show_source(quad: Quad, shown: PreviewedStrip, renderer: Renderer, request: Request, right: float) -> None:
    """Draw the frame of the footage shown now, without the effect, for views that show the source.

    Args:
        right: Where the drawing ends, as a fraction of the picture's width from its left edge; 1: it covers all.
    """
    options = replace(request.state.options, step=1)  # reversed moments would come first
    still = np.zeros((1, options.window))
    still[0, options.before] = 1
    # The shown frame does not move, whatever follows a motion. Without one, other frames would have to be read.
    following = request.state.following
    moving = following and following.of([following.moving()[0]])
    plain = replace(request, state=FrameState(options=options, bars=still, following=moving), levels=True)
    quad.draw("PICTURE", {"picture": renderer.draw(plain).gpu}, 0.0, right, opacity=shown.strip.blend_alpha)


def _show_shares(
    quad: Quad, step: str, colors: Colors, drawn: tuple[Texture, int], renderer: Renderer, opacity: float, **more
) -> None:
    """Draw one of the views *Scribbles*, *Mattes* or *Edges* in the shutters' colors.

    Args:
        step: The view, and the pass of shaders/show.glsl that draws it. "SCRIBBLES": which shutter's strokes cover a
            pixel. "COEFFICIENTS" (*Mattes*): the pixel's share of each shutter. "EDGES": lines around areas where a
            shutter other than the first has more than half.
        colors: The color of each shutter.
        drawn: A texture, and the side in pixels of the blocks that share one of its texels. For "SCRIBBLES" it has the
            shutter whose stroke covers a pixel, else the shares.
        renderer: The renderer of the picture, which tells the picture's size.
        opacity: 0 to 1.
        more: Further uniforms of the pass.
    """
    (texture, block), source = drawn, renderer.source
    rgba, size = np.ones((len(colors), 4), dtype=np.float32), (len(colors), 1)
    rgba[:, :3] = colors
    data = gpu.types.Buffer("FLOAT", rgba.size, rgba.reshape(-1))
    palette = gpu.types.GPUTexture(size, layers=1, format="RGBA32F", data=data)
    textures = {"labels" if step == "SCRIBBLES" else "coefficients": texture.gpu, "palette": palette}
    quad.draw(step, textures, opacity=opacity, block=block, size=(source.width, source.height), **more)


def draw_notes(region: Region, notes: list[str]) -> None:
    """Draw sentences at the upper left of a preview's region, each broken into lines."""
    unit = drawing.ui_scale()
    left, right = 16 * unit, region.width - _NAVIGATION * unit
    lines = [line for note in notes for line in drawing.wrapped(note, right - left, drawing.SIZE)]
    pad = 4 * unit
    for i, line in enumerate(lines):
        y = region.height - (36 + 18 * i) * unit
        box = left - pad, y - pad - 1, left + drawing.text_width(line) + pad, y + drawing.SIZE * unit + pad
        drawing.rectangles([box], [drawing.BACK])
        drawing.text(left, y, line)


classes = (ShutterPreview,)


@cache
def _handler() -> object:
    # After the sequencer's picture, before annotations and gizmos.
    return bpy.types.SpaceSequenceEditor.draw_handler_add(_draw, (), "PREVIEW", "POST_VIEW")


def register() -> None:
    bpy.types.WindowManager.virtual_shutter = PointerProperty(type=ShutterPreview)
    _handler()


def unregister() -> None:
    bpy.types.SpaceSequenceEditor.draw_handler_remove(_handler(), "PREVIEW")
    _handler.cache_clear()
    drawing.free()
    del bpy.types.WindowManager.virtual_shutter
