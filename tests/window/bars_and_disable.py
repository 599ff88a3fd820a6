"""Bars painted between two keys, and the extension disabled while all of it is on the screen.

Run in a Blender with a window, the checkout linked as an extension."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folders)
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]

import addon_utils
import bpy
import numpy as np
import traces
from driver import area_of, click, drag, enable, key, move, play, region_of, screen, shot

FOOTAGE = Path(__file__).parents[2] / "assets" / "bigbuckbunny.mp4"


def edit_now():
    return bpy.context.window_manager.windows[0].workspace.sequencer_scene


def effect_now():
    return edit_now().virtual_shutter.effects[0]


def part(name):
    """A module of the extension that is enabled now."""
    return sys.modules[f"{traces.NAME}.shutter_addon.blender.{name}"]


def bars():
    return part("editing.bar_edits").bars_now(effect_now(), 0)


def preview():
    area = area_of("SEQUENCE_EDITOR", "PREVIEW")
    return bpy.context.window_manager.windows[0], area, region_of(area, "PREVIEW")


def add_effect():
    strips = edit_now().sequence_editor_create().strips
    edit_now().sequence_editor.active_strip = strips.new_movie("Bunny", str(FOOTAGE), 1, 1)
    area = area_of("SEQUENCE_EDITOR", "SEQUENCER")
    with bpy.context.temp_override(window=preview()[0], area=area, region=region_of(area)):
        assert bpy.ops.shutter.add_effect("INVOKE_DEFAULT") == {"FINISHED"}


def paint(bar, weight):
    """Drags a bar of the bar editor to a weight."""
    _, _, region = preview()
    editor = part("interface.bar_editor")
    place = editor.layout(region.width, bars(), bpy.context.preferences.system.ui_scale)
    left, bottom, right, top = place.box
    x = left + (bar + 0.5) * (right - left) / place.count
    ys = [bottom + share * (top - bottom) for share in (0.1, weight / 2, weight)]
    yield from drag(region, [(x, y) for y in ys])
    yield 0.5


def painted_between_keys():
    """The other bars stay as they were shown; an undo brings all of them back."""
    editing, effect, edit = part("editing.bar_edits"), effect_now(), edit_now()
    effect.active_shutter = 0
    for frame, shown in ((1, np.eye(8)[0]), (9, np.eye(8)[7])):
        edit.frame_set(frame)
        editing.paint(effect, 0, shown, key=True)
    edit.frame_set(5)
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
    window, area, region = preview()
    with bpy.context.temp_override(window=window, area=area, region=region):
        assert bpy.ops.shutter.draw("INVOKE_DEFAULT", True) == {"FINISHED"}
    yield 0.5
    assert len(effect_now().regions) == len(effect_now().scene.annotation.layers) == 1
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")
    move(region, 200, 200)
    yield
    key("ctrl+z")
    yield 1.0
    assert len(effect_now().regions) == len(effect_now().scene.annotation.layers) == 0


def probe_follows_the_pointer():
    """The probe shows the pixel under the pointer, keeps it while the pointer is elsewhere, and takes no click."""
    _, _, region = preview()
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
    edit_now().sequence_editor.active_strip.select = False
    click(region, region.width * 0.6, region.height * 0.6)
    yield 0.5
    assert any(strip.select for strip in edit_now().sequence_editor.strips), "the click has not come through"
    place = tuple(live.probe_at)
    move(region, region.width / 2, region.height + 12)
    yield 0.5
    assert tuple(live.probe_at) == place


def on_picture(region, x, y):
    """A point of the preview's region in fractions of the picture, which is not scaled; and how large a pixel of the
    region is there, as Blender rounds to one."""
    render, to_view = effect_now().scene.render, region.view2d.region_to_view
    size = render.resolution_x, render.resolution_y
    at = np.array(to_view(x, y))
    return at / size + 0.5, (np.array(to_view(x + 1, y + 1)) - at) / size


def pixels(name):
    """What the screen shows, top row first."""
    image = bpy.data.images.load(str(shot(name)))
    found = np.array(image.pixels[:]).reshape(image.size[1], image.size[0], -1)[::-1]
    bpy.data.images.remove(image)
    return found


def disabled(before):
    """Nothing is left, and the preview takes a click and a key."""
    addon_utils.disable(traces.NAME)
    yield 1.0
    assert not traces.difference(before, traces.traces()), traces.difference(before, traces.traces())
    move(preview()[2], 60, 60)
    yield
    key("i")
    yield from drag(preview()[2], [(60, 60), (70, 90)])
    assert not (held := traces.forget()), held


def calls_wait():
    """What other threads ask of the main one while the extension is disabled is done once it is enabled again."""
    made = []
    part("devices.main_thread").soon(lambda: made.append("asked"))
    addon_utils.disable(traces.NAME)
    yield 0.3
    assert not made
    enable()
    yield 0.3
    assert made == ["asked"]


def story():
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    yield 1.0
    before = traces.traces()
    enable()
    yield 0.5
    yield from calls_wait()
    add_effect()
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
    assert len(effect_now().shutters) == 2, "the file keeps the effect"
    yield from paint(2, 0.5)
    assert abs(bars()[2] - 0.5) < 0.05, bars()
    shot("enabled again")


play(story)
