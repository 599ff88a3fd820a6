"""A panning shot of what a still camera took: one stroke, Track, Panning Shot, played, a bar dragged, rendered, by
mouse. Run inside Blender, by test_tracked.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import one_stroke_story
import story
from one_stroke_story import FRAME, PRESETS, sidebar

SHOWN = range(60, 82)


def shutters():
    """Of each its name, what it follows, and its bars."""
    return [
        (s.name, s.follow, s.follow_region, [round(bar.weight, 3) for bar in s.bars]) for s in story.effect().shutters
    ]


def clicked():
    """The button in the sidebar."""
    driver.click(sidebar(), sidebar().width * 0.45, sidebar().height - PRESETS)


def escaped():
    """Where nothing was tracked yet, the button tracks: what is tracked until Esc stays, and the shutters are as they
    were."""
    before = shutters()
    clicked()
    yield from driver.until(lambda: story.edit().frame_current != FRAME, "frames are tracked", wait=0.02)
    driver.key("Escape")
    yield from driver.until(lambda: len(one_stroke_story.kinds()) > 1, "tracking keys the region")
    driver.move(story.preview(), 50, story.preview().height - 50)
    yield 1.0
    assert not bpy.context.window.modal_operators
    assert shutters() == before
    driver.saw(escaped=one_stroke_story.kinds())


def panned():
    """One undo takes all of it back."""
    before = shutters()
    clicked()
    yield from driver.until(lambda: shutters() != before, "the shutters change")
    after = shutters()
    shutter = story.effect().shutters[0]
    driver.saw(panned=after, way=[shutter.follow_motion, shutter.follow_smooth])
    yield from story.seen("3_panning")
    driver.move(story.preview(), 50, story.preview().height - 50)
    yield
    driver.key("ctrl+z")
    yield from driver.until(lambda: shutters() == before, "one undo takes it back")
    driver.key("ctrl+shift+z")
    yield from driver.until(lambda: shutters() == after, "and redo brings it again")


def played():
    shown = set()
    with driver.override("PREVIEW"):
        bpy.ops.screen.animation_play()
    yield from driver.until(lambda: shown.add(story.edit().frame_current) or len(shown) > 4, "frames follow", 30)
    with driver.override("PREVIEW"):
        bpy.ops.screen.animation_cancel(restore_frame=False)
    driver.shot("4_played")
    story.edit().frame_set(FRAME)
    yield


def told():
    yield from one_stroke_story.begun(SHOWN)
    yield from escaped()
    yield from one_stroke_story.tracked()
    yield from one_stroke_story.ended()
    yield from story.seen("2_tracked")
    yield from panned()
    yield from played()
    yield from story.seen("5_back")
    story.effect().active_shutter = 0  # that of all else: the subject stays sharp
    before = shutters()
    yield from driver.drag(story.preview(), [(50, 90), (90, 40), (140, 30)])
    assert shutters() != before, "the bars did not change"
    yield from story.seen("6_bars")
    yield from one_stroke_story.rendered(range(FRAME, FRAME + 1))


if __name__ == "__main__":
    driver.play(told)
