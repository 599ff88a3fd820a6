"""Effect strips: a Scene strip above its source, and the scene, data and source that belong to it."""

import uuid

import bpy
from bpy.app.translations import pgettext_data as data_
from bpy.app.translations import pgettext_rpt as rpt_

from ..core.limits import MAX_FRAME
from . import effects, sources

ENGINE = "VIRTUAL_SHUTTER"
SOURCES = ("MOVIE", "IMAGE", "MOVIECLIP")
_COLOR = "COLOR_06"
_LOOK = ("use_flip_x", "use_flip_y", "color_multiply", "color_saturation", "multiply_alpha")


def effect_strips(edit) -> list:
    """The edit's effect strips, those inside meta strips too."""
    if edit.sequence_editor is None:
        return []
    return [
        strip
        for strip in edit.sequence_editor.strips_all
        if strip.type == "SCENE" and strip.scene and strip.scene.render.engine == ENGINE
    ]


def own_strips(edit) -> list:
    """The strips that were made for effects, those too whose scene has another engine or is gone."""
    if edit.sequence_editor is None:
        return []
    return [strip for strip in edit.sequence_editor.strips_all if strip.type == "SCENE" and _is_own(strip)]


def _is_own(strip) -> bool:
    scene, identity = strip.scene, strip.virtual_shutter_effect
    if scene is None:
        return identity != ""
    return scene.render.engine == ENGINE or scene.virtual_shutter.identity == identity != ""


def mend(strip) -> None:
    """Has the sequencer ask the engine for the strip's whole picture, whatever its scene went through."""
    for owner, name, value in _needs(strip):
        if getattr(owner, name) != value:
            setattr(owner, name, value)
    if _camera(strip) is None:
        _add_camera(strip.scene)


def left_out(edit) -> str | None:
    """Why the sequencer leaves an effect out of the edit's current frame; None: it does not."""
    for strip in own_strips(edit):
        if _is_shown(edit, strip):
            if strip.scene is None:
                return rpt_('the scene of "{strip}" was deleted').format(strip=strip.name)
            if _camera(strip) is None:
                return rpt_('the scene of "{strip}" has no camera').format(strip=strip.name)
            for owner, name, value in _needs(strip):
                if getattr(owner, name) != value:
                    setting = owner.bl_rna.properties[name].name
                    return rpt_('the setting "{setting}" leaves "{strip}" out').format(
                        setting=setting, strip=strip.name
                    )
    return None


def _needs(strip):
    """Owner, name and value of what a strip's picture needs, besides a camera."""
    scene = strip.scene
    yield strip, "scene_input", "CAMERA"
    yield scene.render, "engine", ENGINE
    yield scene.render, "resolution_percentage", 100
    yield scene.render, "use_border", False
    if scene.compositing_node_group is not None:
        yield scene.render, "use_compositing", False
    if not any(layer.use for layer in scene.view_layers):
        yield scene.view_layers[0], "use", True


def _camera(strip):
    bound = (marker.camera for marker in strip.scene.timeline_markers if marker.camera)
    return strip.scene_camera or strip.scene.camera or next(bound, None)


def _is_shown(edit, strip) -> bool:
    """Whether the strip is at the edit's current frame, and neither muted nor in a meta strip that is not."""
    while strip is not None:
        outer = strip.parent_meta()
        channel = (outer or edit.sequence_editor).channels[strip.channel]
        if strip.mute or channel.mute or not strip.left_handle <= edit.frame_current < strip.right_handle:
            return False
        strip = outer
    return True


def effect_of(edit, scene):
    """The edit's effect that an effect scene shows, or None."""
    return next((effect for effect in edit.virtual_shutter.effects if effect.scene == scene), None)


def find_edit(scene):
    """Edit, effect and one of its strips for an effect scene. EffectError: nothing uses it any more."""
    for edit in bpy.data.scenes:
        if (effect := effect_of(edit, scene)) is not None:
            for strip in effect_strips(edit):
                if strip.scene == scene:
                    return edit, effect, strip
    raise effects.EffectError(rpt_('scene "{scene}" belongs to no Shutter strip').format(scene=scene.name))


def edit_of(context):
    """The scene whose sequencer the context shows, or None."""
    return getattr(context, "sequencer_scene", None) or context.scene


def active_strip(context):
    """The active strip of the context's edit, or None."""
    edit = edit_of(context)
    return edit.sequence_editor.active_strip if edit and edit.sequence_editor else None


def active(context):
    """Edit, effect and effect strip of the active strip, which may be the source as well; None: it has no effect."""
    strip = active_strip(context)
    if strip is None:
        return None
    edit = edit_of(context)
    if strip.type != "SCENE":
        above = [s for s in effect_strips(edit) if _shows(edit, s, strip)]
        if not above:
            return None
        strip = min(above, key=lambda s: abs(s.left_handle - strip.left_handle))
    effect = effect_of(edit, strip.scene) if strip.scene else None
    return (edit, effect, strip) if effect else None


def _shows(edit, strip, source) -> bool:
    effect = effect_of(edit, strip.scene)
    return effect is not None and effect.source == source.virtual_shutter_source != ""


def choose(edit, strip) -> None:
    """Makes a strip the active and only selected one."""
    for other in edit.sequence_editor.strips_all:
        other.select = other == strip
    edit.sequence_editor.active_strip = strip


def previews(context):
    """Window and area of every sequencer that shows a preview."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "SEQUENCE_EDITOR" and area.spaces.active.view_type != "SEQUENCER":
                yield window, area


def preview_region(area):
    """The region of a sequencer's area that shows the picture."""
    return next(region for region in area.regions if region.type == "PREVIEW")


