"""What an effect strip and its scene need so that Blender's sequencer asks the engine for the whole picture."""

from bpy.app.translations import pgettext_rpt as rpt_

from ..data.strips import ENGINE, own_strips
from .add_effect import add_camera


def mend(strip) -> None:
    """Has the sequencer ask the engine for the strip's whole picture, whatever its scene went through."""
    for owner, name, value in _needs(strip):
        if getattr(owner, name) != value:
            setattr(owner, name, value)
    if _camera(strip) is None:
        add_camera(strip.scene)


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
