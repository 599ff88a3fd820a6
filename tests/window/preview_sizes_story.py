"""Previews of several sizes, and what reads the sequencer's pictures after them: the same frame, whatever was shown."""

import json
import subprocess
import time
from pathlib import Path

import bpy
import driver
import frame_trace
import story

FRAME = 50


def sessions():
    return driver.part("blender.rendering.sessions")


def space():
    return driver.area_of("SEQUENCE_EDITOR", "PREVIEW").spaces.active


def composed():
    """The sizes of what the window's session holds, and whether that is read from a proxy."""
    # What was composed, in place of what would be now.
    sources = [renderer.source for _key, renderer in sessions().SESSIONS.window._renderers.values()]
    return [[source.width, source.height] + ["proxy"] * source.from_proxy for source in sources]


def effect_added():
    with driver.override("SEQUENCER"):
        assert bpy.ops.shutter.add_effect("EXEC_DEFAULT") == {"FINISHED"}
    region = {"shutter": "Sharp", "kind": "line", "width": 0.05, "strokes": [[[0.45, 0.2], [0.5, 0.8]]]}
    shutters = [{"name": "Long", "bars": [1] * 8}, {"name": "Sharp", "bars": [1] + [0] * 7}]
    recipe = {"version": 2, "inbetween": 1, "window": 8, "border": True, "shutters": shutters, "regions": [region]}
    (driver.OUT / "recipe.json").write_text(json.dumps(recipe))
    with driver.override("SEQUENCER"):
        assert bpy.ops.shutter.recipe_import(filepath=str(driver.OUT / "recipe.json")) == {"FINISHED"}
    space().show_region_ui = space().show_gizmo = space().show_overlays = False
    story.all_viewed()
    yield 1.0


def shown(name, **settings):
    for key, value in settings.items():
        setattr(space(), key, value)
    story.preview().tag_redraw()
    yield from story.seen(name, composed=composed)


def sizes():
    for percent in (100, 50, 25):
        yield from shown(f"at_{percent}", proxy_render_size=f"PROXY_{percent}")
    settings = bpy.context.window_manager.virtual_shutter
    for view in ("SPLIT", "COEFFICIENTS", "SCRIBBLES", "RESULT"):
        settings.view = view
        yield from shown(f"view_{view}")
    strip = driver.edit().sequence_editor.active_strip
    strip.transform.scale_x = strip.transform.scale_y = 2.0
    yield from shown("enlarged")
    strip.transform.scale_x = strip.transform.scale_y = 1.0
    yield from shown("waveform", display_mode="WAVEFORM")
    yield from shown("image", display_mode="IMAGE")
    settings.live = False
    yield from shown("engine", proxy_render_size="PROXY_100")
    settings.live = True


def proxies():
    """Read at their size, where they are to be used; they stay for what follows. Blender has the others built by
    itself, as the preview's size changes."""
    source = next(strip for strip in driver.edit().sequence_editor.strips if strip.type == "MOVIE")
    source.select = source.use_proxy = source.proxy.build_25 = True
    yield from shown("no_proxy_built", proxy_render_size="PROXY_25")
    with driver.override("SEQUENCER"):
        assert bpy.ops.sequencer.rebuild_proxy() == {"FINISHED"}
    space().show_overlays = True
    yield from shown("proxy_note")
    space().show_overlays = False
    yield from shown("proxy")
    yield from shown("proxy_unused", use_proxies=False)
    yield from shown("proxy_of_half", use_proxies=True, proxy_render_size="PROXY_50")
    settings, effect = bpy.context.window_manager.virtual_shutter, driver.edit().sequence_editor.active_strip
    settings.view, settings.split = "SPLIT", 1.0
    yield from shown("proxy_still", proxy_render_size="PROXY_25")
    settings.view, settings.split = "RESULT", 0.5
    effect.mute = True
    yield from shown("proxy_by_blender")
    effect.mute = False


def in_a_job(name):
    driver.render(f"{name}.png", write_still=True)
    yield from driver.render_ended()
    yield 0.5


def by_script(name, scene=None):
    edit = scene or driver.edit()
    edit.render.filepath = str(driver.OUT / f"{name}.png")
    bpy.ops.render.render(write_still=True, scene=edit.name)


def by_opengl(name):
    driver.edit().render.filepath = str(driver.OUT / f"{name}.png")
    with driver.override("PREVIEW"):
        bpy.ops.render.opengl(sequencer=True, write_still=True)


