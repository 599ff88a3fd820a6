"""The first minute with a player who runs and turns: one stroke, tracked, dragged right where it is wrong, tracked
again, a sharp subject, and longer trails. A film of each. Run inside Blender, by test_edit.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import json
import os
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import first_stroke_story
import numpy as np
import one_stroke_story
import story
from first_stroke_story import gone_to, on_preview
from one_stroke_story import PRESETS, part, region, sidebar

# Where his shirt is at each frame of the movie, 1 is its first; in fractions of the picture.
TRUTH = {int(frame): point for frame, point in json.loads(Path(os.environ["SHUTTER_TRUTH"]).read_text()).items()}
SIZE, STEP = (448, 256), 4
DRAWN = 58
FRAMES = 574  # where it stands in the sidebar, in pixels below its upper edge


def drawn():
    """Down his shirt."""
    x, y = TRUTH[DRAWN]
    points = [(x, y + 0.05), (x, y + 0.025), (x, y), (x, y - 0.05)]
    yield from driver.drag(story.preview(), on_preview(*points))
    yield from driver.until(lambda: first_stroke_story.channel() == 0, "the stroke gives the result back")
    yield from story.seen("1_drawn")


def film(name):
    yield from first_stroke_story.film_rendered(name)
    driver.saw(window=story.effect().window)


def tracked():
    yield from one_stroke_story.tracked()
    yield from one_stroke_story.ended()
    yield 1.0


def apart(frame):
    """How far the stroke is from where it was drawn on him, in fractions of the picture."""
    place = np.array(one_stroke_story.stroke_at(frame)) - TRUTH[frame]
    return place - (np.array(one_stroke_story.stroke_at(DRAWN)) - TRUTH[DRAWN])


def dragged_right():
    """By its handle, where it is farthest from him."""
    wrong = max(range(5, len(TRUTH) - 4), key=lambda frame: np.hypot(*apart(frame) * SIZE))
    driver.saw(wrong=wrong)
    yield from gone_to(wrong)
    yield from story.seen("2_wrong")
    with driver.override("PREVIEW"):
        place = part("blender.interface.region_gizmo").place(bpy.context)
    (x, y), zero = place.centre, on_preview((0, 0), apart(wrong))
    right, up = np.array(zero[0]) - zero[1]
    before = story.facts()
    yield from driver.drag(story.preview(), [(x + share * right, y + share * up) for share in (0, 0.3, 0.6, 1)])
    kinds = one_stroke_story.kinds
    yield from driver.until(lambda: kinds().get(wrong) == "KEYFRAME", "the handle keys the region")
    assert len(region_strokes()) == 1, "nothing is drawn"
    assert story.facts() != before
    assert np.hypot(*apart(wrong) * SIZE) < 2
    yield from story.seen("3_dragged")


def region_strokes():
    frames = story.effect().scene.annotation.layers[region().layer].frames
    return [stroke for frame in frames for stroke in frame.strokes]


def layered():
    driver.click(sidebar(), sidebar().width * 0.2, sidebar().height - PRESETS)
    yield from driver.until(lambda: region().is_layer, "the region is a layer", 20)
    yield from story.seen("4_layer")


def lengthened(frames=24):
    driver.click(sidebar(), sidebar().width * 0.7, sidebar().height - FRAMES, 2)
    yield 0.5
    driver.key("ctrl+a")
    driver.text(frames)
    driver.key("Return")
    yield from driver.until(lambda: story.effect().window == frames, "there are more frames")
    yield from story.seen("5_longer")


def told():
    yield from first_stroke_story.edit_opened(*SIZE)
    story.edit().frame_end, story.edit().frame_step = len(TRUTH), STEP
    yield from first_stroke_story.footage_chosen()
    yield from first_stroke_story.movie_dragged()
    yield from gone_to(DRAWN)
    yield from first_stroke_story.drawing_begun()
    yield from drawn()
    yield from one_stroke_story.roomier()
    yield from tracked()
    yield from film("tracked")
    yield from dragged_right()
    yield from tracked()
    yield from film("mended")
    yield from layered()
    yield from film("layer")
    yield from lengthened()
    yield from film("longer")


if __name__ == "__main__":
    driver.play(told)
