"""Films as jobs of the window on Blender's own GPU, moderngl hidden: a whole one, while a second window opens and
closes; one that Esc ends; ten short ones; two that the window waits for; one during which the file is loaded again."""

import bpy
import driver
from driver import NAME, OUT, area_of, edit, film, key, move, override, part, region_of, render_ended, saw, until
from given_edit import opened

FRAMES = 30


def written(folder):
    return len(list((OUT / folder).glob("*.png")))


def held():
    # The one that renders just now: to ask for it would make another where there is none.
    device = part("blender.rendering.sessions").SESSIONS.offscreen._compositor.result().device
    # The budget counts the preview's as well.
    return type(device).__name__, device.name, sum(texture.bytes for texture in device._held)


def steps():
    yield from opened()
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "edit.blend"))
    film("film", 1, FRAMES)
    yield from until(lambda: written("film") > 3, "frames are rendered", 100)
    yield from second_window_closed()
    yield from render_ended()
    saw(film=held())
    film("stopped", 1, FRAMES)
    yield from until(lambda: written("stopped") > 2, "frames are rendered", 100)
    region = region_of(area_of("SEQUENCE_EDITOR", "SEQUENCER"))
    move(region, region.width / 2, region.height / 2)
    yield
    key("Escape")
    yield from render_ended()
    for number in range(10):
        film("short", 1 + number, 3 + number)
        yield from render_ended()
        saw(short=held())
    yield from sequencer_animation("waited", 1, 4)
    device = bpy.context.preferences.addons[NAME].preferences
    device.device = "GPU"
    yield from sequencer_animation("refused", 1, 4)
    key("Escape")  # the menu that says why
    device.device = "AUTO"
    yield 0.5
    film("left", 1, FRAMES)
    yield from until(lambda: written("left") > 2, "frames are rendered", 100)
    yield from second_window_closed()  # until another one is drawn, Blender's GPU is not current
    bpy.ops.wm.open_mainfile(filepath=str(OUT / "edit.blend"))
    yield 1.0
    film("after", 1, 5)
    yield from render_ended()
    saw(after=held())


def sequencer_animation(folder, first, last):
    """View ▸ Render Sequencer Animation: the window, which has the GPU, waits for its job."""
    edit().frame_start, edit().frame_end = first, last
    edit().render.filepath = f"{OUT / folder}/"
    with override("PREVIEW"):
        bpy.ops.render.opengl("INVOKE_DEFAULT", animation=True, sequencer=True)
    yield from render_ended()
    yield 0.5
    driver.shot(folder)


def second_window_closed():
    bpy.ops.wm.window_new()
    yield 0.5
    with bpy.context.temp_override(window=driver.windows()[-1]):
        bpy.ops.wm.window_close()
