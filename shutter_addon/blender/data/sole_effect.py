"""Whether a film shows nothing but an effect's picture, unchanged, and whether its 8-bit levels can be predicted.

If so, a film can be rendered without Blender's engine, with the same bits (output/edit_feed.py).
"""

from collections.abc import Mapping

import bpy
from bpy.types import Scene, Strip, bpy_struct

from . import fcurves, requirements, strips, versions

_KNOWN_TO = (5, 4)  # versions before this have the dither and colors that are known to the bit
_PLAIN_STRIP = {
    **{"blend_alpha": 1.0, "color_multiply": 1.0, "color_saturation": 1.0, "scene_input": "CAMERA"},
    **dict.fromkeys(
        ("use_flip_x", "use_flip_y", "use_float", "use_reverse_frames", "use_deinterlace", "multiply_alpha"), False
    ),
}
IN_PLACE = {"scale_x": 1.0, "scale_y": 1.0, "offset_x": 0.0, "offset_y": 0.0, "rotation": 0.0}
_UNCROPPED = dict.fromkeys(("min_x", "min_y", "max_x", "max_y"), 0)
_WHOLE = {"resolution_percentage": 100, "use_border": False, "use_multiview": False}
_UNMARKED = {"use_stamp": False, "metadata_input": "SCENE"}
_PLAIN_RENDER = _UNMARKED | {"use_sequencer": True, "frame_map_old": 100, "frame_map_new": 100}
PLAIN_VIEW = {"look": "None", "exposure": 0.0, "gamma": 1.0, "use_curve_mapping": False, "use_white_balance": False}
STANDARD = PLAIN_VIEW | {"view_transform": "Standard"}
_LEVELS = {"color_depth": "8", "color_management": "FOLLOW_SCENE"}


def has_values(item: bpy_struct, values: Mapping[str, object]) -> bool:
    """Tell whether all properties in `values`, by name, have these values in an item."""
    return all(getattr(item, name) == value for name, value in values.items())


def covers_all(scene: Scene, strip: Strip) -> bool:
    """Tell whether an effect strip's picture is shown unchanged and fills the whole image, at all frames of the strip.

    Where that picture is opaque, it hides all strips below. A strip with any animated property counts as changed.
    """
    size, shown = scene.render, strip.scene.render
    return (
        strip.blend_type in ("REPLACE", "ALPHA_OVER")
        and has_values(strip, _PLAIN_STRIP)
        and has_values(strip.transform, IN_PLACE)
        and has_values(strip.crop, _UNCROPPED)
        and strip.strobe <= 1  # 0 or 1 shows all frames: defaults of Blender 5.2 and 5.3
        and not strip.modifiers
        and not strip.retiming_keys
        and has_values(size, _WHOLE)
        and has_values(shown, _UNMARKED)
        and (shown.resolution_x, shown.resolution_y) == (size.resolution_x, size.resolution_y)
        and not has_animation(scene, f'sequence_editor.strips_all["{bpy.utils.escape_identifier(strip.name)}"]')
    )


def strip_at(scene: Scene, frame: int, but: str | None = None) -> tuple[Strip, bool] | None:
    """Return the effect strip that alone makes a scene's image at a timeline frame: on top, unchanged and filling it.

    Args:
        frame: The timeline frame.
        but: Name of a strip that is ignored, as if it were not there; None: no strip is ignored.

    Returns:
        The strip, and whether Blender blends it with a strip below, which changes the last bits of colors. None if the
        image is not that of one effect strip, or if that is not certain, as where muting is animated.
    """
    editor = scene.sequence_editor
    if has_animation(scene, ".mute"):
        return None  # strips may be muted at other frames
    others = [strip for strip in editor.strips if strip.type != "SOUND" and strip.name != but]
    seen = [strip for strip in others if frame in requirements.shown_frames(scene, strip)]
    top = max(seen, key=lambda strip: strip.channel, default=None)
    if top is None or top not in strips.effect_strips(scene) or not covers_all(scene, top):
        return None
    # An input of an effect strip is not seen itself.
    inputs = [getattr(strip, name, None) for strip in seen for name in ("input_1", "input_2")]
    if top in inputs or not strips.origin(top).is_integer():
        return None
    is_blended = top.blend_type != "REPLACE" and len(seen) > 1
    effect = strips.effect_of(scene, top.scene)
    # A strip other than the source may have no picture below.
    if is_blended and (effect is None or strips.nearest_source(scene, effect, top) not in seen):
        return None
    return top, is_blended


def has_known_levels(scene: Scene) -> bool:
    """Tell whether a scene's render makes 8-bit levels of the sequencer's picture by the sRGB curve alone."""
    return (
        bpy.app.version < _KNOWN_TO
        and not versions.colours()
        and bpy.data.colorspace.working_space == "Linear Rec.709"
        and scene.sequencer_colorspace_settings.name == "sRGB"
        and scene.display_settings.display_device == "sRGB"
        and has_values(scene.view_settings, STANDARD)
        and has_values(scene.render.image_settings, _LEVELS)
        and scene.render.image_settings.file_format in ("FFMPEG", "PNG", "JPEG")
        and scene.render.image_settings.color_mode in ("RGB", "RGBA")  # Blender makes grey from light
        and has_values(scene.render, _PLAIN_RENDER)
        and scene.frame_subframe == 0
        and not any(has_animation(scene, name) for name in ("view_settings", "render.", "display_settings"))
    )


def has_animation(scene: Scene, part: str) -> bool:
    """Tell whether a scene has an F-curve or a driver for a property whose data path contains `part`.

    If the scene has NLA tracks, the answer is always True: they may animate anything.
    """
    animation = scene.animation_data
    if animation is None:
        return False
    curves = [*fcurves.curves_under(scene, ""), *animation.drivers]
    return bool(animation.nla_tracks) or any(part in curve.data_path for curve in curves)
