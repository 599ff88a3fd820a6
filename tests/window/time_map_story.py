"""A time map in two clicks, turned, made radial, played and rendered, by mouse. Run inside Blender, by test_window.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import story

TIME_MAP = 5  # the entry in the menu of regions
# Where they stand in the sidebar, in pixels below its upper edge.
RAMP, ROTATION = 527, 680


def told():
    yield from story.opened()
    yield from driver.edge_moved(driver.area_of("SEQUENCE_EDITOR", "SEQUENCER"), 0, -296)
    yield from story.movie_added()
    yield from story.effect_added()
    yield from story.seen("1_effect")
    yield from story.chosen_beside_draw(TIME_MAP)
    yield from driver.until(lambda: len(story.effect().regions), "the menu adds a time map")
    yield from story.seen("2_linear")
    bpy.context.window_manager.virtual_shutter.view = "COEFFICIENTS"
    yield from story.seen("2_linear_c")
    sb = story.sidebar()
    driver.saw(sb=[sb.x, sb.y, sb.width, sb.height])


if __name__ == "__main__":
    driver.play(told)