def origin(strip) -> float:
    """Timeline frame at which the strip's untrimmed content would start: the same for all parts of a cut strip."""
    return strip.content_start - strip.content_trim_start


def timeline_frame(strip, scene_frame: float) -> float:
    """The timeline frame at which an effect strip shows a frame of its scene."""
    return origin(strip) + scene_frame - strip.scene.frame_start


def source_of(edit, effect, strip):
    """The effect's source strip: of those with its identity (parts of a cut strip, copies) the nearest in time, then
    the nearest below. EffectError: there is none any more, or none that has frames."""
    if (source := nearest_source(edit, effect, strip)) is None:
        if others := _with_identity(edit, effect.source):
            sentence = rpt_('the source of "{strip}", "{source}", is not a movie, image or clip strip')
            raise effects.EffectError(sentence.format(strip=strip.name, source=others[0].name))
        raise effects.EffectError(rpt_('the source strip of "{strip}" was deleted').format(strip=strip.name))
    return source


def shown_sources(edit) -> set[str]:
    """Names of the strips that are sources of the edit's effect strips."""
    pairs = [(effect, strip) for strip in effect_strips(edit) if (effect := effect_of(edit, strip.scene))]
    sources = [nearest_source(edit, effect, strip) for effect, strip in pairs]
    return {source.name for source in sources if source is not None}


def nearest_source(edit, effect, strip):
    """What source_of finds, or None."""

    def distance(other):
        apart = max(other.left_handle - strip.right_handle + 1, strip.left_handle - other.right_handle + 1, 0)
        return apart, other.channel > strip.channel, abs(strip.channel - other.channel)

    candidates = [other for other in _with_identity(edit, effect.source) if other.type in SOURCES]
    return min(candidates, key=distance, default=None)


def _with_identity(edit, identity: str) -> list:
    """The edit's strips that an effect with this source is for, whatever they are."""
    return [strip for strip in edit.sequence_editor.strips_all if strip.virtual_shutter_source == identity != ""]


def add_effect(edit, source):
    """Puts a new effect on a movie, image or clip strip: its strip above the source, same range, transform and crop.

    Returns strip and effect; the effect has no shutter yet. MediaError: the source cannot be read."""
    medium = sources.open_media(source)
    medium.close()
    if not source.virtual_shutter_source:
        source.virtual_shutter_source = uuid.uuid4().hex
    name = data_("Shutter {source}").format(source=source.name)
    scene = new_scene(edit, name, (medium.width, medium.height))
    scene.virtual_shutter.identity = uuid.uuid4().hex
    level = (source.parent_meta() or edit.sequence_editor).strips
    taken = {s.channel for s in level if _overlap(s, source)}
    channel = next(c for c in range(source.channel + 1, source.channel + len(taken) + 2) if c not in taken)
    strip = level.new_scene(data_("Shutter"), scene, channel, int(source.content_start))
    strip.left_handle, strip.right_handle = source.left_handle, source.right_handle
    strip.blend_type = source.blend_type
    copy_look(source, strip)
    # Through a transparent picture the plain source would show. An opaque one stays: mute the effect to see it.
    if medium.alpha != "opaque" and not source.mute:
        source.mute = source.virtual_shutter_muted = True
    effect = edit.virtual_shutter.effects.add()
    effect.name, effect.scene, effect.source, effect.start = (
        strip.name,
        scene,
        source.virtual_shutter_source,
        origin(strip),
    )
    strip.virtual_shutter_effect = scene.virtual_shutter.identity
    edit.render.sequencer_gl_preview = "RENDERED"  # or the preview shows the effect's empty scene
    strip.color_tag = _COLOR
    connect(edit, [strip, source, *source.connections])
    return strip, effect_of(edit, scene)  # again: an operator's update may move the collection's items in memory


def connect(edit, connected) -> None:
    """Connects strips, so that they are selected and moved together; each leaves the strips it was connected to."""
    selected = [strip for strip in edit.sequence_editor.strips_all if strip.select]
    for strip in selected:
        strip.select = False
    for strip in connected:
        strip.select = True
    # Blender has an operator only, which takes the selection; this override is all it asks for.
    with bpy.context.temp_override(sequencer_scene=edit):
        bpy.ops.sequencer.connect(toggle=False)
    for strip in connected:
        strip.select = strip in selected


def _overlap(a, b) -> bool:
    return a.left_handle < b.right_handle and b.left_handle < a.right_handle


def copy_look(source, strip) -> None:
    """Transform, crop, flip and colour of the source strip."""
    for group in ("transform", "crop"):
        old, new = getattr(source, group), getattr(strip, group)
        for prop in old.bl_rna.properties:
            if not prop.is_readonly:
                setattr(new, prop.identifier, getattr(old, prop.identifier))
    for name in _LOOK:
        setattr(strip, name, getattr(source, name))


def new_scene(edit, name: str, size):
    """A scene for an effect of the edit, with a camera and an empty annotation."""
    scene = bpy.data.scenes.new(name)
    scene.render.engine = ENGINE
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    # Past its scene's end a Scene strip shows the last frame. Source and strip may be made longer, by hand, by speed or
    # by keys of the source time.
    scene.frame_start, scene.frame_end = 1, MAX_FRAME
    # A Scene strip plays at its scene's rate; at the edit's it shows one frame per timeline frame.
    scene.render.fps, scene.render.fps_base = edit.render.fps, edit.render.fps_base
    _add_camera(scene)
    scene.annotation = bpy.data.annotations.new(name)
    return scene


def _add_camera(scene) -> None:
    """Without a camera, Blender renders a Scene strip empty and never asks the engine."""
    name = f"{scene.name} Camera"
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    scene.collection.objects.link(camera)
    scene.camera = camera
