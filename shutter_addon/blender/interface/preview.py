"""The live preview: what is drawn over the sequencer's picture, composed on Blender's GPU: views, and scribbles."""

from dataclasses import replace

import bpy
import gpu
import numpy as np
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, PointerProperty
from bpy.types import PropertyGroup
from gpu_extras.batch import batch_for_shader

from ...compute.passes import body
from ...core.frame_state import FrameState
from ...media import MediaError
from ..data import annotations, geometry, selection, strips
from ..data.properties import CONTEXT
from ..rendering import invalidation, session
from ..rendering.blender_gpu import Texture
from . import drawing, preview_areas, previewing, sharp_frame
from .previewing import RESULTS, Shown, shown

VIEWS = (
    ("RESULT", "Result", "The finished picture"),
    ("SPLIT", "Split", "The source on the left of the handle, the result on its right"),
    ("SCRIBBLES", "Scribbles", "The source, and where each shutter is scribbled"),
    ("COEFFICIENTS", "Mattes", "How much of each shutter a pixel gets, in the shutters' colors"),
)


def redraw(_settings, _context) -> None:
    """Draws all previews again: for what is called at changes of properties."""
    preview_areas.redraw(bpy.context)


def _view_chosen(settings, context) -> None:
    sharp_frame.give_back(context)
    redraw(settings, context)


def _redraw_once() -> None:
    redraw(None, bpy.context)


def _follow_once() -> None:
    """Previews that have the scribbles of another effect get those of the active one, and the pen draws there."""
    if (found := selection.active(bpy.context)) is None:
        return
    for _window, area in preview_areas.previews(bpy.context):
        if _is_of_another(area.spaces.active.annotation, *found[:2]):
            area.spaces.active.annotation = found[1].scene.annotation


def _is_of_another(annotation, edit, effect) -> bool:
    others = (other.scene.annotation for other in edit.virtual_shutter.effects if other.scene)
    return annotation is not None and annotation != effect.scene.annotation and annotation in others


_TIMERS = (_redraw_once, _follow_once)


class ShutterPreview(PropertyGroup):
    """How the live preview looks: of the window manager, neither saved nor undone."""

    live: BoolProperty(
        name="Live",
        description="Show scribbles and views of the effect in the preview",
        default=True,
        update=_view_chosen,
    )
    view: EnumProperty(
        name="View",
        description="What the live preview shows",
        items=VIEWS,
        update=_view_chosen,
        translation_context=CONTEXT,
    )
    split: FloatProperty(
        name="Split Position",
        description="Where the source ends and the result begins, as a fraction of the picture's width",
        subtype="FACTOR",
        default=0.5,
        min=0.0,
        max=1.0,
        update=redraw,
    )
    probe: BoolProperty(
        name="Probe",
        description="Show the shutter of the pixel that the pointer was over last, and how much of each it gets",
        update=redraw,
    )
    probe_at: FloatVectorProperty(
        name="Probe Position",
        description="The pixel that is probed, in fractions of the picture from its lower left corner",
        size=2,
        default=(-1.0, -1.0),
        update=redraw,
    )


def _draw() -> None:
    """The draw handler of the previews."""
    context = bpy.context
    settings = context.window_manager.virtual_shutter
    if bpy.app.is_job_running("RENDER"):
        return
    sharp_frame.follow_pen(context)
    invalidation.drop_lesser()
    # Blender tells nobody of strokes that are drawn or erased, but it draws the preview again.
    edit = selection.edit_of(context)
    if edit is not None and edit.library is None and invalidation.invalidate_changed(edit):
        bpy.app.timers.register(_redraw_once)  # what is tagged while it is drawn is not drawn again
    active = selection.active(context)
    if active is not None and _is_of_another(context.space_data.annotation, *active[:2]):
        bpy.app.timers.register(_follow_once)  # nothing may be changed while it is drawn
    if sharp_frame.is_shown(context.space_data):
        _tell_sharp(context.region)
    # A stroke that is being drawn would lie below our picture: Blender's own shows the same.
    if not settings.live or any(op.bl_idname == sharp_frame.PEN for op in context.window.modal_operators):
        return
    found = shown(context)
    if found is None:
        return
    say = _Notes(context.region)
    with drawing.pixel_space(context.region):
        try:
            _show(context, found, settings, say)
        except session.FAULTS as error:
            say(_fault(error))
        say.draw()


def request_of(context, found: Shown) -> session.FrameRequest:
    """What the effect strip shows at the current frame, in the previews' size, as a draft where a still result is not
    exact anyway. One of session.FAULTS: it cannot be shown."""
    frame = found.edit.frame_current
    snapshot = invalidation.current(found.edit, found.effect, found.strip, frame)
    detail = previewing.detail(context, found.edit, found.effect, found.strip)
    request = session.here().request(snapshot, frame, detail=detail)
    is_result = context.window_manager.virtual_shutter.view in RESULTS and _is_rendered(found)
    return request if is_result and not context.screen.is_animation_playing else request.draft()


