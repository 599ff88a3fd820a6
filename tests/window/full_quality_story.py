"""One look at a frame as it will be rendered, by *Full Quality*, and back: by a click, another frame, a change."""

import sys
from functools import partial

import bpy
import driver
import preview_sizes_story as sizes
import story

FRAME = 50


def interface(name):
    return driver.part(f"blender.interface.{name}")


def clicked():
    with driver.override("PREVIEW"):
        bpy.ops.shutter.full_quality()
    yield 0.5


def view():
    rows, centre = interface("full_quality")._view_of(story.preview())  # as the operator measures it
    return [rows, *centre]


def middle():
    """The picture's, on the screen."""
    region = story.preview()
    left, bottom = driver.screen(region, *region.view2d.view_to_region(0, 0, clip=False))
    return [left, bottom + 1]


shown = partial(story.seen, composed=sizes.composed, view=view, middle=middle)


def prepared():
    yield from story.opened(320, 180)
    yield from story.movie_added()
    driver.edit().frame_set(FRAME)
    yield from sizes.effect_added()
    story.effect().edge_aware, story.effect().aggregate = 1.0, "4"
    space = sizes.space()
    space.proxy_render_size = "PROXY_50"
    space.show_gizmo = space.show_overlays = True
    for layer in story.effect().scene.annotation.layers:
        layer.annotation_hide = True
    yield 1.0


def looked():
    yield from shown("before")
    yield from clicked()
    full = [[320, 180]]
    yield from driver.until(lambda: sizes.composed() == full, "it is composed in full", 20)
    yield from shown("full")
    yield from clicked()
    yield from shown("back")
    yield from clicked()
    yield from driver.until(lambda: sizes.composed() == full, "it is composed in full", 20)
    driver.key("Right")
    yield from driver.until(lambda: driver.edit().frame_current == FRAME + 1, "the next frame is shown")
    yield from shown("next")
    driver.key("Left")
    yield from driver.until(lambda: driver.edit().frame_current == FRAME, "the frame is shown")
    yield from clicked()
    yield from driver.until(lambda: sizes.composed() == full, "it is composed in full", 20)
    story.effect().edge_aware = 0.0
    yield from shown("changed")
    story.effect().edge_aware = 1.0


def composed_late():
    """Whatever takes too long, a note says so before it is done, and the playhead moves: what our handler draws, and
    then what the engine is asked for."""
    previews, preview, said = sys.modules[driver.PREVIEWS], interface("preview"), []
    name = driver.PREVIEWS
    drawn, first = preview.draw_notes, previews._SLICE  # on a quick machine nothing would be late
    preview.draw_notes = lambda region, notes: said.append(notes) or drawn(region, notes)
    driver.PREVIEWS = ""  # whose pictures it waits for
    for step, frame in (("late_drawn", FRAME + 20), ("late_engine", FRAME + 10)):
        previews._SLICE = 0.0  # nothing is done in time
        driver.edit().frame_set(frame)
        said.clear()
        yield from driver.until(lambda: late(said), "it says that it composes")
        if step == "late_engine":
            yield from clicked()
            said.clear()
            yield from driver.until(lambda: late(said), "it says so in full quality")
            assert previews.looking.whole.key is not None
        assert previews.looking.slices.last is not None
        driver.shot(step)
        driver.move(story.preview(), 50, 50)
        driver.key("Right")
        yield from driver.until(lambda frame=frame: driver.edit().frame_current == frame + 1, "the playhead moves")
        yield from driver.until(lambda: late(said), "it says so of this frame as well")
        previews._SLICE = previews.looking.slices.seconds = first  # as it was
        yield from driver.until(lambda: not driver.composing(previews), "the picture comes", 60)
        yield from driver.until(lambda: not late(said), "nothing is late")
    driver.PREVIEWS, preview.draw_notes = name, drawn  # as they were
    driver.edit().frame_set(FRAME)


def late(said):
    """Whether what was drawn last is a note that the picture is composed."""
    return bool(said) and any(sentence.startswith("Composing") for sentence in said[-1])


def steps():
    yield from prepared()
    yield from composed_late()
    yield from looked()
    yield from story.rendered()
