"""Films as jobs of the window on Blender's own GPU, moderngl hidden: a whole one, while a second window opens and
closes; one that Esc ends; ten short ones; one more after the file was loaded again. Run inside Blender, by
test_window.py.

SHUTTER_BESIDE=1 measures in place of that: films on Blender's GPU and on moderngl's in turn, and the longest wait
between two redraws of the window. SHUTTER_FOOTAGE has the source, SHUTTER_RECIPE the effect."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folders)
import json
import os
import sys
import time
from functools import partial
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]
BESIDE = bool(os.environ.get("SHUTTER_BESIDE"))
if not BESIDE:
    sys.modules["moderngl"] = None  # there is no such module

import bpy
import traces
from driver import OUT, area_of, enable, key, move, override, play, region_of, saw, until

FRAMES = 30
rendering = partial(bpy.app.is_job_running, "RENDER")


def part(name):
    return sys.modules[f"{traces.NAME}.shutter_addon.blender.{name}"]


def edit():
    return bpy.data.scenes["Edit"]


def windows():
    return bpy.context.window_manager.windows


def opened():
    bpy.context.preferences.view.render_display_type = "NONE"  # its window would cover the other
    enable()
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    yield 1.0
    enable()
    windows()[0].workspace.sequencer_scene.name = "Edit"
    editor = edit().sequence_editor_create()
    editor.use_cache_raw = editor.use_cache_final = False
    strips = editor.strips
    source = Path(os.environ["SHUTTER_FOOTAGE"])
    if source.suffix == ".png":
        strip = strips.new_image("Source", str(source), 1, 1)
        for path in sorted(source.parent.iterdir())[1:]:
            strip.elements.append(path.name)
    else:
        strip = strips.new_movie("Source", str(source), 1, 1)
    editor.active_strip = strip
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("EXEC_DEFAULT") == {"FINISHED"}
    with override("PREVIEW"):
        assert bpy.ops.shutter.recipe_import("EXEC_DEFAULT", filepath=os.environ["SHUTTER_RECIPE"]) == {"FINISHED"}
    render = edit().render
    element = strip.elements[0]
    render.resolution_x, render.resolution_y = element.orig_width, element.orig_height
    render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "PNG"
    render.image_settings.compression = 0
    render.dither_intensity = 0
    edit().view_settings.view_transform = "Standard"
    bpy.ops.wm.save_as_mainfile(filepath=str(OUT / "edit.blend"))


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
    device = part("rendering.session")._offscreen._compositor.device
    return type(device).__name__, device.name, sum(texture.bytes for texture in device._held)


def story():
    yield from opened()
    begun("film")
    yield from until(lambda: written("film") > 3, "frames are rendered", 100)
    bpy.ops.wm.window_new()
    yield 0.5
    with bpy.context.temp_override(window=windows()[-1]):
        bpy.ops.wm.window_close()
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
    bpy.ops.wm.open_mainfile(filepath=str(OUT / "edit.blend"))
    yield 1.0
    begun("after", 1, 5)
    yield from ended()
    saw(after=held())


class Redraws:
    """When the timeline was drawn, again and again."""

    def __init__(self):
        self.times = []
        self._handler = bpy.types.SpaceSequenceEditor.draw_handler_add(self._drawn, (), "WINDOW", "POST_PIXEL")

    def _drawn(self):
        self.times.append(time.perf_counter())

    def tag(self):
        area_of("SEQUENCE_EDITOR", "SEQUENCER").tag_redraw()

    def longest(self):
        bpy.types.SpaceSequenceEditor.draw_handler_remove(self._handler, "WINDOW")
        return max(b - a for a, b in zip(self.times, self.times[1:], strict=False))


def measured():
    yield from opened()
    for device in json.loads(os.environ.get("SHUTTER_ROUNDS", '["blender", "opengl", "blender", "opengl"]')):
        bpy.context.preferences.addons[traces.NAME].preferences.device = device.upper()
        redraws, start = Redraws(), time.perf_counter()
        begun(device)
        yield 0.1
        while rendering():
            redraws.tag()
            yield 0.02
        seconds = time.perf_counter() - start
        saw(device=held(), seconds=seconds, redraws=len(redraws.times), longest=redraws.longest())


play(measured if BESIDE else story)
