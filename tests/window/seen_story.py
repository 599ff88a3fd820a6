"""What is seen is what is edited, after a strip was cut, and nothing of an effect stays once it is deleted: by mouse
and keyboard. Run inside Blender, by test_tracked.py.

Pictures and facts go to SHUTTER_PICTURES."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]

import bpy
import driver
import story
from traces import NAME

CUT, GAP, RIGHT = 70, 80, 100  # the right half is moved from its cut by 20 frames
LEFT = story.FRAME


def timeline():
    return driver.region_of(driver.area_of("SEQUENCE_EDITOR", "SEQUENCER"))


def space():
    return driver.area_of("SEQUENCE_EDITOR", "PREVIEW").spaces.active


def halves():
    """The effect strips, from left to right."""
    return sorted(
        (s for s in story.edit().sequence_editor.strips_all if s.type == "SCENE"), key=lambda s: s.left_handle
    )


def effect_of(strip):
    return next(e for e in story.edit().virtual_shutter.effects if e.scene == strip.scene)


def bars_of(strip):
    return [[round(bar.weight, 4) for bar in shutter.bars] for shutter in effect_of(strip).shutters]


def strokes_of(strip):
    layers = strip.scene.annotation.layers
    return sum(len(frame.strokes) for layer in layers for frame in layer.frames)


def pointer_away():
    driver.move(story.preview(), story.preview().width / 2, story.preview().height + 12)
    yield 0.5


def seen(name):
    """Preview and tab as they are now."""
    yield from pointer_away()
    yield from driver.shot_when_shown(name)
    boxes = {}
    for part, region in (("preview", story.preview()), ("tab", story.sidebar())):
        left, bottom = driver.screen(region, 0, 0)
        boxes[part] = [left, bottom - region.height + 1, left + region.width, bottom + 1]
    annotation = space().annotation
    driver.saw(picture=name, **boxes, annotation=annotation.name if annotation else None)


def clicked(strip):
    """On the timeline, which makes it the active one."""
    view = timeline().view2d
    x, y = view.view_to_region((strip.left_handle + strip.right_handle) / 2, strip.channel + 0.3, clip=False)
    driver.click(timeline(), x, y)
    yield from driver.until(lambda: story.edit().sequence_editor.active_strip == strip, "the strip is active")


def drawn(*points):
    region = story.preview()
    yield from driver.drag(region, [(region.width * x, region.height * y) for x, y in points])


def cut():
    """K with the playhead on the strip, and the pointer behind it: the active one is the left half then, and the right
    half is seen and selected."""
    story.edit().frame_set(CUT)
    with driver.override("SEQUENCER"):
        bpy.ops.sequencer.view_all()
    yield 0.5
    driver.move(timeline(), timeline().width * 0.9, timeline().height / 2)
    yield
    driver.key("k")
    both = "K cuts the strip, and each half has an effect"
    yield from driver.until(lambda: len(halves()) == len(story.edit().virtual_shutter.effects) == 2, both)
    left, right = halves()
    assert story.edit().sequence_editor.active_strip == left
    with driver.override("PREVIEW"):
        assert sys.modules[f"{NAME}.shutter_addon.blender.data.selection"].active(bpy.context)[2] == right
    yield from seen("1_cut")


def moved():
    """The right half, which has an effect of its own, is moved away."""
    bpy.ops.ed.undo_push(message="before")
    yield from deselected()
    yield from clicked(halves()[1])
    driver.key("g")
    yield 0.3
    driver.text("20")
    yield 0.3
    driver.key("Return")
    yield from driver.until(lambda: halves()[1].left_handle == CUT + 20, "the half is moved")
    left, right = halves()
    assert (left.right_handle, right.left_handle) == (CUT, CUT + 20)


def edited():
    """The left half is selected; the playhead is on the right one, then on the left one, then between. Where none is
    selected, that is edited which is seen."""
    yield from clicked(halves()[0])
    yield from story.moved_to(LEFT)
    yield from seen("2_left")
    yield from story.moved_to(RIGHT)
    left, right = halves()
    assert story.edit().sequence_editor.active_strip == left
    before = bars_of(left), bars_of(right)
    yield from drawn_bars()
    left, right = halves()
    assert (bars_of(left), bars_of(right)) == before, "bars of a half that is not selected, or not seen, changed"
    yield from deselected()
    yield from drawn_bars()
    left, right = halves()
    assert (bars_of(left) == before[0], bars_of(right) == before[1]) == (True, False), "bars of another half changed"
    yield from seen("3_right")
    yield from clicked(halves()[0])
    yield from story.moved_to(LEFT)
    yield from seen("4_left_again")
    yield from story.moved_to(GAP)
    yield from seen("5_between")
    before = bars_of(left), bars_of(right)
    yield from drawn_bars()
    left, right = halves()
    assert (bars_of(left), bars_of(right)) == before, "bars that are not seen changed"
    with driver.override("PREVIEW"):
        assert not bpy.ops.shutter.draw.poll()


def deselected():
    with driver.override("SEQUENCER"):
        bpy.ops.sequencer.select_all(action="DESELECT")
    yield


def drawn_bars():
    yield from driver.drag(story.preview(), [(50, 90), (70, 60), (90, 30)])


def scribbled():
    """The pen draws on the half that is seen, scrubbed from one to the other."""
    yield from story.moved_to(RIGHT)
    yield from deselected()
    with driver.override("PREVIEW"):
        bpy.ops.shutter.draw("INVOKE_DEFAULT", True)
    yield 0.5
    for frame, index in ((RIGHT, 1), (LEFT, 0), (RIGHT, 1)):
        yield from story.moved_to(frame)
        before = [strokes_of(half) for half in halves()]
        yield from drawn((0.3, 0.7), (0.4, 0.75), (0.5, 0.7))
        after = [strokes_of(half) for half in halves()]
        assert after[index] == before[index] + 1, (frame, before, after)
        assert after[1 - index] == before[1 - index], (frame, before, after)
    with driver.override("PREVIEW"):
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")
    bpy.ops.ed.undo_push(message="drawn")
    yield


def counted():
    """How many there are of all that an effect needs."""
    return {name: len(getattr(bpy.data, name)) for name in ("scenes", "cameras", "objects", "annotations")}


def kept(name):
    """What a file has that is saved now."""
    path = str(driver.OUT / f"{name}.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    with bpy.data.libraries.load(path) as (found, _):
        return {kind: sorted(getattr(found, kind)) for kind in ("scenes", "cameras", "annotations")}


alone = {}  # what a file has without effects


def gone(name):
    """Nothing is left of any effect, in the picture, in Blender and in a file."""
    yield from driver.until(lambda: space().annotation is None, "the preview lets go of the scribbles")
    assert kept(name) == alone, kept(name)
    assert not story.edit().virtual_shutter.effects
    yield from seen(name)


def back(known, name):
    assert counted() == known, counted()
    assert space().annotation == halves()[0].scene.annotation
    yield from seen(name)


def pressed(keys, condition, what):
    driver.move(timeline(), timeline().width / 2, timeline().height / 2)
    yield
    driver.key(keys)
    yield from driver.until(condition, what)


def deleted():
    """By X, undo, redo, by a script, with its scene: each time nothing stays, and undo brings all of it back."""
    yield from story.moved_to(LEFT)
    with driver.override("SEQUENCER"):
        bpy.ops.sequencer.select_all(action="SELECT")
        for strip in story.edit().sequence_editor.strips_all:
            strip.select = strip.type == "SCENE"
    bpy.ops.ed.undo_push(message="selected")
    known = counted()
    yield from seen("6_before")
    for scene in [strip.scene for strip in halves()]:
        bpy.data.scenes.remove(scene)
    driver.area_of("SEQUENCE_EDITOR", "PREVIEW").tag_redraw()  # Blender does not by itself
    yield from gone("7_scene_removed")
    bpy.ops.ed.undo_push(message="scenes removed")
    yield from pressed("ctrl+z", lambda: halves()[0].scene is not None, "undo brings the scenes back")
    yield from back(known, "8_undone_scene")
    yield from pressed("x", lambda: not halves(), "X deletes the strips")
    yield from gone("7_deleted")
    yield from pressed("ctrl+z", lambda: len(halves()) == 2, "undo brings them back")
    yield from back(known, "8_undone")
    yield from pressed("ctrl+shift+z", lambda: not halves(), "redo deletes them")
    yield from gone("7_redone")
    yield from pressed("ctrl+z", lambda: len(halves()) == 2, "undo brings them back")
    yield from back(known, "8_undone_again")
    for strip in halves():
        story.edit().sequence_editor.strips.remove(strip)
    assert kept("script") == alone, kept("script")  # at once, in the same step
    yield from gone("7_removed_by_script")
    bpy.ops.ed.undo_push(message="removed")
    yield from pressed("ctrl+z", lambda: len(halves()) == 2, "undo brings them back")
    yield from back(known, "8_undone_removal")
    for strip in halves():
        story.edit().sequence_editor.strips.remove(strip)
    yield 0.5
    # What nobody's mend can have left there.
    space().annotation = None
    yield from seen("9_plain")


def other_edit():
    """An edit that has no effect shows no scribbles; the first one has them again. What the user drew stays."""
    first, name = story.edit(), space().annotation.name
    other = bpy.data.scenes.new("Other")
    other.sequence_editor_create()
    bpy.context.workspace.sequencer_scene = other
    yield from driver.until(lambda: space().annotation is None, "the other edit shows no scribbles")
    own = space().annotation = bpy.data.annotations.new("Shutter of mine")
    yield 1.0
    assert space().annotation == own
    bpy.context.workspace.sequencer_scene = first
    yield 1.0
    assert space().annotation == own
    space().annotation = first.virtual_shutter.effects[0].scene.annotation
    bpy.data.annotations.remove(own)
    bpy.data.scenes.remove(other)
    yield 0.5
    assert space().annotation.name == name


def told():
    yield from story.opened()
    yield from story.movie_added()
    alone.update(kept("alone"))
    yield from story.effect_added()
    yield from story.scribbled()
    yield from cut()
    yield from moved()
    yield from edited()
    yield from scribbled()
    yield from other_edit()
    yield from deleted()


if __name__ == "__main__":
    driver.play(told)
