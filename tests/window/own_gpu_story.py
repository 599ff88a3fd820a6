"""Films as jobs of the window on Blender's own GPU, moderngl hidden: a whole one, while a second window opens and
closes; one that Esc ends; ten short ones; two that the window waits for; one during which the file is loaded again, and
one more. Run inside Blender, by test_rendered.py. SHUTTER_FOOTAGE has the source, SHUTTER_RECIPE the effect."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folders)
import sys
from functools import partial
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]
sys.modules["moderngl"] = None  # there is no such module

import bpy
import traces
from driver import OUT, area_of, key, move, override, play, region_of, saw, shot, until
from given_edit import edit, opened

FRAMES = 30
rendering = partial(bpy.app.is_job_running, "RENDER")


def part(name):
    return sys.modules[f"{traces.NAME}.shutter_addon.blender.{name}"]


def windows():
    return bpy.context.window_manager.windows


def begun(folder, first=1, last=FRAMES):
    """A job of the window."""
    edit().frame_start, edit().frame_end = first, last
    edit().render.filepath = f"{OUT / folder}/"
    with bpy.context.temp_override(window=windows()[0], scene=edit()):
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)


def ended():
    return until(lambda: not rendering(), "the render ends", 200)


def written(folder):
    return len(list((OUT / folder).glob("*.png")))


def held():
    """The job's device, and what its textures take."""
    # The one that renders just now: to ask for it would make another where there is none.
    device = part("rendering.sessions").OFFSCREEN._compositor.result().device
    # The budget counts the preview's as well.
    return type(device).__name__, device.name, sum(texture.bytes for texture in device._held)


def story():
    yield from opened()
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "edit.blend"))
    begun("film")
    yield from until(lambda: written("film") > 3, "frames are rendered", 100)
    yield from second_window_closed()
    yield from ended()
    saw(film=held())
    begun("stopped")
    yield from until(lambda: written("stopped") > 2, "frames are rendered", 100)
    region = region_of(area_of("SEQUENCE_EDITOR", "SEQUENCER"))
    move(region, region.width / 2, region.height / 2)
    yield
    key("Escape")
    yield from ended()
    for number in range(10):
        begun("short", 1 + number, 3 + number)
        yield from ended()
        saw(short=held())
    yield from sequencer_animation("waited", 1, 4)
    device = bpy.context.preferences.addons[traces.NAME].preferences
    device.device = "GPU"
    yield from sequencer_animation("refused", 1, 4)
    key("Escape")  # the menu that says why
    device.device = "AUTO"
    yield 0.5
    begun("left")
    yield from until(lambda: written("left") > 2, "frames are rendered", 100)
    yield from second_window_closed()  # until another one is drawn, Blender's GPU is not current
    bpy.ops.wm.open_mainfile(filepath=str(OUT / "edit.blend"))
    yield 1.0
    begun("after", 1, 5)
    yield from ended()
    saw(after=held())


def sequencer_animation(folder, first, last):
    """View ▸ Render Sequencer Animation: the window, which has the GPU, waits for its job."""
    edit().frame_start, edit().frame_end = first, last
    edit().render.filepath = f"{OUT / folder}/"
    with override("PREVIEW"):
        bpy.ops.render.opengl("INVOKE_DEFAULT", animation=True, sequencer=True)
    yield from ended()
    yield 0.5
    shot(folder)


def second_window_closed():
    bpy.ops.wm.window_new()
    yield 0.5
    with bpy.context.temp_override(window=windows()[-1]):
        bpy.ops.wm.window_close()


play(story)
