"""The preview areas of Blender's windows: which effect they show, how large, and whether anything changes its picture.

No other module reads this from Blender.
"""

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import NamedTuple

import bpy
import numpy as np
from bpy.types import Area, Context, PropertyGroup, Scene, Space, Strip

from . import annotations, selection, sole_effect, source_media, strips

_PERCENT = {"PROXY_25": 25, "PROXY_50": 50, "PROXY_75": 75, "PROXY_100": 100}
_PLAIN_STRIP = {"blend_alpha": 1.0, "color_saturation": 1.0, "scene_input": "CAMERA"}
_PLAIN_SPACE = {"display_mode": "IMAGE", "display_channel": 0, "show_overexposed": 0}


class PreviewedStrip(NamedTuple):
    """The effect strip that a preview shows at the playhead.

    Attributes:
        scene: The scene that has the strip and its effect.
        strip: The effect strip.
        strips_above: Whether visible strips lie in higher channels; they may cover it.
        hides_strokes: For each region with strokes (all but mattes and ramps) whose shutter exists, in order, whether
            the user has hidden its annotation layer.
    """

    scene: Scene
    effect: PropertyGroup
    strip: Strip
    strips_above: bool
    hides_strokes: tuple[bool, ...]


class Look(NamedTuple):
    """How the previews of a scene show an effect's picture.

    Attributes:
        scale: Pixels per pixel of the effect's picture in the largest preview, 1.0 at full size: of the preview's
            resolution, or of the screen if that has fewer. With *Live* off, it is the resolution's percentage, as a
            fraction. None: no preview shows the scene.
        proxy: The proxy file that Blender reads for the source in that preview. None: it reads the footage itself, or
            there is no preview.
        is_plain: Whether all previews show the strip's picture unchanged. Then a result may be drawn over it.
    """

    scale: float | None
    proxy: source_media.Proxy | None
    is_plain: bool


def previews(context: Context) -> Iterator[tuple[bpy.types.Window, Area]]:
    """Yield each sequencer area that shows a preview, with its window."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "SEQUENCE_EDITOR" and area.spaces.active.view_type != "SEQUENCER":
                yield window, area


def redraw(_owner: object = None, _context: Context | None = None) -> None:
    """Redraw all previews. It can be a property's update callback, and takes the arguments of one."""
    for _window, area in previews(bpy.context):
        area.tag_redraw()


def redraw_panels() -> None:
    """Redraw the sequencer's sidebars, but no preview."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if (area.type, region.type) == ("SEQUENCE_EDITOR", "UI"):
                    region.tag_redraw()


def within(window: bpy.types.Window, area: Area) -> AbstractContextManager:
    """Return a context manager in which Blender's operators act on the preview of a sequencer area."""
    return bpy.context.temp_override(window=window, area=area, region=preview_region(area))


def preview_region(area: Area) -> bpy.types.Region:
    """Return the region of a sequencer's area that shows the picture."""
    return next(region for region in area.regions if region.type == "PREVIEW")


def shown(context: Context, channel: int = 0) -> PreviewedStrip | None:
    """Return the effect strip that the context's preview shows at the playhead.

    Args:
        context: A context of a sequencer area with a preview.
        channel: The required value of the preview's setting *Display Channel*; 0 is for a preview of all channels.

    Returns:
        The strip that selection.seen finds. None if there is none, or the preview has another *Display Channel* or
        shows a scope in place of the picture.
    """
    scene, space = selection.scene_of(context), context.space_data
    if (space.display_mode, space.display_channel) != ("IMAGE", channel) or (seen := selection.seen(scene)) is None:
        return None
    _, effect, strip = seen
    above = any(other.channel > strip.channel for other in selection.visible(scene))
    drawn = [region for region in strips.used_regions(effect) if region.kind not in strips.MATTES]
    layers = [annotations.layer_of(effect, region) for region in drawn]
    hidden = tuple(layer is not None and layer.annotation_hide for layer in layers)
    return PreviewedStrip(scene=scene, effect=effect, strip=strip, strips_above=above, hides_strokes=hidden)


