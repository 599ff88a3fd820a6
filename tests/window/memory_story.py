"""Little memory on the GPU: a film as a job of the window has what the preview holds freed, and the preview has what
the film kept freed; with the film on moderngl's device, then on Blender's. Run inside Blender, by test_window.py.

SHUTTER_FOOTAGE has the first of the source's frames, SHUTTER_RECIPE the effect, SHUTTER_MEGABYTES the limit."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folders)
import os
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]

import bpy
import traces
from driver import OUT, area_of, enable, override, play, saw, until

FRAMES = 4
MEGABYTES = int(os.environ["SHUTTER_MEGABYTES"])
rendering = partial(bpy.app.is_job_running, "RENDER")


def session():
    return sys.modules[f"{traces.NAME}.shutter_addon.blender.rendering.session"]


def edit():
    return bpy.data.scenes["Edit"]


def opened():
    bpy.context.preferences.view.render_display_type = "NONE"  # its window would cover the other
    enable()
    bpy.ops.wm.read_homefile(app_template="Video_Editing")
    yield 1.0
    enable()
    bpy.context.window_manager.windows[0].workspace.sequencer_scene.name = "Edit"
    editor = edit().sequence_editor_create()
    editor.use_cache_raw = editor.use_cache_final = False
    source = Path(os.environ["SHUTTER_FOOTAGE"])
    strip = editor.strips.new_image("Source", str(source), 1, 1)
    for path in sorted(source.parent.iterdir())[1:]:
        strip.elements.append(path.name)
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
    edit().frame_start, edit().frame_end = 1, FRAMES


def held(which):
    """What a session's textures take, and the kind of its window; None: it has none."""
    device = which._compositor.device
    ((_key, renderer),) = which._renderers.values()
    window = renderer._window
    kind = type(window).__name__ if window is not None and window.is_open else None
    return sum(texture.bytes for texture in device._held), kind


def shown():
    """The preview, drawn at another frame."""
    frame = edit().frame_current % FRAMES + 1
    edit().frame_set(frame)
    area_of("SEQUENCE_EDITOR", "PREVIEW").tag_redraw()
    window = session()._window
    yield from until(lambda: window._renderers and held(window)[1], "the preview is composed", 60)
    yield 1.0


def story():
    yield from opened()
    preferences = bpy.context.preferences.addons[traces.NAME].preferences
    preferences.gpu_memory = MEGABYTES
    session().settle()
    part = session()
    for device in ("OPENGL", "BLENDER"):
        preferences.device = device
        yield from shown()
        before = held(part._window)
        edit().render.filepath = f"{OUT / device}/"
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], scene=edit()):
            bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
        budget, most, found = part._memory(), 0, {}
        while rendering():
            most = max(most, budget.used)
            with suppress(ValueError, RuntimeError):  # the film's thread takes its renderer out for a moment
                if part._offscreen._renderers and held(part._offscreen)[1]:  # what is drawn after it has that freed
                    found |= {"job": held(part._offscreen), "freed": held(part._window)}
            yield 0.05
        found |= {"device": type(part._offscreen._compositor.device).__name__, "limit": budget.limit, "before": before}
        yield from shown()
        most = max(most, budget.used)
        saw(**found, after=held(part._window), kept=held(part._offscreen), most=most)


play(story)
