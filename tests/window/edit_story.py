"""An edit as editors make them, by mouse and keys: three clips, two of them retimed, an effect on each, one of these
pasted, a dissolve, cuts, colours, a title; undone and redone, saved, opened again, and rendered. Run inside Blender, by
test_edit.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import subprocess
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]

import bpy
import driver
import first_stroke_story
import one_stroke_story
import story
import traces
from first_stroke_story import timeline

SIZE, LAST = (320, 180), 117
ACROSS = (0.4, 0.56), (0.45, 0.565), (0.55, 0.565), (0.65, 0.56)  # where people walk in street.mp4 and walkers.mp4
CLIPS = {"bunny.mp4": (1, 1), "street.mp4": (33, 3), "walkers.mp4": (73, 1)}  # first frame, channel
SHARP = (0.47, 0.565), (0.54, 0.565)  # within the stroke, also where it is pasted, onto a narrower clip
STROKES = {"bunny.mp4": (12, ACROSS), "street.mp4": (50, ACROSS)}  # at which frame, in fractions of the picture
TITLE = 62, 6.5
KEYED, SLOWED = 88, 6  # where walkers.mp4 gets a retiming key, and by how many frames that is moved


def strips():
    return story.edit().sequence_editor.strips_all


def strip(name):
    return strips()[name]


def at(frame, channel):
    """Pixels of the timeline's region."""
    return timeline().view2d.view_to_region(frame, channel, clip=False)


def clicked(*chosen, alone=False):
    """On strips of the timeline, the second one with Shift; alone: without those that are connected with them."""
    for number, one in enumerate(chosen):
        place = at((one.left_handle + one.right_handle) / 2, one.channel + 0.25)
        yield from driver.drag(timeline(), [place], [*["alt"] * alone, *["shift"] * (number > 0)])
    assert story.edit().sequence_editor.active_strip == chosen[-1]
    assert {one for one in strips() if one.select} >= set(chosen)


def pressed(keys, condition, what):
    driver.key(keys)
    yield from driver.until(condition, what)
    yield 0.3


def moved(frames):
    """What is selected."""
    driver.key("g")
    yield 0.3
    driver.text(frames)
    yield 0.3
    driver.key("Return")
    yield 0.5


def added():
    yield from first_stroke_story.footage_chosen()
    for number, (name, place) in enumerate(CLIPS.items()):
        yield from first_stroke_story.movie_dragged(number, *place)
        assert (strip(name).left_handle, strip(name).channel) == place
    driver.shot("1_added")


def sped_up():
    """By Set Speed, whose dialog lies beside the pointer."""
    street = strip("street.mp4")
    yield from clicked(street)
    driver.key("r")
    yield 0.5
    driver.xdotool("mousemove_relative", "--", 220, 48)
    yield 0.3
    driver.xdotool("click", "--repeat", 2, "--delay", 60, 1)
    yield 0.3
    driver.key("ctrl+a")
    driver.text("125")
    driver.shot("2_speed")
    yield from pressed("Return", lambda: street.right_handle == 65, "the clip is as much shorter")
    driver.xdotool("mousemove_relative", "--", -180, -40)  # off the field, which Return edits
    yield 0.3
    driver.key("Return")
    yield 0.5


def chosen(one, words, condition):
    """In the menu of a strip, by typing."""
    yield from clicked(one, alone=True)
    driver.xdotool("click", 3)
    yield 0.7
    driver.key("space")
    yield 0.4
    driver.text(words)
    yield 0.5
    yield from pressed("Return", condition, f'"{words}" is chosen and done')


def effects():
    return story.edit().virtual_shutter.effects


def drawn(name):
    frame, points = STROKES[name]
    count = len(effects())
    yield from story.moved_to(frame)
    yield from chosen(strip(name), "draw shutter", lambda: len(effects()) > count)
    yield 0.5
    yield from driver.drag(story.preview(), [one_stroke_story.on_preview(*point) for point in points])
    yield 1.0
    assert [len(each.regions) for each in effects()] == [1] * (count + 1)
    driver.shot(f"3_{name}")


def dissolved():
    """Between two effects alone: with Alt, or what is connected with them were chosen, too."""
    yield from clicked(strip("Shutter"), strip("Shutter.001"), alone=True)
    yield from entry_added("gamma", "GAMMA_CROSS")


def entry_added(words, kind):
    """By the Add menu, found by typing."""
    driver.key("shift+a")
    yield 0.5
    driver.text(words)
    yield 0.6
    yield from pressed("Return", lambda: kind in {one.type for one in strips()}, f"the menu adds {kind}")


