"""*Full Quality*: show the current frame exactly as it will be rendered, one pixel of it on one pixel of the screen.

It ends with a second click, at another frame, or when the effect changes. Then the view is as before.
"""

from functools import partial

import bpy
from bpy.app.translations import pgettext_rpt as rpt_
from bpy.types import Area, Context, Operator, Region, Window

from ..data import preview_areas
from ..devices import main_thread
from ..rendering import previews
from .operator_bases import Named

_TICK = 0.1  # seconds between two checks whether it has ended


class SHUTTER_OT_full_quality(Named, Operator):
    """Show this frame exactly as it will be rendered, at one screen pixel per pixel; click again to end"""

    bl_label = "Full Quality"
    bl_options = {"REGISTER"}

    @classmethod
    def refusal(cls, context: Context) -> str | None:
        return None if _shown(context) is not None else rpt_("No preview shows a Shutter strip")

    def execute(self, context: Context) -> set[str]:
        if previews.looking.whole is not None:
            previews.looking.whole = None
        elif found := _shown(context):
            window, area, shown = found
            previews.looking.whole = previews.Whole(shown.effect.scene.session_uid, shown.scene.frame_current)
            shown.strip.invalidate_cache("RAW")
            space, region = area.spaces.active, preview_areas.preview_region(area)
            proxies = space.proxy_render_size, space.use_proxies
            back = partial(_bring_back, area.as_pointer(), proxies, *_view_of(region))
            space.proxy_render_size, space.use_proxies = "SCENE", False
            _zoom(window, area, region.height)
            main_thread.later(back, _TICK)  # it can end without a click
            preview_areas.redraw()
        return {"FINISHED"}


def _shown(context: Context) -> tuple[Window, Area, preview_areas.PreviewedStrip] | None:
    """Return a preview that shows an effect: window, area and the shown effect strip; None: no preview does.

    Prefer the area of the context.
    """
    areas = sorted(preview_areas.previews(context), key=lambda pair: pair[1] != context.area)
    for window, area in areas:
        with preview_areas.within(window, area):
            if (shown := preview_areas.shown(bpy.context)) is not None:
                return window, area, shown
    return None


def _bring_back(address: int, proxies: tuple[str, bool], rows: float, centre: tuple[float, float]) -> float | None:
    """Restore zoom, center and proxy settings of a preview once *Full Quality* has ended. This is a timer of Blender.

    Zoom and center stay if the user has changed the zoom meanwhile; proxy settings stay if the user has changed them.

    Args:
        address: Address of the preview's area (as_pointer()).
        proxies: proxy_render_size and use_proxies to restore.
        rows: Zoom to restore, as in `_view_of`.
        centre: Center to restore, as in `_view_of`.

    Returns:
        Seconds until Blender calls this again, while *Full Quality* is on; None: it has ended, and the timer ends, too.
    """
    if previews.looking.whole is not None:
        return _TICK
    for window, area in list(preview_areas.previews(bpy.context)):
        if area.as_pointer() != address:
            continue
        space, region = area.spaces.active, preview_areas.preview_region(area)
        if (space.proxy_render_size, space.use_proxies) == ("SCENE", False):
            space.proxy_render_size, space.use_proxies = proxies
        if abs(_view_of(region)[0] - region.height) < 1:
            _zoom(window, area, rows)
            _centre(window, area, centre)
    preview_areas.redraw()
    return None


def _view_of(region: Region) -> tuple[float, tuple[float, float]]:
    """Return a preview's zoom, as the number of picture rows that its region shows, and the point at its center.

    The point is in the sequencer's image space: pixels, origin at the image's center, y up.
    """
    size = region.width, region.height
    (left, bottom), (right, top) = (region.view2d.region_to_view(*at) for at in ((0, 0), size))
    # Blender counts one pixel less.
    return (top - bottom) * (region.height - 1) / region.height, ((left + right) / 2, (bottom + top) / 2)


def _zoom(window: Window, area: Area, rows: float) -> None:
    with preview_areas.within(window, area):
        # The operator divides the height by the ratio, adds a half and rounds up.
        bpy.ops.sequencer.view_zoom_ratio(ratio=bpy.context.region.height / (rows - 0.6))


def _centre(window: Window, area: Area, centre: tuple[float, float]) -> None:
    region = preview_areas.preview_region(area)
    rows, now = _view_of(region)
    x, y = ((wanted - here) * region.height / rows for wanted, here in zip(centre, now, strict=True))
    with preview_areas.within(window, area):
        bpy.ops.view2d.pan(deltax=round(x), deltay=round(y))


def unregister() -> None:
    previews.looking.whole = None
