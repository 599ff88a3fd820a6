"""A clip in which lines go far from frame to frame, dropped into an empty edit, and one stroke: then the preview is
watched, and nothing is clicked. Run inside Blender, by test_window.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import os
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]
sys.path.append(os.environ["SHUTTER_PACKAGES"])

import driver
import first_stroke_story
import story

FRAME, SIZE = 8, (640, 360)
STROKE = (0.45, 0.2), (0.5, 0.35), (0.55, 0.2)  # on the square that stands still


def stroke_drawn():
    points, region = first_stroke_story.on_preview(*STROKE), story.preview()
    driver.move(region, *points[0])
    yield
    driver.xdotool("mousedown", 1)
    yield
    for point in points[1:]:
        driver.move(region, *point)
        yield 0.1
    driver.xdotool("mouseup", 1)
    first_stroke_story.acted("the stroke is drawn")
    yield from driver.until(lambda: first_stroke_story.channel() == 0, "the stroke gives the result back")
    yield 1.0


def told():
    yield from first_stroke_story.edit_opened(*SIZE)
    yield from first_stroke_story.footage_chosen()
    yield from first_stroke_story.movie_dragged()
    yield from first_stroke_story.gone_to(FRAME)
    yield from first_stroke_story.drawing_begun()
    yield from stroke_drawn()
    driver.saw(clicks=first_stroke_story.actions(), smooth=story.effect().inbetween)
    yield from story.seen("2_smooth")
    movie = next(strip for strip in story.edit().sequence_editor.strips_all if strip.type == "MOVIE")
    driver.saw(frame=round(story.edit().frame_current - movie.content_start))
    yield from first_stroke_story.picture_rendered()
    story.effect().inbetween = "1"
    yield from story.seen("3_plain")


if __name__ == "__main__":
    driver.play(told)
