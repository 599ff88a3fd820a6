"""A layer: one stroke, tracked, Sharp Subject, looked at in Holes, undone and redone, played, rendered, by mouse. Run
inside Blender, by test_tracked.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import one_stroke_story
import story
from one_stroke_story import FRAME, PRESETS, sidebar
from panning_story import played

SHOWN = range(60, 82)


def clicked():
    """One click makes it, one undo takes it back."""
    driver.click(sidebar(), sidebar().width * 0.2, sidebar().height - PRESETS)
    yield from driver.until(lambda: one_stroke_story.region().is_layer, "the region is a layer", 20)
    driver.saw(bars={s.name: [round(bar.weight, 3) for bar in s.bars] for s in story.effect().shutters})
    yield from story.seen("3_layer")
    driver.move(story.preview(), 50, story.preview().height - 50)
    yield
    driver.key("ctrl+z")
    yield from driver.until(lambda: not one_stroke_story.region().is_layer, "one undo takes it back")
    yield from story.seen("4_undone")
    driver.key("ctrl+shift+z")
    yield from driver.until(lambda: one_stroke_story.region().is_layer, "and redo brings it again")
    yield from story.seen("5_again")


def holes():
    bpy.context.window_manager.virtual_shutter.view = "HOLES"
    yield from story.seen("6_holes")
    bpy.context.window_manager.virtual_shutter.view = "COEFFICIENTS"
    yield from story.seen("6_mattes")
    bpy.context.window_manager.virtual_shutter.view = "RESULT"
    yield


def told():
    yield from one_stroke_story.begun(SHOWN)
    yield from one_stroke_story.tracked()
    yield from one_stroke_story.ended()
    yield from story.seen("2_tracked")
    yield from clicked()
    yield from holes()
    yield from played()
    yield from one_stroke_story.rendered(range(FRAME, FRAME + 1))
    yield from one_stroke_story.looked_at()


if __name__ == "__main__":
    driver.play(told)