def by_opengl_in_a_job(name):
    """As by the preview's menu, which renders beside the main thread, and has that wait."""
    edit, written = driver.edit(), driver.OUT / f"{name}{FRAME:04d}.png"
    edit.render.filepath = str(driver.OUT / name)
    limits, (edit.frame_start, edit.frame_end) = (edit.frame_start, edit.frame_end), (FRAME, FRAME)
    with driver.override("PREVIEW"):
        bpy.ops.render.opengl("INVOKE_DEFAULT", sequencer=True, animation=True)
    yield from driver.until(lambda: written.exists() and not driver.rendering(), "it is rendered", 40)
    edit.frame_start, edit.frame_end = limits
    edit.frame_set(FRAME)
    yield 0.5


def played(seconds):
    with driver.override("SEQUENCER"):
        bpy.ops.screen.animation_play()
    yield seconds


def stopped():
    with driver.override("SEQUENCER"):
        bpy.ops.screen.animation_cancel(restore_frame=False)
    driver.edit().frame_set(FRAME)
    yield 1.0


def kept_time():
    """Playing with Frame Dropping: when each picture was drawn, at which frame, and of which source frame it is."""
    edit, drawn = driver.edit(), []

    def note():
        ((_snapshot, _frame, request),) = sessions().SESSIONS.window.requests.values()  # what was drawn, as above
        drawn.append((time.perf_counter(), edit.frame_current, request.index))

    kept, edit.sync_mode = edit.sync_mode, "FRAME_DROP"
    edit.frame_set(1)
    yield from played(0.5)
    package = Path(driver.part("compute.renderer").__file__).parents[1]
    with frame_trace.traced(package, "VirtualShutterEngine.render", "_draw") as stops:
        yield from driver.until(lambda: any(stop.function == "Quad.draw" for stop in stops), "a frame is drawn")
        yield 0.5
    back = frame_trace.returns(stops)
    assert len(back) <= 8, back
    handler = bpy.types.SpaceSequenceEditor.draw_handler_add(note, (), "PREVIEW", "POST_PIXEL")
    yield 3.0
    bpy.types.SpaceSequenceEditor.draw_handler_remove(handler, "PREVIEW")
    yield from stopped()
    edit.sync_mode = kept
    driver.saw(drawn=drawn, rate=edit.render.fps / edit.render.fps_base)


def in_a_handler(name):
    def render(*_):
        by_script(name)

    bpy.app.handlers.undo_post.append(render)
    bpy.ops.ed.undo_push(message="One")
    story.effect().shutters[1].name = "Other"
    bpy.ops.ed.undo_push(message="Two")
    bpy.ops.ed.undo()
    bpy.app.handlers.undo_post.remove(render)
    yield 1.0


def other_edit():
    other = bpy.data.scenes.new("Other")
    render, own = other.render, driver.edit().render
    for name in ("resolution_x", "resolution_y", "dither_intensity", "fps"):
        setattr(render, name, getattr(own, name))
    other.view_settings.view_transform = "Standard"
    render.image_settings.media_type, render.image_settings.file_format = "IMAGE", "PNG"
    strip = other.sequence_editor_create().strips.new_scene("Edit", driver.edit(), 1, 1)
    strip.scene_input = "SEQUENCER"
    other.frame_set(FRAME)
    return other


def tricked():
    """Renders of the same frame, after and between previews of a quarter's size."""
    space().proxy_render_size = "PROXY_25"
    yield 1.0
    yield from in_a_job("job")
    by_script("script")
    yield 1.0
    by_script("script_again")
    story.preview().tag_redraw()
    yield 1.0
    by_opengl("opengl")
    yield 1.0
    yield from by_opengl_in_a_job("opengl_job_")
    yield from played(1.5)
    driver.edit().frame_set(FRAME)
    yield from in_a_job("playing")  # of the frame that it begins with, while the playhead goes on
    yield from stopped()
    yield from in_a_handler("handler")
    by_script("scene_strip", other_edit())
    yield 1.0
    yield from shown("after")
    yield from in_a_job("job_after")


def in_background(frame):
    """The same frame of the saved file, by a Blender without a window."""
    path = driver.OUT / "edit.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    output = str(driver.OUT / "background_")
    command = [bpy.app.binary_path, "--factory-startup", "--addons", driver.NAME, "-b", path, "-o", output]
    command += ["-f", str(frame)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    yield from driver.until(lambda: process.poll() is not None, "the render without a window ends", 60)
    assert process.returncode == 0
    driver.saw(background=process.stdout.read())


def steps():
    yield from story.opened(640, 360)
    yield from story.movie_added()
    driver.edit().frame_set(FRAME)
    yield from effect_added()
    space().proxy_render_size = "PROXY_100"
    yield from kept_time()
    yield from sizes()
    yield from proxies()
    yield from tricked()
    yield from in_background(FRAME)
