"""From an empty Video Editing file to a film of a sharp player before a blurred court: three outlines, carried, one
mended, a layer, rendered, by mouse and keyboard; every action is counted. Run inside Blender, by test_tracked.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import json
import os
import sys
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import first_stroke_story
import numpy as np
import story
from first_stroke_story import acted, gone_to, on_preview
from one_stroke_story import PRESETS, part, region, sidebar

# By frame of the movie, curves in fractions of the picture around the player; and at which frames they are drawn.
TRUTH = {int(frame): curves for frame, curves in json.loads(Path(os.environ["SHUTTER_TRUTH"]).read_text()).items()}
DRAWN = 1, 21, 41
SIZE = 448, 256
# Where they stand in the sidebar, in pixels below its upper edge.
BESIDE_DRAW, NEXT_NEEDED = 168, 381


def begun():
    """The menu beside Draw has an entry for it, which makes the empty region that Draw Shutter made an outline."""
    driver.click(sidebar(), sidebar().width * 0.87, sidebar().height - BESIDE_DRAW)
    acted("click on the menu beside Draw", in_tab=True)
    yield 0.8
    driver.shot("1_menu")
    driver.key("Down", "Return")
    acted("Draw Outline is chosen", in_tab=True)
    yield from driver.until(lambda: region().kind == "OUTLINE", "it is an outline")
    assert len(story.effect().regions) == 1


def drawn():
    for frame in DRAWN:
        if frame != frame_shown():
            yield from gone_to(frame)
        for curve in TRUTH[frame]:
            yield from driver.drag(story.preview(), on_preview(*curve), hold=("d",))
            acted(f"a curve is drawn at frame {frame}")
        driver.shot(f"2_drawn_{frame:03d}")
    drawings = story.effect().scene.annotation.layers[region().layer].frames
    assert len([drawing for drawing in drawings if drawing.strokes]) == len(DRAWN)


def carried():
    """Next Drawing Needed carries the outline, and goes to the frame that is mended."""
    carrying = part("blender.rendering.outline_carrying")
    started = time.monotonic()
    driver.click(sidebar(), sidebar().width * 0.7, sidebar().height - NEXT_NEEDED)
    acted("click on Next Drawing Needed", in_tab=True)
    yield from driver.until(lambda: is_carrying() or carrying.progress() is not None, "it is carried", 20, wait=0.02)
    yield from driver.until(lambda: not is_carrying() and carrying.progress() is None, "all is carried", 120)
    driver.saw(carried=time.monotonic() - started, needed=frame_shown())
    tool = bpy.context.workspace.tools.from_space_sequencer("PREVIEW", create=False)
    assert tool.idname.startswith("builtin.select"), tool.idname
    yield from story.seen("3_carried")


def mended():
    """The carried curve is pulled where it is farthest from the player."""
    frame = frame_shown()
    assert frame not in DRAWN
    shown, true = (np.concatenate(curves) * SIZE for curves in (shown_curves(), TRUTH[frame]))
    apart = np.hypot(*(shown[:, None] - true).transpose(2, 0, 1))
    worst = int(apart.min(axis=1).argmax())
    start, end = on_preview(shown[worst] / SIZE, true[apart[worst].argmin()] / SIZE)
    driver.saw(pulled=float(apart[worst].min()))
    steps = [np.array(start) + (np.array(end) - start) * share for share in (0, 0.3, 0.6, 1)]
    yield from driver.drag(story.preview(), steps)
    acted("the curve is pulled")
    drawings = story.effect().scene.annotation.layers[region().layer].frames
    yield from driver.until(lambda: len(drawings) > len(DRAWN), "its frame is a drawing")
    yield from story.seen("4_mended")


def is_carrying():
    return "SHUTTER_OT_outline_needed" in [operator.bl_idname for operator in bpy.context.window.modal_operators]


def frame_shown():
    """Of the movie, 1 is its first."""
    movie = next(strip for strip in story.edit().sequence_editor.strips_all if strip.type == "MOVIE")
    return int(story.edit().frame_current - movie.content_start + 1)


def shown_curves():
    with driver.override("PREVIEW"):
        scene, effect, strip = part("blender.data.selection").active(bpy.context)
        return part("blender.editing.outline_drawings").shown_curves(scene, effect, strip, effect.active_region)


def layered():
    driver.click(sidebar(), sidebar().width * 0.2, sidebar().height - PRESETS)
    acted("click on Sharp Subject", in_tab=True)
    yield from driver.until(lambda: region().is_layer, "the region is a layer", 20)
    yield from story.seen("5_layer")


def told():
    yield from driver.video_editing_opened()
    started = time.monotonic()
    edit = bpy.data.scenes[0]
    edit.name = "Edit"
    edit.render.resolution_x, edit.render.resolution_y = SIZE
    edit.render.dither_intensity = 0
    edit.frame_end = len(TRUTH)
    edit.view_settings.view_transform = "Standard"
    bpy.context.preferences.view.smooth_view = 0
    yield from first_stroke_story.footage_chosen()
    yield from first_stroke_story.movie_dragged()
    yield from gone_to(DRAWN[0])
    yield from first_stroke_story.drawing_begun()
    yield from begun()
    yield from drawn()
    yield from carried()
    yield from mended()
    yield from layered()
    yield from first_stroke_story.film_rendered()
    driver.saw(actions=first_stroke_story.actions(), seconds=time.monotonic() - started)
    driver.saw(before=story.edit().frame_current - frame_shown())


if __name__ == "__main__":
    driver.play(told)