def _is_rendered(found: Shown) -> bool:
    """Whether the sequencer renders its previews."""
    return found.edit.render.sequencer_gl_preview == "RENDERED"


def _show(context, found: Shown, settings, say) -> None:
    request = request_of(context, found)
    size = annotations.picture_size(found.effect)
    quad = Quad(context.region, found.strip, size)
    if context.space_data.show_overlays:
        _tell_detail(request.renderer.source, size, say)
    has_result = settings.view in RESULTS
    left = settings.split if settings.view == "SPLIT" else 0.0 if has_result else 1.0
    # Else the engine has composed it, and it lies there in its place among the other strips.
    draws_result = has_result and (not _is_rendered(found) or previewing.is_drawn(context, found, request))
    if left > 0 or draws_result:
        _warn(found, say)
    if left > 0:
        _show_source(quad, found, request, left)
    if has_result and not draws_result:
        _tell_missing(request, say)
    if draws_result:
        request.prefetch()
        texture = request.renderer.draw(request.index, request.state, request.direction, quick=True, levels=True)
        quad.draw("show_picture", {"picture": texture}, left, 1.0, opacity=found.strip.blend_alpha)
    if settings.view == "SCRIBBLES":
        _show_scribbles(quad, found.effect, request)
    elif settings.view == "COEFFICIENTS":
        _show_coefficients(quad, found.effect, request)
    else:
        _show_strokes(context, quad, found.effect, request)
    for sentence in session.shortages(request):
        say(sentence)


def _warn(found: Shown, say) -> None:
    """Says what a picture that is drawn over the sequencer's cannot show."""
    if found.strips_above:
        say(rpt_("The strips above are hidden in this view"))
    if found.edit.view_settings.view_transform != "Standard":
        say(rpt_("This view has the view transform Standard"))


def _tell_detail(source, size: tuple[int, int], say) -> None:
    """Says in how much detail the picture is composed, where that is less than a render's; size: of a render's."""
    scale, is_small = f"1/{round(size[0] / source.width)}", source.width < size[0]
    if is_small and source.from_proxy:
        say(rpt_("Composed at {scale} size, from a proxy").format(scale=scale))
    elif is_small:
        say(rpt_("Composed at {scale} size").format(scale=scale))
    elif source.from_proxy:
        say(rpt_("Composed from a proxy"))


def _tell_sharp(region) -> None:
    say = _Notes(region)
    say(rpt_("The sharp frame, to draw on: the result comes with the stroke"))
    with drawing.pixel_space(region):
        say.draw()


def _tell_missing(request, say) -> None:
    """Says in the preview what the engine can only report."""
    try:
        request.check()
    except MediaError as error:
        say(_fault(error))


def _fault(error: Exception) -> str:
    return rpt_("Shutter: {fault}").format(fault=error)


def _show_strokes(context, quad, effect, request) -> None:
    """The scribbles where they are by now; Blender's own annotations show where they were drawn."""
    space = context.space_data
    if not (space.show_overlays and space.preview_overlay.show_annotation):
        return
    for region, shape in zip(strips.drawn_regions(effect), request.state.shapes, strict=True):
        layer = annotations.layer_of(effect, region)
        if layer is not None and layer.annotation_hide:
            continue
        color = (*effect.shutters[shape.shutter].color, 1.0)
        for points in shape.strokes:
            drawing.lines(quad.on_region(points), color, closed=shape.kind == "lasso", width=2)


def _show_source(quad, found: Shown, request, right: float) -> None:
    """The source's own frame, from the left edge on: that of a shutter that is open for it alone."""
    options = replace(request.state.options, step=1)  # no in-between frames come first in reverse
    still = np.zeros((1, options.window))
    still[0, options.before] = 1
    # The shown frame lies where it is for all that move. Without a motion, other frames would have to be read for it.
    following = request.state.following
    moving = following and following.of([following.moving()[0]])
    plain = replace(request, state=FrameState(options, still, following=moving))
    plain.prefetch()
    texture = request.renderer.draw(plain.index, plain.state, plain.direction, levels=True)
    quad.draw("show_picture", {"picture": texture}, 0.0, right, opacity=found.strip.blend_alpha)


def _show_scribbles(quad, effect, request) -> None:
    labels, block = request.renderer.drawn_labels(request.state)
    quad.draw(
        "show_scribbles", {"labels": labels, "palette": _palette(effect)}, opacity=0.7, block=block, size=_size(request)
    )


def _show_coefficients(quad, effect, request) -> None:
    coefficients, block, count = request.renderer.drawn_coefficients(request.index, request.state, request.direction)
    textures = {"coefficients": coefficients, "palette": _palette(effect)}
    quad.draw("show_coefficients", textures, opacity=0.75, block=block, count=count, size=_size(request))


