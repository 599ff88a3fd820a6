"""Blender's areas that show a preview, and what they show of an effect: read of Blender's data here alone."""

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.types import Area, Context, PropertyGroup, Scene, Space, Strip

from . import annotations, seen_alone, selection, source_media, strips

_PERCENT = {"PROXY_25": 25, "PROXY_50": 50, "PROXY_75": 75, "PROXY_100": 100}
_PLAIN_STRIP = {"blend_alpha": 1.0, "color_saturation": 1.0, "scene_input": "CAMERA"}
_PLAIN_SPACE = {"display_mode": "IMAGE", "display_channel": 0, "show_overexposed": 0}


@dataclass(frozen=True)
class Shown:
    """The effect strip that a preview shows.

    strips_above: whether others hide it; hides_strokes: by region that is drawn, whether its lines are hidden"""

    scene: Scene
    effect: PropertyGroup
    strip: Strip
    strips_above: bool
    hides_strokes: tuple[bool, ...]


@dataclass(frozen=True)
class Look:
    """How an effect's picture is looked at in all previews of its scene.

    scale: how wide or high a pixel of the source is in the largest of them; None: there is none
    proxy: what Blender reads of the source for that one; None: the footage itself
    is_plain: whether they show the strip's picture as it is, so that it may be drawn in their place"""

    scale: float | None
    proxy: source_media.Proxy | None
    is_plain: bool


def previews(context: Context) -> Iterator[tuple[bpy.types.Window, Area]]:
    """Window and area of every sequencer that shows a preview."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "SEQUENCE_EDITOR" and area.spaces.active.view_type != "SEQUENCER":
                yield window, area


def redraw(_owner: object = None, _context: Context | None = None) -> None:
    """Draws all previews again; Blender calls it with two arguments after a change of a property."""
    for _window, area in previews(bpy.context):
        area.tag_redraw()  # of the area alone, Blender's picture and ours


def redraw_panels() -> None:
    """Draws panels again, and no preview; a timer as well."""
    kinds = {"SEQUENCE_EDITOR": "UI", "PROPERTIES": "WINDOW"}
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if region.type == kinds.get(area.type):
                    region.tag_redraw()


def within(window: bpy.types.Window, area: Area) -> AbstractContextManager:
    """A context in which Blender's operators work in the preview of a sequencer's area."""
    return bpy.context.temp_override(window=window, area=area, region=preview_region(area))


def preview_region(area: Area) -> bpy.types.Region:
    """The region of a sequencer's area that shows the picture."""
    return next(region for region in area.regions if region.type == "PREVIEW")


def shown(context: Context, channel: int = 0) -> Shown | None:
    """The effect strip under the playhead that the preview shows, as selection.seen has it. channel: that the preview
    has to show, 0: all."""
    scene, space = selection.scene_of(context), context.space_data
    if (space.display_mode, space.display_channel) != ("IMAGE", channel) or (seen := selection.seen(scene)) is None:
        return None
    _, effect, strip = seen
    above = any(other.channel > strip.channel for other in selection.visible(scene))
    hidden = tuple(annotations.is_hidden(effect, region) for region in strips.drawn_regions(effect))
    return Shown(scene=scene, effect=effect, strip=strip, strips_above=above, hides_strokes=hidden)


def look(context: Context, scene: Scene, effect: PropertyGroup, strip: Strip) -> Look:
    """How an effect's picture is looked at."""
    areas = list(_areas_of(context, scene))
    scales = {area.spaces.active: _scale(context, scene, strip, area) for area in areas}
    scales = {space: scale for space, scale in scales.items() if math.isfinite(scale)}
    is_plain = _is_plain(scene, strip) and all(seen_alone.has(area.spaces.active, _PLAIN_SPACE) for area in areas)
    if not scales:
        return Look(None, None, is_plain)
    space = max(scales, key=scales.__getitem__)
    return Look(scales[space], _proxy(scene, effect, strip, space), is_plain)


def _is_plain(scene: Scene, strip: Strip) -> bool:
    """Whether the scene shows a strip's picture as it is."""
    return (
        strip.blend_type in ("REPLACE", "ALPHA_OVER")
        and seen_alone.has(strip, _PLAIN_STRIP)
        and strip.color_multiply in (1, strips.IN_CODE_VALUES)
        and all(modifier.mute for modifier in strip.modifiers)
        and scene.display_settings.display_device == "sRGB"
        and seen_alone.has(scene.view_settings, seen_alone.STANDARD)
        and not scene.render.use_multiview
        and not scene.sequence_editor.show_overlay_frame
    )


def _proxy(scene: Scene, effect: PropertyGroup, strip: Strip, space: Space) -> source_media.Proxy | None:
    """What Blender reads of an effect's source in a preview; None: the footage itself."""
    source, percent = strips.nearest_source(scene, effect, strip), _PERCENT.get(space.proxy_render_size)
    if source is None or percent is None or not space.use_proxies:
        return None
    return source_media.proxy_of(scene, source, percent)


def _scale(context: Context, scene: Scene, strip: Strip, area: Area) -> float:
    """How wide or high a pixel of the source is in a preview: in its picture, which is as small as Blender's menu has
    it; and on the screen, where our handler draws."""
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
    """The larger side of a picture's pixel after a matrix (3, 3) from fractions of the picture."""
    return float(np.max(np.hypot(*matrix[:2, :2]) / size))


def _areas_of(context: Context, scene: Scene) -> Iterator[Area]:
    """The areas in which a scene's preview is drawn."""
    for window, area in previews(context):
        shows = getattr(window.workspace, "sequencer_scene", None) or window.scene
        if shows == scene and area.spaces.active.proxy_render_size != "NONE":
            yield area
