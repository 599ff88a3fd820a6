"""An outline: drawn around a walker at two frames, carried to those between, a layer, looked at in Mattes, rendered, by
mouse. Run inside Blender, by test_tracked.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]

import bpy
import driver
import numpy as np
import one_stroke_story
import story
from one_stroke_story import FRAME, on_preview, part, region

SHOWN = range(55, 86)
# Of the footage's frames, in pixels: the middle of a box around her, and half of its width and height.
DRAWN = {62: (397, 239), 78: (316, 226)}
HALF = 20, 44


def curve(frame):
    """In fractions of the picture."""
    x, y = np.array(DRAWN[frame]) / (768, 576)
    angle = np.linspace(0, 2 * np.pi, 14, endpoint=False)
    return [(x + HALF[0] / 768 * np.cos(a), 1 - y + HALF[1] / 576 * np.sin(a)) for a in angle]


def outlined():
    """The first curve makes the region, the second one its next drawing."""
    for number, frame in enumerate(DRAWN):
        story.edit().frame_set(frame)
        yield 0.5
        with driver.override("PREVIEW"):
            bpy.ops.shutter.draw("INVOKE_DEFAULT", True, new=number == 0, kind="OUTLINE")
        yield 0.5
        yield from driver.drag(story.preview(), [on_preview(*point) for point in curve(frame)])
        with driver.override("PREVIEW"):
            bpy.ops.wm.tool_set_by_id(name="builtin.select_box")
        yield 0.5
    assert region().kind == "OUTLINE"
    drawings = story.effect().scene.annotation.layers[region().layer].frames
    driver.saw(drawings=sorted(drawing.frame_number for drawing in drawings if drawing.strokes))


def carried():
    """A straight outline stands in until it is."""
    carrying = part("blender.rendering.outline_carrying")
    story.edit().frame_set(FRAME)
    yield from driver.until(lambda: carrying.progress() is not None, "it is carried", 20, wait=0.02)
    yield from driver.until(lambda: carrying.progress() is None, "it is there", 60)
    yield from story.seen("2_carried")
    region().is_layer = True
    yield from story.seen("3_layer")
    for view, name in (("COEFFICIENTS", "4_mattes"), ("RESULT", "5_result")):
        bpy.context.window_manager.virtual_shutter.view = view
        yield from story.seen(name)


def told():
    yield from one_stroke_story.begun(SHOWN, outlined)
    yield from carried()
    yield from one_stroke_story.rendered(range(FRAME, FRAME + 1))
    yield from one_stroke_story.looked_at()


if __name__ == "__main__":
    driver.play(told)