def look(context: Context, scene: Scene, effect: PropertyGroup, strip: Strip) -> Look:
    """Return how the previews of a scene show an effect's picture.

    Args:
        context: The context, whose windows are searched for previews.
        scene: The scene of the edit, which has the effect strip.
        strip: The effect strip.

    Returns:
        Scale and proxy of the largest preview, and whether all previews show the picture unchanged, without blending,
        modifiers, or settings of display or overlay that alter it.
    """
    areas = list(_areas_of(context, scene))
    scales = {area.spaces.active: _scale(context, scene, strip, area) for area in areas}
    scales = {space: scale for space, scale in scales.items() if math.isfinite(scale)}
    spaces = [area.spaces.active for area in areas]
    is_plain = _is_plain(scene, strip) and all(sole_effect.has_values(space, _PLAIN_SPACE) for space in spaces)
    if not scales:
        return Look(None, None, is_plain)
    space = max(scales, key=scales.__getitem__)
    return Look(scales[space], _proxy(scene, effect, strip, space), is_plain)


def _is_plain(scene: Scene, strip: Strip) -> bool:
    """Tell whether a scene shows a strip's picture unchanged by blending, modifiers and view settings."""
    return (
        strip.blend_type in ("REPLACE", "ALPHA_OVER")
        and sole_effect.has_values(strip, _PLAIN_STRIP)
        and strip.color_multiply in (1, strips.IN_CODE_VALUES)
        and all(modifier.mute for modifier in strip.modifiers)
        and scene.display_settings.display_device == "sRGB"
        and sole_effect.has_values(scene.view_settings, sole_effect.STANDARD)
        and not scene.render.use_multiview
        and not scene.sequence_editor.show_overlay_frame
    )


def _proxy(scene: Scene, effect: PropertyGroup, strip: Strip, space: Space) -> source_media.Proxy | None:
    """Return the proxy that Blender reads of an effect's source for a preview; None: the footage itself."""
    source, percent = strips.nearest_source(scene, effect, strip), _PERCENT.get(space.proxy_render_size)
    if source is None or percent is None or not space.use_proxies:
        return None
    return source_media.proxy_of(scene, source, percent)


def _scale(context: Context, scene: Scene, strip: Strip, area: Area) -> float:
    """Return how many pixels a preview has for a pixel of the effect's picture, as a factor for lengths.

    This is the lower of two scales, both including the strip's transform: that of the image that Blender renders at the
    preview's resolution setting, and that of the image on the screen, with zoom. With *Live* off, it is the setting
    alone, as a fraction.
    """
    space = area.spaces.active
    percent = _PERCENT.get(space.proxy_render_size, scene.render.resolution_percentage)
    size = strip.scene.render.resolution_x, strip.scene.render.resolution_y
    scale = percent / 100 * _pixel(annotations.picture_to_image(strip, size), size)
    if not context.window_manager.virtual_shutter.live:
        return percent / 100
    region = preview_region(area)
    if space.display_mode != "IMAGE" or min(region.width, region.height) < 2:
        return scale
    return min(scale, _pixel(annotations.picture_to_region(strip, size, region), size))


def _pixel(matrix: np.ndarray, size: tuple[int, int]) -> float:
    """Return the length of the longer side of one pixel of a picture, measured in the space that a matrix maps to.

    Args:
        matrix: (3, 3), maps fractions 0 to 1 of the picture's width and height to that space.
        size: The picture's width and height in pixels.
    """
    return float(np.max(np.hypot(*matrix[:2, :2]) / size))


def _areas_of(context: Context, scene: Scene) -> Iterator[Area]:
    """Yield the sequencer areas in which a scene's preview is drawn."""
    for window, area in previews(context):
        shows = getattr(window.workspace, "sequencer_scene", None) or window.scene
        if shows == scene and area.spaces.active.proxy_render_size != "NONE":
            yield area