def _size(request) -> tuple[int, int]:
    return request.renderer.source.width, request.renderer.source.height


def _palette(effect) -> Texture:
    """The shutters' colours, display code values, side by side."""
    colors = np.ones((len(effect.shutters), 4), dtype=np.float32)
    colors[:, :3] = [shutter.color for shutter in effect.shutters]
    size = len(colors), 1
    data = gpu.types.Buffer("FLOAT", colors.size, colors.reshape(-1))
    return Texture(gpu.types.GPUTexture(size, layers=1, format="RGBA32F", data=data), (*size, 1), "rgba32f")


class Quad:
    """Where a strip's picture lies in a preview's region, its crop considered."""

    def __init__(self, region, strip, size):
        self._matrix = geometry.picture_to_region(strip, size, region)
        crop, (width, height) = strip.crop, size
        self._low = np.array([crop.min_x / width, crop.min_y / height])
        self._high = 1 - np.array([crop.max_x / width, crop.max_y / height])

    def on_region(self, points) -> np.ndarray:
        """Points (n, 2) of the strip's picture, in fractions, in pixels of the region."""
        return geometry.mapped(self._matrix, np.asarray(points, dtype=np.float64))

    def draw(self, name: str, textures: dict, left: float = 0.0, right: float = 1.0, **constants) -> None:
        """Draws from `left` to `right`, in fractions of the picture's width, through a shader of shaders/."""
        low, high = np.maximum(self._low, (left, 0)), np.minimum(self._high, (right, 1))
        if (low >= high).any():
            return
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        shader = _shader(name)
        shader.bind()
        for sampler, texture in textures.items():
            shader.uniform_sampler(sampler, texture.gpu)
        for constant, value in constants.items():
            (shader.uniform_float if isinstance(value, float) else shader.uniform_int)(constant, value)
        where = {"corner": self.on_region(corners).tolist(), "place": corners}
        gpu.state.blend_set("ALPHA_PREMULT")
        batch_for_shader(shader, "TRI_FAN", where).draw(shader)
        gpu.state.blend_set("NONE")


_SAMPLERS = {
    "show_picture": {"picture": "FLOAT_2D_ARRAY"},
    "show_coefficients": {"coefficients": "FLOAT_2D_ARRAY", "palette": "FLOAT_2D_ARRAY"},
    "show_scribbles": {"labels": "UINT_2D_ARRAY", "palette": "FLOAT_2D_ARRAY"},
}
_CONSTANTS = {
    "show_picture": {"opacity": "FLOAT"},
    "show_coefficients": {"opacity": "FLOAT", "size": "IVEC2", "block": "INT", "count": "INT"},
    "show_scribbles": {"opacity": "FLOAT", "size": "IVEC2", "block": "INT"},
}
_shaders: dict = {}


def _shader(name: str):
    if name not in _shaders:
        between = gpu.types.GPUStageInterfaceInfo("show_interface")
        between.smooth("VEC2", "at")
        info = gpu.types.GPUShaderCreateInfo()
        info.push_constant("MAT4", "ModelViewProjectionMatrix")
        info.push_constant("BOOL", "srgbTarget")  # set by Blender: what is drawn into encodes by itself
        for constant, kind in _CONSTANTS[name].items():
            info.push_constant(kind, constant)
        for slot, (sampler, kind) in enumerate(_SAMPLERS[name].items()):
            info.sampler(slot, kind, sampler)
        info.vertex_in(0, "VEC2", "corner")
        info.vertex_in(1, "VEC2", "place")
        info.vertex_out(between)
        info.fragment_out(0, "VEC4", "shown")
        info.vertex_source(body("show_quad"))
        info.fragment_source(body(name))
        _shaders[name] = gpu.shader.create_from_info(info)
    return _shaders[name]


class _Notes:
    """Sentences at the upper left of a region."""

    def __init__(self, region):
        self._region, self._lines = region, []

    def __call__(self, sentence: str):
        self._lines.append(sentence)

    def draw(self):
        unit = drawing.ui_scale()
        for i, line in enumerate(self._lines):
            drawing.text(16 * unit, self._region.height - (i + 2) * 18 * unit, line)


classes = (ShutterPreview,)
_handler = None


def register():
    global _handler
    for cls in classes:
        bpy.utils.register_class(cls)
    bpy.types.WindowManager.virtual_shutter = PointerProperty(type=ShutterPreview)
    # After the sequencer's picture and before annotations and gizmos, which stay visible.
    _handler = bpy.types.SpaceSequenceEditor.draw_handler_add(_draw, (), "PREVIEW", "POST_VIEW")


def unregister():
    global _handler
    bpy.types.SpaceSequenceEditor.draw_handler_remove(_handler, "PREVIEW")
    _handler = None
    for timer in _TIMERS:
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    _shaders.clear()
    del bpy.types.WindowManager.virtual_shutter
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
