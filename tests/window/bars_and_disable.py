"""Bars painted between two keys, and the extension disabled while all of it is on the screen: a part of story.py, the
first one, as it compares with what Blender has without the extension."""

import addon_utils
import bpy
import driver
import numpy as np
import story
import traces
from driver import NAME, click, drag, edit, enable, key, move, override, part, pen_left, screen, shot


def bars():
    return part("blender.editing.bar_edits").bars_now(story.effect(), 0)


def paint(bar, weight):
    region = story.preview()
    editor = part("blender.interface.bar_editor")
    place = editor.layout(region.width, bars(), bpy.context.preferences.system.ui_scale)
    left, bottom, right, top = place.box
    x = left + (bar + 0.5) * (right - left) / place.count
    ys = [bottom + share * (top - bottom) for share in (0.1, weight / 2, weight)]
    yield from drag(region, [(x, y) for y in ys])
    yield 0.5


def painted_between_keys():
    """The other bars stay as they were shown; an undo brings all of them back."""
    editing, effect = part("blender.editing.bar_edits"), story.effect()
    effect.active_shutter = 0
    for frame, shown in ((1, np.eye(8)[0]), (9, np.eye(8)[7])):
        edit().frame_set(frame)
        editing.paint(effect, 0, shown, key=True)
    edit().frame_set(5)
    bpy.ops.ed.undo_push(message="Keys")
    yield 1.0
    assert np.allclose(bars(), [0, 0, 0, 0.5, 0.5, 0, 0, 0], atol=1e-6), bars()
    yield from paint(0, 0.75)
    assert np.allclose(bars()[1:], [0, 0, 0.5, 0.5, 0, 0, 0], atol=1e-6), bars()
    assert abs(bars()[0] - 0.75) < 0.05, bars()
    shot("painted")
    key("ctrl+z")
    yield 1.0
    assert np.allclose(bars(), [0, 0, 0, 0.5, 0.5, 0, 0, 0], atol=1e-6), bars()


def a_drawn_region_is_one_step():
    """Region, layer and tool by one call; one undo takes the region back."""
    with override("PREVIEW"):
        assert bpy.ops.shutter.draw("INVOKE_DEFAULT", True) == {"FINISHED"}
    yield 0.5
    assert len(story.effect().regions) == len(story.effect().scene.annotation.layers) == 1
    pen_left()
    move(story.preview(), 200, 200)
    yield
    key("ctrl+z")
    yield 1.0
    assert len(story.effect().regions) == len(story.effect().scene.annotation.layers) == 0


def probe_follows_the_pointer():
    """The probe shows the pixel under the pointer, keeps it while the pointer is elsewhere, and takes no click."""
    region = story.preview()
    live = bpy.context.window_manager.virtual_shutter
    before, live.probe = pixels("no probe"), True
    for x, y in ((region.width // 2, region.height * 2 // 5), (region.width * 3 // 5, region.height * 3 // 5)):
        for step in (8, 0):  # a pointer that rests tells nothing
            move(region, x + step, y)
            yield 0.5
        expected, pixel = on_picture(region, x + 0.5, y + 0.5)
        assert (np.abs(expected - live.probe_at) < pixel).all(), (tuple(live.probe_at), expected)
        left, top = screen(region, x + 60, y - 60)
        box = np.s_[top : top + 20, left : left + 20]
        assert np.abs(pixels("probe")[box] - before[box]).max() > 0.1, "nothing is drawn beside the pointer"
    edit().sequence_editor.active_strip.select = False
    click(region, region.width * 0.6, region.height * 0.6)
    yield 0.5
    assert any(strip.select for strip in edit().sequence_editor.strips), "the click has not come through"
    place = tuple(live.probe_at)
    move(region, region.width / 2, region.height + 12)
    yield 0.5
    assert tuple(live.probe_at) == place
    live.probe = False


def on_picture(region, x, y):
    """A point of the preview's region in fractions of the picture, which is not scaled; and how large a pixel of the
    region is there, as Blender rounds to one."""
    render, to_view = story.effect().scene.render, region.view2d.region_to_view
    size = render.resolution_x, render.resolution_y
    at = np.array(to_view(x, y))
    return at / size + 0.5, (np.array(to_view(x + 1, y + 1)) - at) / size


def pixels(name):
    image = bpy.data.images.load(str(shot(name)))
    found = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], -1)[::-1]
    bpy.data.images.remove(image)
    return found


def disabled(before):
    """Nothing is left, and the preview takes a click and a key."""
    addon_utils.disable(NAME)
    yield 1.0
    assert not traces.difference(before, traces.traces()), traces.difference(before, traces.traces())
    move(story.preview(), 60, 60)
    yield
    key("i")
    yield from drag(story.preview(), [(60, 60), (70, 90)])
    assert not (held := traces.forget()), held


def calls_wait():
    """What other threads ask of the main one while the extension is disabled is done once it is enabled again."""
    made = []
    part("blender.devices.main_thread").soon(lambda: made.append("asked"))
    addon_utils.disable(NAME)
    yield 0.3
    assert not made
    enable()
    yield 0.3
    assert made == ["asked"]


def steps():
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    yield 1.0
    driver.windows()[0].workspace.sequencer_scene.name = "Edit"
    edit().render.resolution_x, edit().render.resolution_y = 320, 180
    with override("PREVIEW"):
        bpy.ops.sequencer.view_all_preview()
    before = traces.traces()
    enable()
    yield 0.5
    yield from calls_wait()
    editor = edit().sequence_editor_create()
    editor.active_strip = editor.strips.new_movie("Bunny", story.FOOTAGE, 1, 1)
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("INVOKE_DEFAULT") == {"FINISHED"}
    yield from disabled(before)  # at once: the tab of the sidebar is still to be chosen
    enable()
    yield 1.0
    yield from painted_between_keys()
    shot("enabled")
    yield from a_drawn_region_is_one_step()
    yield from probe_follows_the_pointer()
    yield from disabled(before)
    shot("disabled")
    enable()
    yield 1.0
    assert len(story.effect().shutters) == 2, "the file keeps the effect"
    yield from paint(2, 0.5)
    assert abs(bars()[2] - 0.5) < 0.05, bars()
    shot("enabled again")
