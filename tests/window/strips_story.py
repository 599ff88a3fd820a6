"""Every strip has an effect of its own, and effects are given to other clips: cut by K, duplicated, copied and pasted
by keys, undone, done again, saved and opened. Run inside Blender, by test_tracked.py.

Pictures and facts go to SHUTTER_PICTURES."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]

import bpy
import driver
import story

CUT, LEFT, LATER = 70, story.FRAME, 300


def timeline():
    return driver.region_of(driver.area_of("SEQUENCE_EDITOR", "SEQUENCER"))


def strips(kind="SCENE"):
    found = (strip for strip in story.edit().sequence_editor.strips_all if strip.type == kind)
    return sorted(found, key=lambda strip: strip.left_handle)


def effect_of(strip):
    return next(effect for effect in story.edit().virtual_shutter.effects if effect.scene == strip.scene)


def clicked(strip):
    with driver.override("SEQUENCER"):
        bpy.ops.sequencer.view_all()
    yield 0.7
    x, y = timeline().view2d.view_to_region(
        (strip.left_handle + strip.right_handle) / 2, strip.channel + 0.3, clip=False
    )
    driver.click(timeline(), x, y)
    yield 0.7  # a pointer that moves on before Blender has the click drags the strip
    yield from driver.until(lambda: story.edit().sequence_editor.active_strip == strip, "the strip is active")


def done(name, count):
    """A step, after which so many effects are there."""
    yield from driver.until(
        lambda: len(story.edit().virtual_shutter.effects) == count, f"{name} leaves {count} effects"
    )
    assert len({strip.scene for strip in strips()}) == count
    yield 0.5
    driver.saw(step=name, facts=story.facts(), count=count)


def in_context_menu(*keys):
    """The last entry of the menu that a right click opens, or one that keys lead to from there."""
    driver.xdotool("click", 3)
    yield 1.5
    driver.key("End", *keys)
    yield 0.7
    driver.shot("_".join(("menu", *keys)))
    driver.key("Return")
    yield 0.7


def picture(name, frame):
    """Without a selected strip, whose frame Blender draws."""
    with driver.override("SEQUENCER"):
        bpy.ops.sequencer.select_all(action="DESELECT")
    story.edit().frame_set(frame)
    driver.move(story.preview(), story.preview().width / 2, story.preview().height + 12)
    yield 1.0
    yield from driver.shot_when_shown(name)
    driver.saw(picture=name, crop=story.crop())


def cut():
    story.edit().frame_set(CUT)
    yield from clicked(strips()[0])
    driver.move(timeline(), timeline().width * 0.9, timeline().height / 2)
    yield
    driver.key("k")
    yield from done("cut", 2)


def edited():
    """The bars of the right half, by mouse: those of the left one stay."""
    yield from clicked(strips()[1])
    before = story.facts()
    yield from driver.drag(story.preview(), [(50, 90), (90, 60), (140, 40)])
    yield from driver.until(lambda: story.facts() != before, "the bars change")
    left, right = ([bar.weight for s in effect_of(strip).shutters for bar in s.bars] for strip in strips())
    assert left != right
    yield from done("edited", 2)


def duplicated():
    yield from clicked(strips()[1])
    assert len([strip for strip in story.edit().sequence_editor.strips_all if strip.select]) == 2  # connected
    driver.key("shift+d")
    yield from driver.until(lambda: len(strips()) == 3, "Shift-D duplicates the pair")
    driver.shot("duplicating")
    driver.text("80")
    yield 0.3
    driver.key("Return")
    yield from done("duplicated", 3)


def pasted():
    yield from clicked(strips()[1])
    yield from in_context_menu("Up")
    movie = strips("MOVIE")[0]
    story.edit().sequence_editor.strips.new_movie("Other", movie.filepath, 1, LATER)
    bpy.ops.ed.undo_push(message="Add Movie")
    yield 0.5
    yield from done("added", 3)
    yield from clicked(strips("MOVIE")[-1])
    yield from in_context_menu()
    yield from done("pasted", 4)
    own = [[[bar.weight for bar in s.bars] for s in effect_of(strip).shutters] for strip in (strips()[1], strips()[-1])]
    assert own[0] == own[1]
    assert strips()[-1].left_handle == LATER


def back_and_forth():
    """All undone and done again."""
    steps = [entry for entry in driver.seen_so_far() if "step" in entry]
    for keys, order in (("ctrl+z", steps[-2::-1]), ("ctrl+shift+z", steps[1:])):
        for wanted in order:
            for _ in range(4):  # a click is a step of its own
                driver.move(timeline(), timeline().width / 2, timeline().height * 0.8)
                yield 0.2
                driver.key(keys)
                yield 0.7
                if story.facts() == wanted["facts"]:
                    break
            assert story.facts() == wanted["facts"], f"{keys} to {wanted['step']}:\n{story.facts()}\n{wanted['facts']}"
            assert len(bpy.data.scenes) == wanted["count"] + 1


def opened_again():
    path, before = str(driver.OUT / "strips.blend"), story.facts()
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    yield 1.5
    assert story.facts() == before


def told():
    yield from story.opened()
    yield from story.movie_added()
    yield from story.effect_added()
    yield from story.scribbled()
    yield from picture("left_before", LEFT)
    yield from picture("right_before", 90)
    yield from cut()
    yield from picture("left", LEFT)
    yield from picture("right", 90)
    story.edit().frame_set(90)
    yield from edited()
    yield from picture("left_edited", LEFT)
    yield from picture("right_edited", 90)
    yield from duplicated()
    yield from pasted()
    driver.shot("all")
    yield from back_and_forth()
    yield from opened_again()
    yield from picture("left_opened", LEFT)
    yield from picture("pasted", LATER + 40)


if __name__ == "__main__":
    driver.play(told)
