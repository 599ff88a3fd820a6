"""Renders from the window that end early: a picture that fails, in a movie and in a folder, and Esc.

Run in a Blender with a window, the checkout linked as an extension."""

# ruff: noqa: E402 (Blender finds the helpers once it knows their folders)
import sys
from functools import partial
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "blender")]

import bpy
import numpy as np
import support
import traces
from driver import OUT, area_of, key, move, play, region_of, saw, shot, until, video_editing_opened

FRAMES, BROKEN = 200, 15
rendering = partial(bpy.app.is_job_running, "RENDER")


def edit_now():
    return bpy.context.window_manager.windows[0].workspace.sequencer_scene


def add_effect():
    frames = np.random.default_rng(1).integers(0, 256, (1, 360, 640, 3), dtype=np.uint8).repeat(FRAMES, 0)
    first = support.write_frames(OUT / "frames", frames)
    files = [{"name": path.name} for path in sorted(first.parent.iterdir())]
    area = area_of("SEQUENCE_EDITOR", "SEQUENCER")
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area, region=region_of(area)):
        # Not by elements.append, which leaves their sizes to chance: of a missing file Blender makes a picture of such.
        bpy.ops.sequencer.image_strip_add(
            "EXEC_DEFAULT", directory=str(first.parent), files=files, channel=1, frame_start=1, move_strips=False
        )
        # Missing, not cut off: of such a file, Blender's own thumbnails crash now and then.
        first.with_name(f"f{BROKEN:04d}.png").unlink()
        edit_now().sequence_editor.active_strip = edit_now().sequence_editor.strips[0]
        assert bpy.ops.shutter.add_effect("INVOKE_DEFAULT") == {"FINISHED"}
    effect = edit_now().virtual_shutter.effects[0]
    effect.shutters[0].bars[0].weight = 1
    for bar in effect.shutters[0].bars[1:]:
        bar.weight = 0


def begun(path, first, last):
    """A render as a job of the window."""
    edit = edit_now()
    edit.render.use_file_extension = path.suffix == ""
    if path.suffix:
        edit.render.image_settings.media_type = "VIDEO"
        edit.render.ffmpeg.format, edit.render.ffmpeg.codec = "MPEG4", "H264"
    else:
        edit.render.image_settings.media_type = "IMAGE"
        edit.render.image_settings.file_format = "PNG"
    edit.render.filepath = str(path) + ("" if path.suffix else "/")
    edit.frame_start, edit.frame_end = first, last
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], scene=edit):
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
    yield from until(rendering, "a render begins")


def story():
    yield from video_editing_opened()
    edit = edit_now()
    edit.render.resolution_x, edit.render.resolution_y = 640, 360
    add_effect()
    yield 1.0
    ended = []
    for name in ("render_cancel", "render_complete"):
        handlers = getattr(bpy.app.handlers, name)
        handlers.append(lambda scene, *_, name=name: ended.append((scene.name, name)))
    for name in ("film.mp4", "folder"):
        ended.clear()
        yield from begun(OUT / name, 1, 30)
        yield from until(lambda: not rendering(), "the render ends", 100)
        yield 1.0
        shot(f"failed_{name}")
        saw(output=name, ended=[kind for scene, kind in ended if scene == edit.name])
        key("Escape")  # the menu that says it
        yield 0.5
    scenes = [scene.name for scene in bpy.data.scenes]
    saw(scenes=scenes)
    pictures = sys.modules[f"{traces.NAME}.shutter_addon.blender.rendering.pictures"]
    picture, shown = pictures.picture, []

    def asked(*arguments):
        found = picture(*arguments)
        shown.append(found.shape)
        return found

    pictures.picture = asked
    edit.frame_set(BROKEN + 30)
    area_of("SEQUENCE_EDITOR", "PREVIEW").tag_redraw()
    yield from until(lambda: shown, "the preview shows another frame", 20)
    pictures.picture = picture
    saw(shown=shown)
    ended.clear()
    yield from begun(OUT / "stopped.mp4", BROKEN + 1, FRAMES)
    yield from until(lambda: edit.frame_current > BROKEN + 20 or not rendering(), "frames are rendered", 100)
    region = region_of(area_of("SEQUENCE_EDITOR", "SEQUENCER"))
    move(region, region.width / 2, region.height / 2)
    yield 0.5
    shot("running")
    key("Escape")
    yield from until(lambda: not rendering(), "Esc ends the render", 20)
    saw(output="stopped.mp4", ended=[kind for scene, kind in ended if scene == edit.name])
    # and what follows renders as ever
    ended.clear()
    yield from begun(OUT / "after.mp4", BROKEN + 1, BROKEN + 5)
    yield from until(lambda: not rendering(), "the render ends", 100)
    saw(output="after.mp4", ended=[kind for scene, kind in ended if scene == edit.name])


play(story)
