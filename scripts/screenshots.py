"""The steps of scripts/screenshots, run inside Blender: an edit of the demo's footage, and pictures of it."""

import sys
from pathlib import Path

import bpy
import numpy as np
from OpenImageIO import ROI, UINT8, ImageBuf, ImageBufAlgo

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "blender"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "window"))
import driver
import story

# The bunny turns its head and lets its arm down.
FRAME, LATER, WINDOW = 100, 116, 12
TIMELINE = 250  # its height, in pixels of the screen
# Scribbles, in fractions of the picture, y up.
FACE = [(0.31, 0.80), (0.33, 0.87), (0.37, 0.89), (0.41, 0.85), (0.41, 0.77), (0.37, 0.72), (0.33, 0.74)]
BODY = [(0.07, 0.80), (0.13, 0.66), (0.22, 0.62), (0.24, 0.45), (0.29, 0.33), (0.40, 0.36), (0.46, 0.50), (0.48, 0.66)]


def areas_arranged():
    """A large preview over a low timeline: this window is small."""
    for kind in ("FILE_BROWSER", "PROPERTIES"):
        with bpy.context.temp_override(window=driver.windows()[0], area=driver.area_of(kind)):
            bpy.ops.screen.area_close()
        yield 0.5
    area = driver.area_of("SEQUENCE_EDITOR", "SEQUENCER")
    with bpy.context.temp_override(window=driver.windows()[0]):
        edge = {"x": area.x + area.width // 2, "y": area.y + area.height}
        bpy.ops.screen.area_move(**edge, delta=TIMELINE - area.height)
    yield 0.5
    # The strips' paths are this machine's.
    driver.area_of("SEQUENCE_EDITOR", "SEQUENCER").spaces.active.timeline_overlay.show_strip_source = False


def on_picture(points):
    """Points of the picture in pixels of the preview's region."""
    render, view = driver.edit().render, story.preview().view2d
    width, height = render.resolution_x, render.resolution_y
    return [view.view_to_region((x - 0.5) * width, (y - 0.5) * height, clip=False) for x, y in points]


def curve(points, count=6):
    """A smooth way through the points, as a hand goes: a Catmull-Rom spline."""
    p = np.array([points[0], *points, points[-1]])
    u = np.arange(count)[:, None] / count
    spans = [
        a * (-u + 2 * u**2 - u**3) / 2
        + b * (2 - 5 * u**2 + 3 * u**3) / 2
        + c * (u + 4 * u**2 - 3 * u**3) / 2
        + d * (u**3 - u**2) / 2
        for a, b, c, d in zip(p, p[1:], p[2:], p[3:], strict=False)
    ]
    return [*np.concatenate(spans).tolist(), points[-1]]


def scribbled(shutter, points, kind="LINE"):
    story.effect().active_shutter = shutter
    with driver.override("PREVIEW"):
        bpy.ops.shutter.draw("INVOKE_DEFAULT", True, new=True, kind=kind)
    yield 0.5
    yield from driver.drag(story.preview(), curve(on_picture(points)))
    with driver.override("PREVIEW"):
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")
    yield


def picture(name, box=None):
    """A picture of the window, or of its box of left, top, width, height; the pointer where it highlights nothing."""
    driver.move(story.preview(), story.preview().width / 2, story.preview().height + 12)
    yield 1.5
    path = driver.shot(name)
    if box:
        left, top, width, height = box
        whole = ImageBuf(str(path))
        ImageBufAlgo.cut(whole, ROI(left, left + width, top, top + height)).write(str(path))


def published(name, *pictures):
    """Pictures side by side as a JPG of docs/."""
    panels = [ImageBuf(str(driver.OUT / f"{picture}.png")) for picture in pictures or (name,)]
    sheet = ImageBuf(np.hstack([panel.get_pixels(UINT8)[..., :3] for panel in panels]))
    sheet.specmod().attribute("Compression", "jpeg:90")
    assert sheet.write(str(driver.OUT / f"{name}.jpg")), sheet.geterror()


def preset(name):
    with driver.override("PREVIEW"):
        bpy.ops.shutter.preset("EXEC_DEFAULT", True, preset=name)
    yield 0.5


def region_keyed():
    with driver.override("PREVIEW"):
        bpy.ops.shutter.region_key("EXEC_DEFAULT", True)
    yield 0.5


def region_moved(by):
    """Drags the region's middle handle by fractions of the picture."""
    low, high = np.min(FACE, axis=0), np.max(FACE, axis=0)
    middle = (low + high) / 2
    yield from driver.drag(story.preview(), on_picture([middle, middle + np.array(by) / 2, middle + np.array(by)]))
    assert story.effect().regions[-1].location[1] < by[1] / 2, "the region has not moved"


def dope_sheet_shown():
    """In the timeline's place, its groups of keys unfolded to one line each."""
    area = driver.area_of("SEQUENCE_EDITOR", "SEQUENCER")
    area.ui_type = "DOPESHEET"
    yield 1.0
    where = {"area": area, "region": driver.region_of(area, "CHANNELS")}
    with bpy.context.temp_override(window=driver.windows()[0], **where):
        bpy.ops.anim.channels_expand()
    yield 0.5


def scrolled_down(region):
    driver.move(region, region.width / 2, 100)
    driver.xdotool("click", "--repeat", 60, "--delay", 20, 5)
    yield 1.0


def baked():
    strips = driver.edit().sequence_editor.strips_all
    ends = {strip.name: strip.right_handle for strip in strips}
    for strip in strips:
        strip.right_handle = FRAME + 24
    bpy.ops.wm.save_as_mainfile(filepath=str(driver.OUT / "edit.blend"))
    with driver.override("PREVIEW"):
        bpy.ops.shutter.bake("INVOKE_DEFAULT", file_format="MOVIE")
    yield from driver.until(lambda: any("Baked" in strip.name for strip in strips), "it is baked", 300)
    area = driver.area_of("SEQUENCE_EDITOR", "PREVIEW")
    side = driver.region_of(area, "UI")
    yield from scrolled_down(side)
    driver.click(side, side.width * 0.4, 14)  # the last panel opens
    yield 1.0
    yield from scrolled_down(side)
    low = driver.screen(side, 0, 0)
    yield from picture("panel", (low[0], low[1] - 159, side.width, 160))
    timeline = driver.region_of(driver.area_of("SEQUENCE_EDITOR", "SEQUENCER"))
    left, bottom = driver.screen(timeline, 0, 0)
    yield from picture("strips", (left, bottom - 159, 700, 160))
    published("baked", "panel", "strips")
    with driver.override("PREVIEW"):
        bpy.ops.shutter.unbake("EXEC_DEFAULT", True)
    for strip in strips:
        strip.right_handle = ends[strip.name]
    yield 0.5


def pictures():
    yield from story.opened()
    yield from areas_arranged()
    yield from story.movie_added()
    yield from story.effect_added()
    driver.edit().frame_set(FRAME)
    story.effect().window = WINDOW
    for view, show in (("SEQUENCER", bpy.ops.sequencer.view_all), ("PREVIEW", bpy.ops.sequencer.view_all_preview)):
        with driver.override(view):
            show()
    yield 1.0
    story.effect().active_shutter = 1
    yield from preset("STILL")
    yield from scribbled(0, BODY)
    yield from scribbled(1, FACE, "LASSO")
    yield from picture("window")
    published("window")

    live = bpy.context.window_manager.virtual_shutter
    live.split = 0.22
    left, top, width, height = story.crop()
    for view in ("SPLIT", "COEFFICIENTS"):
        live.view = view
        yield from picture(view.lower(), (left, top, round(width * 0.55), height))
    published("views", "split", "coefficients")
    live.view = "RESULT"

    yield from baked()
    story.effect().active_shutter = 0
    yield from preset("TRAIL")
    yield from story.keyed()
    story.effect().active_shutter = 1
    yield from region_keyed()
    driver.edit().frame_set(LATER)
    story.effect().active_shutter = 0
    yield from preset("ANGLE_360")
    yield from story.keyed()
    story.effect().active_shutter = 1
    yield from region_moved((-0.02, -0.07))
    yield from region_keyed()
    story.effect().active_shutter = 0
    driver.edit().frame_set(FRAME)
    yield from dope_sheet_shown()
    yield from picture("keys", (0, 560, 1230, 388))
    published("keys")


driver.play(pictures)
