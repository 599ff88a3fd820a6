"""A time map in two clicks, turned, made radial, played and rendered, by mouse. Run inside Blender, by
test_window.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import story

TIME_MAP = 7  # the entry in the menu of regions
RAMP, RADIAL = 371, 447  # where they stand in the sidebar, in pixels below its upper edge


HANDLE = 140  # of the ramp, in pixels to the right of its middle


def on_sidebar(share, below):
    """A point of the sidebar: what share of its width, and how far below its upper edge."""
    return story.sidebar().width * share, story.sidebar().height - below


def region():
    return story.effect().regions[0]


def mapped():
    yield from story.chosen_beside_draw(TIME_MAP)
    yield from driver.until(lambda: len(story.effect().regions), "the menu adds a time map")
    assert (region().kind, region().ramp, region().shutter) == ("RAMP", "LINEAR", "Last")


def undone_and_redone():
    """One undo takes the shutters back as well."""
    after = story.facts()
    for keys, count in (("ctrl+z", 0), ("ctrl+shift+z", 1)):
        driver.move(story.preview(), 50, story.preview().height - 50)
        yield
        driver.key(keys)
        yield from driver.until(lambda count=count: len(story.effect().regions) == count, f"{keys} gives {count}")
        assert len(story.effect().shutters) == 2 + 2 * count
    assert story.facts() == after


def turned():
    """The handle in the picture is dragged about its middle."""
    driver.saw(rotation=region().rotation)
    x, y = story.preview().width / 2, story.preview().height / 2
    yield from driver.drag(story.preview(), [(x + HANDLE, y + up) for up in (0, 5, 20, 60, 90)])
    yield from driver.until(lambda: region().rotation > 0.1, "the ramp turns")
    region().scale = 1.0  # which the handle changes as well
    driver.saw(rotation=region().rotation)


def made_radial():
    driver.move(story.sidebar(), *on_sidebar(0.68, RAMP))  # the slider has held the pointer
    yield 0.5
    driver.click(story.sidebar(), *on_sidebar(0.72, RAMP))
    yield 0.8
    driver.shot("ramps")
    driver.move(story.sidebar(), *on_sidebar(0.68, RADIAL))
    yield 0.5
    driver.click(story.sidebar(), *on_sidebar(0.72, RADIAL))
    yield from driver.until(lambda: region().ramp == "RADIAL", "the ramp is radial")


def played():
    shown = set()
    with driver.override("PREVIEW"):
        bpy.ops.screen.animation_play()
    yield from driver.until(lambda: shown.add(story.edit().frame_current) or len(shown) > 4, "frames follow", 30)
    with driver.override("PREVIEW"):
        bpy.ops.screen.animation_cancel(restore_frame=False)
    story.edit().frame_set(story.FRAME)
    yield


def told():
    yield from story.opened()
    yield from driver.edge_moved(driver.area_of("SEQUENCE_EDITOR", "SEQUENCER"), 0, -296)
    yield from story.movie_added()
    yield from story.effect_added()
    bpy.context.window_manager.virtual_shutter.view = "COEFFICIENTS"
    yield from story.seen("1_effect")
    yield from mapped()
    yield from story.seen("2_linear")
    yield from undone_and_redone()
    yield from story.seen("2_linear_redo")
    yield from turned()
    yield from story.seen("3_turned")
    yield from made_radial()
    yield from story.seen("4_radial")
    bpy.context.window_manager.virtual_shutter.view = "RESULT"
    yield from story.seen("5_result")
    yield from played()
    yield from story.seen("5_result_played")
    yield from story.rendered()


if __name__ == "__main__":
    driver.play(told)
