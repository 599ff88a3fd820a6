"""In-between frames built in a real window: progress, Esc, the rest, what the panel says, and their removal; an effect
that is deleted, a file that is closed and an extension that is disabled meanwhile. Run inside Blender, by
test_rendered.py.

A slow blend stands in for optical flow, as OpenCV need not be there."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folder)
import os
import shutil
import sys
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]

import addon_utils
import bpy
import driver
import numpy as np
import story
import traces
from support import write_frames

COUNT, SIZE = 25, (180, 320)
FILM = driver.OUT / "film"


def part(name):
    return sys.modules[f"{traces.NAME}.shutter_addon.{name}"]


def slow_blend(first, second, factor, *_):
    time.sleep(0.3)
    weights = np.arange(1, factor) / factor
    return [(first * (1 - weight) + second * weight).astype(first.dtype) for weight in weights]


def frame(number, speed=8):
    """A white bar over a ramp, `speed` pixels further in every frame."""
    x = np.broadcast_to(np.arange(SIZE[1]), SIZE)
    bar = (x >= number * speed) & (x < number * speed + 40)
    return np.where(bar[..., None], 255, np.stack([x // 4, x // 3, 90 + 0 * x], axis=-1)).astype(np.uint8)


def prepared():
    """The extension, whose panel of in-between frames is open and others are not, in a saved file with an effect."""
    driver.enable()
    flow = part("media.flow")  # which needs OpenCV
    flow.check, flow.between = lambda: None, slow_blend
    for name, closed in (("regions", True), ("options", True), ("inbetween", False)):
        panel = getattr(bpy.types, f"SEQUENCER_PT_shutter_{name}")
        bpy.utils.unregister_class(panel)
        panel.bl_options = {"DEFAULT_CLOSED"} if closed else set()
        bpy.utils.register_class(panel)


def opened():
    yield from story.opened()
    area = driver.area_of("SEQUENCE_EDITOR", "SEQUENCER")
    window = bpy.context.window_manager.windows[0]
    edge = {"x": area.x + area.width // 2, "y": area.y + area.height}
    driver.xdotool("mousemove", edge["x"], window.height - 1 - edge["y"])  # where no region is active
    yield 0.5
    with bpy.context.temp_override(window=window):
        bpy.ops.screen.area_move(**edge, delta=200 - area.height)  # a low timeline, and room for the panel
    yield 0.5
    prepared()
    first = write_frames(FILM / "in", [frame(number) for number in range(COUNT)])
    edit = story.edit()
    edit.render.resolution_y, edit.render.resolution_x = SIZE
    editor = edit.sequence_editor
    source = editor.strips.new_image("Bar", str(first), 1, 1)
    for path in sorted(first.parent.iterdir())[1:]:
        source.elements.append(path.name)
    editor.active_strip = source
    bpy.ops.wm.save_as_mainfile(filepath=str(FILM / "film.blend"))
    with driver.override("SEQUENCER"):
        bpy.ops.shutter.add_effect("INVOKE_DEFAULT", True)
    yield 2.0
    edit.frame_set(3)
    story.effect().inbetween = "4"
    with driver.override("PREVIEW"):
        bpy.ops.sequencer.view_all_preview()
    yield 1.0


def look():
    building = part("blender.rendering.inbetween_build")
    building._looks.clear()  # which a second would do as well
    return building.look(*part("blender.data.selection").active(bpy.context))


def shown(name):
    """A picture of what the panel says; and what it is, noted."""
    region = story.preview()
    driver.move(region, region.width / 2, region.height / 2)
    for area in bpy.context.window_manager.windows[0].screen.areas:  # nobody told Blender of the files
        area.tag_redraw()
    yield 1.5
    driver.shot(name)
    state = look().state
    driver.saw(shown=name, state=state.name, done=state.done, total=state.total, size=look().size)


def building_begun():
    with driver.override("PREVIEW"):
        assert bpy.ops.shutter.inbetween_build("INVOKE_DEFAULT", True) == {"RUNNING_MODAL"}
    running = part("blender.rendering.inbetween_build").running()
    yield from driver.until(lambda: running.done >= 4, "pairs are built")
    assert not bpy.ops.shutter.inbetween_build.poll()


def ended():
    yield from driver.until(lambda: part("blender.rendering.inbetween_build").running() is None, "the build ends", 30)


def built():
    yield from shown("missing")
    yield from building_begun()
    driver.shot("building")
    driver.key("Escape")
    yield from ended()
    yield from shown("partial")
    yield from undone_meanwhile()
    yield from ended()
    yield from shown("ready")


def undone_meanwhile():
    """The build is no step of undo, and goes on."""
    bpy.ops.ed.undo_push(message="Factor")
    story.effect().border = False
    bpy.ops.ed.undo_push(message="Keep Edges Default")
    yield from building_begun()
    driver.key("ctrl+z")
    yield from driver.until(lambda: story.effect().border, "the border is back")
    assert part("blender.rendering.inbetween_build").running() is not None


def gone_stale_and_built_again():
    time.sleep(1.1)
    write_frames(FILM / "in", [frame(number, speed=6) for number in range(COUNT)])
    yield from shown("stale")
    yield from building_begun()
    yield from ended()
    yield from shown("again")


def removed():
    with driver.override("PREVIEW"):
        bpy.ops.shutter.inbetween_purge("INVOKE_DEFAULT", True)
    yield 1.0
    driver.shot("confirm")
    driver.key("Return")
    yield 1.0
    yield from shown("removed")
    assert not (FILM / "virtual_shutter_inbetween").exists()


def put_elsewhere():
    """The extension's own folder lies among the user's."""
    story.effect().inbetween_place = "USER"
    folder = part("blender.data.inbetween_settings").folder(story.effect())
    assert Path(os.environ["BLENDER_USER_RESOURCES"]) in folder.parents, folder
    yield from building_begun()
    driver.key("Escape")
    yield from ended()
    assert list(folder.rglob("0*.png"))
    with driver.override("PREVIEW"):
        bpy.ops.shutter.inbetween_purge("EXEC_DEFAULT", True)
    assert not folder.exists()
    story.effect().inbetween_place = "FILE"
    yield


def deleted_meanwhile():
    yield from building_begun()
    editor = story.edit().sequence_editor
    editor.strips.remove(next(strip for strip in editor.strips if strip.type == "SCENE"))
    yield from ended()
    driver.saw(deleted=len(story.edit().virtual_shutter.effects))
    bpy.ops.wm.open_mainfile(filepath=str(FILM / "film.blend"))
    yield 1.5


def closed_meanwhile():
    """The file was saved without its effect."""
    with driver.override("SEQUENCER"):
        bpy.ops.shutter.add_effect("INVOKE_DEFAULT", True)
    yield 1.0
    story.effect().inbetween = "4"
    bpy.ops.wm.save_mainfile()
    yield from built_anew()
    bpy.ops.wm.open_mainfile(filepath=str(FILM / "film.blend"))
    yield 1.0
    assert part("blender.rendering.inbetween_build").running() is None
    assert story.effect().inbetween == "4"
    driver.shot("opened again")
    driver.move(story.preview(), 50, 50)  # the operator that waits for an event gets one
    yield


def built_anew():
    shutil.rmtree(FILM / "virtual_shutter_inbetween")
    yield from building_begun()


def disabled_meanwhile():
    yield from built_anew()
    addon_utils.disable(traces.NAME)
    yield 1.0
    built = len(list((FILM / "virtual_shutter_inbetween").rglob("0*.png")))
    driver.saw(disabled=built)
    driver.move(story.preview(), 60, 60)
    yield 1.5
    assert len(list((FILM / "virtual_shutter_inbetween").rglob("0*.png"))) == built
    sys.modules.pop(f"{traces.NAME}.shutter_addon.media.flow", None)
    assert not (held := traces.forget()), held


def told():
    shutil.rmtree(FILM, ignore_errors=True)
    yield from opened()
    yield from built()
    yield from gone_stale_and_built_again()
    yield from removed()
    yield from put_elsewhere()
    yield from deleted_meanwhile()
    yield from closed_meanwhile()
    yield from disabled_meanwhile()


if __name__ == "__main__":
    driver.play(told)
