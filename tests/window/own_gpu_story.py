"""The same film as a job of the window on Blender's own GPU and on OpenGL's, while the window is drawn again all the
time: run inside Blender, by test_window.py."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folders)
import json
import os
import sys
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]

import bpy
import support
from driver import OUT, area_of, enable, override, play, saw, until

NAME = "bl_ext.user_default.virtual_shutter"
FRAMES, SIZE, WINDOW = json.loads(os.environ.get("SHUTTER_FILM", "[30, [640, 360], 16]"))
ROUNDS = json.loads(os.environ.get("SHUTTER_ROUNDS", '["blender", "opengl", "blender", "opengl"]'))
BIG = 1 << 20


def part(name):
    return sys.modules[f"{NAME}.shutter_addon.blender.{name}"]


def edit():
    return bpy.data.scenes["Edit"]


def opened():
    bpy.context.preferences.view.render_display_type = "NONE"
    enable()
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    yield 1.0
    enable()
    scene = bpy.context.window_manager.windows[0].workspace.sequencer_scene
    scene.name = "Edit"
    render = scene.render
    render.resolution_x, render.resolution_y = SIZE
    render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format = "PNG"
    render.image_settings.compression = 0
    render.dither_intensity = 0
    scene.view_settings.view_transform = "Standard"
    scene.frame_start, scene.frame_end = 1, FRAMES
    editor = scene.sequence_editor_create()
    editor.use_cache_raw = editor.use_cache_final = False
    editor.active_strip = editor.strips.new_movie("Footage", os.environ["SHUTTER_FOOTAGE"], 1, 1)
    with override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("EXEC_DEFAULT") == {"FINISHED"}
    lines = [[[0.3, 0.2], [0.5, 0.8]], [[0.7, 0.2], [0.7, 0.8]]]
    regions = [
        {
            "name": f"R{i}",
            "shutter": f"S{i + 1}",
            "width": 0.02,
            "strokes": [line],
            "keys": [{"frame": 1}, {"frame": FRAMES, "location": [0.1, 0.0]}],
        }
        for i, line in enumerate(lines)
    ]
    bars = [[1] * WINDOW, [1] + [0] * (WINDOW - 1), [k / WINDOW for k in range(WINDOW)]]
    path = OUT / "recipe.json"
    path.write_text(json.dumps(support.recipe(WINDOW, *bars, regions=regions, border=True)))
    with override("PREVIEW"):
        assert bpy.ops.shutter.recipe_import("EXEC_DEFAULT", filepath=str(path)) == {"FINISHED"}


class Redraws:
    """When the timeline was drawn."""

    def __init__(self):
        self.times = []
        kind = bpy.types.SpaceSequenceEditor
        self._remove = lambda handler=kind.draw_handler_add(self._drawn, (), "WINDOW", "POST_PIXEL"): (
            kind.draw_handler_remove(handler, "WINDOW")
        )

    def _drawn(self):
        self.times.append(time.perf_counter())

    def tag(self):
        area_of("SEQUENCE_EDITOR", "SEQUENCER").tag_redraw()

    def longest(self):
        self._remove()
        return max(b - a for a, b in zip(self.times, self.times[1:], strict=False))


def rendered(number, device):
    """The film as a job."""
    bpy.context.preferences.addons[NAME].preferences.device = device.upper()
    ended = []
    handlers = bpy.app.handlers
    end = lambda scene, *_: ended.append(time.perf_counter()) if scene == edit() else None  # noqa: E731
    handlers.render_complete.append(end)
    edit().render.filepath = str(OUT / f"{number}_{device}") + "/"
    redraws, start = Redraws(), time.perf_counter()
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], scene=edit()):
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
    while not ended:
        redraws.tag()
        yield 0.02
    yield from until(lambda: not bpy.app.is_job_running("RENDER"), "the job ends")
    handlers.render_complete.remove(end)
    session = part("rendering.session")
    compositor = session._offscreen._compositor
    saw(
        film=f"{number}_{device}",
        device=compositor and type(compositor.device).__name__,
        name=compositor and compositor.device.name,
        seconds=ended[0] - start,
        redraws=len(redraws.times),
        longest=redraws.longest(),
        rss=rss(),
    )


def rss():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def story():
    yield from opened()
    yield 1.0
    for number, device in enumerate(ROUNDS):
        yield from rendered(number, device)


play(story)
