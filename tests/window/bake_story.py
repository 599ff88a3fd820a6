"""An effect is baked to a movie beside Blender while the editor goes on, played, told to be stale, baked again, and
brought back. Run inside Blender, by test_baked.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
from given_edit import edit, opened

LAST, FRAME = 40, 20
REPORT = 36  # the height of what stands below the panel
UNBAKE, STOP = 20 + REPORT, 20 + REPORT  # where they stand, in pixels above the sidebar's lower edge


def strip(name):
    return edit().sequence_editor.strips_all.get(name)


def effect():
    return edit().virtual_shutter.effects[0]


def baked():
    return strip("Shutter Baked")


def seen(name):
    yield from scrolled_down()
    driver.move(driver.region_of(driver.area_of("SEQUENCE_EDITOR", "PREVIEW"), "HEADER"), 400, 10)
    yield 1.0
    yield from driver.shot_when_shown(name)


def sidebar():
    return driver.region_of(driver.area_of("SEQUENCE_EDITOR", "PREVIEW"), "UI")


def scrolled_down():
    region = sidebar()
    driver.move(region, region.width / 2, 100)
    driver.xdotool("click", "--repeat", 60, "--delay", 20, 5)
    yield 1.0


def clicked(up, share=0.4):
    """The button or panel that stands so many pixels above the sidebar's lower edge, once that is scrolled down."""
    yield from scrolled_down()
    driver.click(sidebar(), sidebar().width * share, up)
    yield 1.0


def bake(kind):
    with driver.override("PREVIEW"):
        assert bpy.ops.shutter.bake("INVOKE_DEFAULT", file_format=kind) == {"CANCELLED"}, "it goes on beside Blender"


def finished():
    yield from driver.until(lambda: baked() is not None, "it is baked", 120)


def begun():
    yield from opened()
    area = driver.area_of("SEQUENCE_EDITOR", "PREVIEW")
    area.spaces.active.show_region_ui = True
    yield 0.5
    driver.region_of(area, "UI").active_panel_category = "Shutter"
    strip("Source").right_handle = strip("Shutter").right_handle = LAST + 1
    edit().frame_end = LAST
    edit().frame_set(FRAME)
    bpy.ops.wm.save_as_mainfile(filepath=str(driver.OUT / "edit.blend"))
    yield from clicked(13 + REPORT)  # the panel opens


def told():
    yield from begun()
    yield from rendered("effect")
    yield from seen("1_effect")
    bake("MOVIE")
    yield 1.5
    yield from seen("2_baking")
    yield from finished()
    driver.saw(muted=strip("Shutter").mute, handles=[baked().left_handle, baked().right_handle])
    yield from rendered("baked")
    yield from seen("3_baked")
    effect().shutters[0].bars[3].weight = 0.1
    yield from seen("4_stale")
    yield from clicked(UNBAKE)
    driver.saw(unbaked=baked() is None and not strip("Shutter").mute)
    yield from seen("5_unbaked")
    with driver.override("SEQUENCER"):
        bpy.ops.ed.undo()
    yield 1.0
    driver.saw(undone=baked() is not None and strip("Shutter").mute)
    with driver.override("SEQUENCER"):
        bpy.ops.ed.redo()
    yield 1.0
    bake("OPEN_EXR")
    yield from driver.until(lambda: list(driver.OUT.rglob("0003.exr")), "frames are written", 60, wait=0.05)
    yield from clicked(STOP, 0.87)
    kept = {path: path.stat().st_mtime_ns for path in driver.OUT.rglob("*.exr")}
    driver.saw(stopped=baked() is None and 3 <= len(kept) < LAST)
    yield from seen("6_stopped")
    bake("OPEN_EXR")
    yield from finished()
    driver.saw(resumed=all(path.stat().st_mtime_ns == time for path, time in list(kept.items())[:2]))
    yield from seen("7_exr")
    bpy.ops.wm.save_mainfile()


def rendered(name):
    """A frame, by Ctrl F12's way."""
    edit().render.filepath = str(driver.OUT / name)
    bpy.ops.render.render(write_still=True, scene="Edit")
    yield 0.5


if __name__ == "__main__":
    driver.play(told)
