"""A mask drawn in Blender's mask editor, made a matte, moved by its shape keys and by hand, and rendered, by mouse. Run
inside Blender, by test_window.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import subprocess
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import story

FRAME, LATER, RENDERED = 50, 60, 55
# In fractions of the picture.
CORNERS = (0.25, 0.25), (0.55, 0.25), (0.55, 0.75), (0.25, 0.75)
MOVED = (0.8, 0.75)  # where the third one is taken
FROM_MASK = 4  # the entry in the menu of regions


def clip():
    return driver.region_of(driver.area_of("CLIP_EDITOR"))


def on_clip(x, y):
    """Pixels of the clip editor's region, of a point in fractions of the picture."""
    return clip().view2d.view_to_region(x, y, clip=False)


def mask_editor_opened():
    """A clip editor with the footage beside the preview, larger than the file browser that was there."""
    yield from driver.edge_moved(driver.area_of("SEQUENCE_EDITOR", "SEQUENCER"), 0, -296)
    yield from driver.edge_moved(driver.area_of("FILE_BROWSER"), 200, 0)
    area = driver.area_of("FILE_BROWSER")
    area.type = "CLIP_EDITOR"
    space = area.spaces.active
    space.clip, space.mode = bpy.data.movieclips.load(story.FOOTAGE), "MASK"
    space.show_region_toolbar = space.show_region_ui = space.show_region_hud = False
    yield 0.5
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area, region=clip()):
        bpy.ops.clip.view_all(fit_view=True)
    yield 0.5


def mask():
    return bpy.data.masks["Mask"]


def points():
    return [tuple(point.co) for layer in mask().layers for spline in layer.splines for point in spline.points]


def control_clicked(point):
    driver.move(clip(), *on_clip(*point))
    yield 0.1
    driver.xdotool("keydown", "ctrl")
    yield 0.1
    driver.xdotool("mousedown", 1)
    yield 0.1
    driver.xdotool("mouseup", 1)
    yield 0.1
    driver.xdotool("keyup", "ctrl")
    yield 0.1


def drawn():
    driver.move(clip(), clip().width / 2, clip().height / 2)
    yield
    driver.key("alt+n")
    yield from driver.until(lambda: bpy.data.masks, "there is a mask")
    for corner in CORNERS:
        yield from control_clicked(corner)
    assert len(points()) == len(CORNERS)
    driver.key("alt+c")
    yield from driver.until(lambda: mask().layers[0].splines[0].use_cyclic, "the mask is closed")
    yield from keyed()


def keyed():
    driver.move(clip(), *on_clip(0.5, 0.5))
    yield
    driver.key("i")
    yield 0.5


def dragged(start, end):
    """A point of the mask."""
    before = points()
    middle = [(a + b) / 2 for a, b in zip(start, end, strict=True)]
    yield from driver.drag(clip(), [on_clip(*point) for point in (start, middle, end)])
    assert points() != before, "the mask did not change"


def made_a_matte():
    yield from story.chosen_beside_draw(FROM_MASK)
    yield from driver.until(lambda: len(story.effect().regions), "the menu adds a region")
    (region,) = story.effect().regions
    assert (region.kind, region.matte, region.mask, region.shutter) == ("MATTE", "MASK", mask(), "Sharp")


def undone_and_redone():
    before = story.facts()
    for keys, count in (("ctrl+z", 0), ("ctrl+shift+z", 1)):
        driver.move(story.preview(), 50, story.preview().height - 50)
        yield
        driver.key(keys)
        yield from driver.until(lambda count=count: len(story.effect().regions) == count, f"{keys} gives {count}")
    assert story.facts() == before
    assert story.effect().regions[0].mask == mask()


def in_background(frame):
    """The same frame of the saved file, by a Blender without a window."""
    path = driver.OUT / "edit.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    name = "bl_ext.user_default.virtual_shutter"
    output = str(driver.OUT / "background_")
    command = [bpy.app.binary_path, "--factory-startup", "--addons", name, "-b", path, "-o", output, "-f", str(frame)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    yield from driver.until(lambda: process.poll() is not None, "the render without a window ends", 60)
    assert process.returncode == 0
    driver.saw(background=process.stdout.read())


def told():
    yield from story.opened()
    yield from mask_editor_opened()
    yield from story.movie_added()
    yield from drawn()
    story.edit().frame_set(LATER)
    yield
    yield from dragged(CORNERS[2], MOVED)
    yield from keyed()
    yield from story.effect_added()
    story.effect().active_shutter = 1
    bpy.context.window_manager.virtual_shutter.view = "COEFFICIENTS"
    yield from story.seen("1_effect")
    yield from made_a_matte()
    yield from story.seen("2_matte")
    yield from undone_and_redone()
    yield from story.seen("2_matte_redo")
    story.edit().frame_set(FRAME)
    yield from story.seen("3_earlier")
    story.edit().frame_set(LATER)
    yield
    yield from dragged(CORNERS[3], (0.1, 0.9))
    yield from keyed()
    yield from story.seen("4_dragged")
    bpy.context.window_manager.virtual_shutter.view = "RESULT"
    yield from story.in_agreement(RENDERED)
    yield from in_background(RENDERED)


if __name__ == "__main__":
    driver.play(told)
