"""Footage is sped up by Blender's own retiming, looks jerky, and gets a camera's blur by Length: Timeline. Run inside
Blender, by test_tracked.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import one_stroke_story
import story

SPEED, FRAME, WINDOW = 8, 5, 16


def nothing_drawn():
    yield


def retimed():
    """By Set Speed of the retiming keys, as an editor does."""
    editor = story.edit().sequence_editor
    source = next(strip for strip in editor.strips_all if strip.type == "MOVIE")
    editor.active_strip = source
    for strip in editor.strips_all:
        strip.select = strip == source
    with driver.override("SEQUENCER"):
        bpy.ops.sequencer.retiming_segment_speed_set(speed=100.0 * SPEED)
    yield 1.0
    driver.saw(length=source.right_handle - source.left_handle)


def shown(name, length):
    effect = story.effect()
    effect.shutters[0].length = length
    yield from story.seen(name)


def told():
    yield from one_stroke_story.begun(range(1, 81), nothing_drawn)
    effect = story.effect()
    effect.inbetween, effect.window, effect.position, effect.border = "1", WINDOW, "START", True
    while len(effect.shutters) > 1:
        effect.active_shutter = 1
        with driver.override("PREVIEW"):
            bpy.ops.shutter.shutter_remove()
    yield from retimed()
    story.edit().frame_set(FRAME)
    yield 1.0
    for index, bar in enumerate(story.effect().shutters[0].bars):
        bar.weight = float(index == 0)
    yield from shown("1_sharp", "FRAMES")
    for index, bar in enumerate(story.effect().shutters[0].bars):
        bar.weight = float(index < WINDOW // 2)
    yield from shown("2_timeline", "TIMELINE")
    yield from one_stroke_story.rendered(range(FRAME, FRAME + 1))
    yield from one_stroke_story.looked_at()


if __name__ == "__main__":
    driver.play(told)
