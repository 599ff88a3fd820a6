"""An outline, by mouse: drawn around a walker at two frames, carried to those between, a layer, looked at, rendered."""

import bpy
import driver
import numpy as np
import one_stroke_story
import story
from driver import part
from one_stroke_story import FRAME, on_preview, region

SHOWN, SIZE = range(65, 78), (384, 288)
# Of the original's frames, of 768 × 576 pixels: the middle of a box around her, and half of its width and height.
DRAWN = {66: (377, 236), 74: (336, 229)}
HALF = 20, 44


def curve(frame):
    x, y = np.array(DRAWN[frame]) / (768, 576)
    angle = np.linspace(0, 2 * np.pi, 10, endpoint=False)
    return [(x + HALF[0] / 768 * np.cos(a), 1 - y + HALF[1] / 576 * np.sin(a)) for a in angle]


def outlined():
    for number, frame in enumerate(DRAWN):
        driver.edit().frame_set(frame)
        yield 0.5
        with driver.override("PREVIEW"):
            bpy.ops.shutter.draw("INVOKE_DEFAULT", True, new=number == 0, kind="OUTLINE")
        yield 0.5
        yield from driver.drag(story.preview(), [on_preview(*point) for point in curve(frame)])
        driver.pen_left()
        yield 0.5
    assert region().kind == "OUTLINE"
    drawings = story.effect().scene.annotation.layers[region().layer].frames
    driver.saw(drawings=sorted(drawing.frame_number for drawing in drawings if drawing.strokes))


def carried():
    """A straight outline stands in until it is."""
    carrying = part("features.outlines.blender.outline_carrying")
    driver.edit().frame_set(FRAME)
    yield from driver.until(lambda: carrying.progress() is not None, "it is carried", 20, wait=0.02)
    yield from driver.until(lambda: carrying.progress() is None, "it is there", 60)
    yield from story.seen("2_carried")
    yield from mended()
    region().is_layer = True
    yield from story.seen("3_layer")
    for view, name in (("COEFFICIENTS", "4_mattes"), ("RESULT", "5_result")):
        bpy.context.window_manager.virtual_shutter.view = view
        yield from story.seen(name)


def mended():
    """The carried curve is pulled up at her head, and let go again by Esc; then that is undone."""
    operators = part("features.outlines.blender.outline_operators")
    before = shapes()
    with driver.override("PREVIEW"):
        scene, effect, strip = part("blender.data.selection").active(bpy.context)
        curves = operators.shown_curves(scene, effect, strip, effect.active_region)
        assert operators.SHUTTER_GGT_outline.poll(bpy.context)
    x, y = on_preview(*max(curves[0], key=lambda point: point[1]))
    yield from driver.drag(story.preview(), [(x, y), (x, y + 6), (x, y + 12), (x, y + 25)])
    yield from driver.until(lambda: FRAME in shapes(), "its frame is a drawing")
    yield from story.seen("2_pulled")
    after = shapes()
    assert {frame: after[frame] for frame in before} == before
    driver.saw(pulled=max(y for _x, y in after[FRAME]) - max(y for _x, y in curves[0]))
    driver.key("ctrl+z")
    yield from driver.until(lambda: shapes() == before, "it is undone")
    yield from needed()


def shapes():
    """The first curve of each drawing, in fractions of the picture."""
    annotations, effect = part("blender.data.annotations"), story.effect()
    layer = annotations.layer_of(effect, region())
    width, height = annotations.picture_size(effect)
    found = {each.frame_number: annotations.strokes_of(each)[0].tolist() for each in layer.frames if each.strokes}
    return {frame: [(x / width + 0.5, y / height + 0.5) for x, y in points] for frame, points in found.items()}


def needed():
    """Next Drawing Needed carries what is lacking, and goes where both sides agree least, if they do not agree."""
    carrying = part("features.outlines.blender.outline_carrying")
    with driver.override("PREVIEW"):
        bpy.ops.shutter.outline_needed("INVOKE_DEFAULT")
    yield from driver.until(lambda: not is_carrying() and carrying.progress() is None, "all is carried", 90)
    driver.saw(needed=driver.edit().frame_current)
    driver.edit().frame_set(FRAME)
    yield 1.0


def is_carrying():
    return "SHUTTER_OT_outline_needed" in [operator.bl_idname for operator in bpy.context.window.modal_operators]


def steps():
    yield from one_stroke_story.begun(SHOWN, outlined, SIZE)
    yield from carried()
    yield from one_stroke_story.rendered(range(FRAME, FRAME + 1))
    yield from one_stroke_story.looked_at()
