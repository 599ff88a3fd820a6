"""Renders from the window that end early: a picture that fails, in a movie and in a folder, and Esc."""

import bpy
import driver
import numpy as np
import support
from driver import OUT, area_of, edit, key, move, override, part, render, render_ended, rendering, saw, shot, until

FRAMES, BROKEN = 200, 15


def add_effect():
    frames = np.random.default_rng(1).integers(0, 256, (1, 180, 320, 3), dtype=np.uint8).repeat(FRAMES, 0)
    first = support.write_frames(OUT / "frames", frames)
    files = [{"name": path.name} for path in sorted(first.parent.iterdir())]
    with override("SEQUENCER"):
        # Not by elements.append, which leaves their sizes to chance: of a missing file Blender makes a picture of such.
        bpy.ops.sequencer.image_strip_add(
            "EXEC_DEFAULT", directory=str(first.parent), files=files, channel=1, frame_start=1, move_strips=False
        )
        # Missing, not cut off: of such a file, Blender's own thumbnails crash now and then.
        first.with_name(f"f{BROKEN:04d}.png").unlink()
        edit().sequence_editor.active_strip = edit().sequence_editor.strips[0]
        assert bpy.ops.shutter.add_effect("INVOKE_DEFAULT") == {"FINISHED"}
    effect = edit().virtual_shutter.effects[0]
    effect.shutters[0].bars[0].weight = 1
    for bar in effect.shutters[0].bars[1:]:
        bar.weight = 0


def begun(name, first, last):
    settings = edit().render
    settings.use_file_extension = "." not in name
    if "." in name:
        settings.image_settings.media_type = "VIDEO"
        settings.ffmpeg.format, settings.ffmpeg.codec = "MPEG4", "H264"
    else:
        settings.image_settings.media_type = "IMAGE"
    edit().frame_start, edit().frame_end = first, last
    render(name if "." in name else f"{name}/", animation=True)
    yield from until(rendering, "a render begins")


def steps():
    yield from driver.video_editing_opened()
    edit().render.resolution_x, edit().render.resolution_y = 320, 180
    add_effect()
    yield 1.0
    ended = []
    for name in ("render_cancel", "render_complete"):
        handlers = getattr(bpy.app.handlers, name)
        handlers.append(lambda scene, *_, name=name: ended.append((scene.name, name)))
    for name in ("film.mp4", "folder"):
        ended.clear()
        yield from begun(name, 1, 30)
        yield from render_ended()
        yield 1.0
        shot(f"failed_{name}")
        saw(output=name, ended=[kind for scene, kind in ended if scene == "Edit"])
        key("Escape")  # the menu that says it
        yield 0.5
    scenes = [scene.name for scene in bpy.data.scenes]
    saw(scenes=scenes)
    pictures = part("blender.rendering.pictures")
    picture, shown = pictures.picture, []

    def asked(*arguments):
        found = picture(*arguments)
        shown.append(found.shape)
        return found

    pictures.picture = asked
    edit().frame_set(BROKEN + 30)
    area_of("SEQUENCE_EDITOR", "PREVIEW").tag_redraw()
    yield from until(lambda: shown, "the preview shows another frame", 20)
    pictures.picture = picture
    saw(shown=shown)
    ended.clear()
    yield from begun("stopped.mp4", BROKEN + 1, FRAMES)
    yield from until(lambda: edit().frame_current > BROKEN + 20 or not rendering(), "frames are rendered", 100)
    region = driver.region_of(area_of("SEQUENCE_EDITOR", "SEQUENCER"))
    move(region, region.width / 2, region.height / 2)
    yield 0.5
    shot("running")
    key("Escape")
    yield from until(lambda: not rendering(), "Esc ends the render", 20)
    saw(output="stopped.mp4", ended=[kind for scene, kind in ended if scene == "Edit"])
    # and what follows renders as ever
    ended.clear()
    yield from begun("after.mp4", BROKEN + 1, BROKEN + 5)
    yield from render_ended()
    saw(output="after.mp4", ended=[kind for scene, kind in ended if scene == "Edit"])