def keyed():
    """A retiming key, moved: slower before it, faster after it."""
    walkers = strip("walkers.mp4")
    yield from story.moved_to(KEYED)
    yield from clicked(walkers)
    driver.key("ctrl+r")
    yield 0.4
    driver.key("i")
    yield 0.5
    yield from pressed("Return", lambda: len(walkers.retiming_keys) == 3, "there is a key")
    driver.click(timeline(), *at(KEYED, walkers.channel + 0.17))
    yield 0.4
    before = walkers.retiming_keys[1].timeline_frame
    yield from moved(SLOWED)
    assert walkers.retiming_keys[1].timeline_frame == before + SLOWED
    driver.shot("4_keyed")
    driver.key("ctrl+r")
    yield 0.4


def cut(name, frame):
    yield from story.moved_to(frame)
    yield from clicked(strip(name))
    count = len(strips())
    yield from pressed("k", lambda: len(strips()) > count, "K cuts")


def titled():
    driver.move(timeline(), *at(*TITLE))
    yield 0.3
    yield from entry_added("text", "TEXT")
    driver.key("Return")  # it hangs on the pointer
    yield 0.5


def colored():
    """The first clip's effect."""
    effect = strip("Shutter")
    yield from story.moved_to(20)
    yield from chosen(effect, "color balance", lambda: len(effect.modifiers))
    effect.modifiers[0].color_balance.gain = 1.2, 1.0, 0.8
    bpy.ops.ed.undo_push(message="Gain")


def pasted():
    """The first clip's effect onto the third clip, whose second half is moved with it."""
    undelete, count = one_stroke_story.part("blender.editing.undelete"), len(effects())
    yield from chosen(strip("Shutter"), "copy effect", undelete.has_copy)
    yield from story.moved_to(95)
    half = strip("walkers.mp4.001")
    yield from chosen(half, "paste effect", lambda: len(effects()) > count)
    yield from clicked(strip("Shutter.003"))
    yield from moved(4)
    assert (
        [(half.left_handle, half.right_handle)]
        == [(86, LAST)]
        == [(one.left_handle, one.right_handle) for one in strips() if one.name == "Shutter.003"]
    )


def undone_and_redone(count=10):
    before = story.facts()
    yield from story.seen("6_before")
    for keys in ("ctrl+z", "ctrl+shift+z"):
        driver.move(timeline(), *at(150, 3))
        for _ in range(count):
            driver.key(keys)
            yield 0.4
        assert (story.facts() == before) == (keys != "ctrl+z"), f"{keys}:\n{story.facts()}\n{before}"
    yield from story.seen("7_redone")


def saved_and_opened():
    before = story.facts()
    driver.move(timeline(), *at(150, 3))
    yield from pressed("ctrl+s", lambda: not bpy.data.is_dirty, "it is saved")
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)
    yield 1.0
    assert story.facts() == before
    story.edit().frame_set(95)
    yield from story.seen("8_opened")


def rendered_without_a_window():
    """As it is, and without effects, by the same Blender."""
    plain = "import bpy\nfor strip in bpy.data.scenes['Edit'].sequence_editor.strips_all:\n  "
    plain += "strip.mute |= strip.type in ('SCENE', 'GAMMA_CROSS')"
    options = "--factory-startup", "--addons", traces.NAME, "-b", bpy.data.filepath, "-S", "Edit", "-F", "PNG"
    films = "-o", driver.OUT / "headless_", "-a", "--python-expr", plain, "-o", driver.OUT / "plain_", "-a"
    with (driver.OUT / "headless.txt").open("w") as said:
        process = subprocess.Popen(map(str, (bpy.app.binary_path, *options, *films)), stdout=said, stderr=said)
        yield from driver.until(lambda: process.poll() is not None, "the renders without a window end", 120)
    assert process.returncode == 0


def told():
    yield from first_stroke_story.edit_opened(*SIZE)
    # Each frame is rendered: what Blender reads of a retimed movie depends on the frame before.
    story.edit().frame_end = LAST - 1
    bpy.ops.wm.save_as_mainfile(filepath=str(driver.OUT / "edit.blend"))
    yield from added()
    yield from sped_up()
    for name in STROKES:
        yield from drawn(name)
    yield from dissolved()
    yield from keyed()
    yield from cut("walkers.mp4", 82)
    yield from cut("Shutter.001", 52)
    assert len(effects()) == 3, "each half has an effect of its own"
    yield from titled()
    yield from colored()
    yield from pasted()
    yield from undone_and_redone()
    yield from saved_and_opened()
    yield from first_stroke_story.film_rendered()
    yield from rendered_without_a_window()
    shown = [(one.left_handle, one.right_handle, one.name) for one in strips() if one.type == "SCENE"]
    driver.saw(effects=sorted(shown), sharp=SHARP)


if __name__ == "__main__":
    driver.play(told)
